"""A controller leaves a lockstep run when it has reported all of it, not before."""

import numpy as np
from ros_graph import load_ros, new_domain
from run_samples import bundle_of

from cspm_msgs_py.schedule import MOTION_CONTROLLER

load_ros()

from cspm_msgs_py.ros.rendezvous import PlantSide  # noqa: E402 - after ROS is known to be there
from cspm_msgs_py.ros.session import Session  # noqa: E402
from cspm_ros.runtime.lockstep_nodes import LockstepRun  # noqa: E402

PATIENCE_S = 20.0
LAST = 4
POSE, REFERENCE = "/bar/pose", "/bar/reference"


def test_a_slow_controller_waits_for_the_last_references_after_the_end_was_announced():
    """It computes every tenth step, so that after step 0 nothing is left to compute."""
    run = LockstepRun(bundle_of("rest"), ("plant", MOTION_CONTROLLER))
    period_ns = run.schedule.period_ns
    reported = []
    with Session(domain_id=new_domain()) as session:
        plant = session.node("plant")
        send = {name: plant.publisher(run.testbed_topics[name]) for name in (POSE, REFERENCE)}
        side = PlantSide(
            plant, period_ns, [MOTION_CONTROLLER], lambda _, step: reported.append(step)
        )
        stage = run.stage(session.node(MOTION_CONTROLLER))
        at_rest = {name: np.zeros(run.testbed_topics[name].width) for name in send}
        for row in at_rest.values():
            row[6] = 1.0

        def publish(name, steps):
            for step in steps:
                send[name](0, step * period_ns, at_rest[name])

        # What this test does not wait for it must not lose.
        assert session.spin_until(
            lambda: not plant.unmatched() and not side.unmatched(), PATIENCE_S
        ), side.unmatched()
        publish(POSE, [0])
        publish(REFERENCE, range(LAST))
        assert session.spin_until(lambda: stage.progress >= LAST, PATIENCE_S), stage.waiting()
        side.tell_end(LAST)
        assert session.spin_until(lambda: stage.end_known, PATIENCE_S)
        assert not stage.ended
        publish(REFERENCE, [LAST])
        assert session.spin_until(lambda: stage.ended, PATIENCE_S)
        assert session.spin_until(lambda: reported[-1:] == [LAST], PATIENCE_S), reported
