"""What somebody computes from leaves a node before what is only recorded."""

import numpy as np
import pytest
from ros_graph import load_ros, new_domain

load_ros()

from cspm_msgs_py.ros.contract_node import ros_class  # noqa: E402 - after ROS is known to be there
from cspm_msgs_py.ros.intake import Intake  # noqa: E402
from cspm_msgs_py.ros.outbox import Outbox  # noqa: E402
from cspm_msgs_py.ros.session import Session  # noqa: E402
from cspm_msgs_py.topics import contract_topics  # noqa: E402
from cspm_msgs_py.wire import WireReader  # noqa: E402

PATIENCE_S = 20.0
TOPICS = contract_topics(["a", "b"], has_bar=False, has_winch_frame=False)
TENSION, COMMAND = TOPICS["/cables/tension"], TOPICS["/tension_command"]


@pytest.fixture
def post():
    """Return an outbox, how to send two rows a topic, and what its reader has by now."""
    with Session(domain_id=new_domain()) as session:
        sender, recorder = session.node("sender"), session.node("recorder")
        intake, came = Intake(recorder.node), {TENSION.name: [], COMMAND.name: []}
        for topic in (TENSION, COMMAND):
            keep, decode = came[topic.name].append, WireReader(topic).decode
            intake.subscribe(
                topic,
                ros_class(topic.ros_type),
                lambda payload, *_, keep=keep, decode=decode: keep(decode(payload)[0]),
            )
        outbox = Outbox(sender)
        kept = outbox.publisher(TENSION, ["recorder"])
        urgent = outbox.publisher(COMMAND, ["recorder", "somebody"])

        def both(stamp):
            row = np.array([1.0, 2.0])
            kept(stamp, stamp, row)
            # Rows may change after the call.
            row[:] = 5.0
            urgent(stamp, stamp, row)

        def look(count):
            def there():
                intake.take()
                return sum(map(len, came.values())) >= count

            assert session.spin_until(there, PATIENCE_S), came
            return came

        # Nobody is named `somebody`: one reader is all there is to wait for.
        connected = lambda: sender.unmatched() == ["/tension_command (somebody)"]  # noqa: E731
        assert session.spin_until(connected, PATIENCE_S), sender.unmatched()
        yield outbox, both, look
        intake.close()


def test_what_is_only_recorded_waits_for_the_rest(post):
    outbox, both, look = post
    both(1)
    both(2)
    assert look(2) == {TENSION.name: [], COMMAND.name: [1, 2]}
    outbox.send_rest()
    assert look(4) == {TENSION.name: [1, 2], COMMAND.name: [1, 2]}


def test_nothing_is_sent_twice(post):
    outbox, both, look = post
    before = {name: len(stamps) for name, stamps in look(0).items()}
    both(3)
    outbox.send_rest()
    outbox.send_rest()
    both(4)
    outbox.send_rest()
    came = look(sum(before.values()) + 4)
    assert {name: stamps[before[name] :] for name, stamps in came.items()} == {
        TENSION.name: [3, 4],
        COMMAND.name: [3, 4],
    }
