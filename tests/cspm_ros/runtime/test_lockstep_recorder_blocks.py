"""The recorder fed with blocks: what it records and refuses is what it does message by message."""

import random

import pytest
from recorded_lockstep_runs import REST, STEPS, Case, Intake, spoilt
from ros_graph import content

from cspm_msgs_py.errors import CspmError
from cspm_msgs_py.wire import WireReader


@pytest.fixture(scope="module")
def case(tmp_path_factory):
    return Case(REST, tmp_path_factory.mktemp("blocks") / "expected")


def deliver_blocks(intake, sent, rng, share):
    """Deliver all in blocks of any length; a `share` of the messages follow a spoilt copy.

    Returns how many were spoilt.
    """
    schedule = [name for name in sent if not isinstance(name, tuple)]
    receive = {name: intake.recorder.receiver(name).receive for name in schedule}
    left, added = {name: list(payloads) for name, payloads in sent.items()}, 0
    while left:
        queue = rng.choice(list(left))
        count = rng.randrange(1, 20)
        payloads, left[queue] = left[queue][:count], left[queue][count:]
        if not left[queue]:
            del left[queue]
        if queue not in receive:
            for payload in payloads:
                intake.take(queue, payload)
            continue
        block = []
        for payload in payloads:
            if rng.random() < share:
                block.append(spoilt(queue, payload, rng))
                added += block[-1] != payload
            block.append(payload)
        receive[queue](block, [None] * len(block))
    return added


@pytest.mark.parametrize("share", [0.0, 0.05])
@pytest.mark.parametrize("seed", range(2))
def test_blocks_make_the_same_file(case, tmp_path, seed, share):
    intake = Intake(case.bundle, tmp_path / "bag")
    with intake.writer:
        added = deliver_blocks(intake, case.sent, random.Random(seed), share)
        intake.recorder.end(STEPS - 1)
        assert intake.recorder.done
    assert content(tmp_path / "bag") == content(case.expected)
    assert intake.recorder.refused[0] == added == len(intake.rate_limited_warnings)
    assert (added > 20) == (share > 0.0)
    assert intake.reported[-1] == STEPS - 1


def test_rows_that_are_due_make_the_same_file(case, tmp_path):
    intake, rng = Intake(case.bundle, tmp_path / "bag"), random.Random(3)
    topics = case.bundle.testbed.testbed.topics
    receivers = {name: intake.recorder.receiver(name) for name in topics if name in case.sent}
    left = {queue: list(payloads) for queue, payloads in case.sent.items()}
    with intake.writer:
        while queues := [queue for queue, payloads in left.items() if payloads]:
            queue, count = rng.choice(queues), rng.randrange(1, 20)
            block, left[queue] = left[queue][:count], left[queue][count:]
            if queue not in receivers:
                for payload in block:
                    intake.take(queue, payload)
                continue
            stamps, rows = WireReader(topics[queue]).decode_block(block)
            first, step, _ = receivers[queue].due
            assert stamps == list(range(first, first + len(block) * step, step))
            receivers[queue].receive_rows(rows)
        intake.recorder.end(STEPS - 1)
        assert intake.recorder.done
    assert content(tmp_path / "bag") == content(case.expected)
    assert intake.reported[-1] == STEPS - 1


def test_a_second_sender_in_a_block_is_an_error(case, tmp_path):
    intake = Intake(case.bundle, tmp_path / "bag")
    take = intake.recorder.receiver("/cables/tension").receive
    first, second, third, *_ = case.sent["/cables/tension"]
    with intake.writer:
        take([first, second], [1, 2])
        with pytest.raises(CspmError, match=r"^/cables/tension: two senders sent their message 2 "):
            take([second, third], [2, 3])
        intake.recorder.refused = (0, "")
        take([third], [3])
    assert intake.recorder.refused == (0, "")
