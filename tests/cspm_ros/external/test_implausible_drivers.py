"""Drivers that send what cannot be true, over real topics: the safe state says why."""

from pathlib import Path

import pytest
from realtime_graph import LATE, Evidence, Graph, Witness, warm_processes
from ros_graph import load_ros
from scripted_lab import ScriptedLab, clamped_bundle

from cspm_msgs_py.graph import RECORDER
from cspm_msgs_py.schedule import FORCE_CONTROLLER, MOTION_CONTROLLER, TENSION, schedule_of
from cspm_ros.runtime.progress_file import read_report

load_ros()
pytestmark = [pytest.mark.slow, pytest.mark.realtime]
SWAY_2, ATTEMPTS = 5, 5
PASSING = (*LATE, " jumped by ")


@pytest.fixture(scope="module")
def warm():
    return warm_processes()


class Run:
    """A run without plant on a scripted lab."""

    def __init__(self, warm, place):
        self.bundle = clamped_bundle()
        self.testbed = self.bundle.testbed.testbed
        nodes = schedule_of(self.bundle.scenario, self.testbed).nodes
        self.graph = Graph(warm, self.bundle, place, members=(*nodes, RECORDER))

    def __enter__(self):
        self.graph.__enter__()
        self.witness = Witness(self.graph.domain, [self.testbed.topics[TENSION]]).__enter__()
        self.lab = ScriptedLab(self.witness.session, self.testbed)
        self.lab.at_fault = SWAY_2
        return self

    def __exit__(self, *error):
        self.witness.__exit__(*error)
        self.graph.__exit__(*error)

    def tripped(self):
        """Wait for the safe state; return its reason without the node that reported it."""
        status = self.witness.until_state(FORCE_CONTROLLER, "hold")
        return status.values["reason"]

    def provoked(self, act, undo):
        """Do something and return the reason of the safe state that it leads to.

        A busy computer may lead there just before; then once more.
        """
        for _ in range(ATTEMPTS):
            act()
            reason = self.tripped()
            if not any(each in reason for each in LATE):
                break
            undo()
            self.go_on()
        return reason

    def refused_for(self, reason):
        """Return whether a reset is refused for this reason alone.

        A busy computer may keep another input from being fresh for a moment.
        """
        for _ in range(ATTEMPTS):
            done, said = self.witness.reset(FORCE_CONTROLLER)
            assert not done
            if said == f"reset refused: {reason}":
                return True
            self.witness.until_more(TENSION, 20)
        return False

    def go_on(self):
        """Reset once the lab is itself again."""
        self.witness.until(lambda: self.lab.arrived, "the bar in its place")
        self.witness.until_reset(FORCE_CONTROLLER)
        # The jump back may be reported after it.
        self.witness.until_running(FORCE_CONTROLLER, passing=PASSING)
        # Longer than a window of torques after their brakes may have opened.
        self.witness.until_more(TENSION, 200)
        self.witness.until_running(FORCE_CONTROLLER, passing=PASSING)


def waiting(graph):
    report = read_report(Path(graph.parameters.report))
    return report.waiting if report else None


def test_each_kind_of_nonsense_leads_to_the_safe_state_with_its_reason(warm, tmp_path):
    reasons = []
    with Run(warm, tmp_path) as run:
        lab, witness = run.lab, run.witness
        run.graph.start()
        witness.until_running(FORCE_CONTROLLER)
        witness.until_more(TENSION, 200)
        witness.until_running(FORCE_CONTROLLER)

        def home():
            lab.jump(0.0, 0.0, 2.0)

        reasons.append(run.provoked(lambda: lab.jump(0.2, 0.0, 2.0), home))
        assert "/bar/pose: jumped by 0.2 m in " in reasons[-1]
        home()
        run.go_on()

        reasons.append(run.provoked(lambda: lab.go(0.6), lambda: lab.go(0.0)))
        assert "motion_controller: /bar/pose: 0.5" in reasons[-1]
        assert "m from /bar/reference, allowed: at most 0.5 m" in reasons[-1]
        lab.go(0.0)
        run.go_on()

        reasons.append(run.provoked(lambda: lab.jump(0.0, 0.0, 2000.0), home))
        assert "/bar/pose: 2e+03 m from its mean position, allowed: at most 1 m" in reasons[-1]
        # Longer than inputs may be old: without a pose nobody wants a tension.
        witness.until_more(TENSION, 200)
        assert run.refused_for("no fresh /tension_command")
        home()
        run.go_on()

        reasons.append(run.provoked(lambda: lab.report(-lab.torques[SWAY_2]), lab.report))
        assert reasons[-1].startswith("/winches/state: tension without torque of sway_2: ")
        lab.report()
        run.go_on()

        def stick(number=None):
            lab.stuck = number

        reasons.append(run.provoked(lambda: stick(SWAY_2), stick))
        assert reasons[-1].startswith("/cables/tension: the same effort of sway_2 for 5")
        stick()
        run.go_on()

        def turn(speed=0.0, standing=None):
            lab.turning, lab.standing = speed, standing

        turn(1.0)
        witness.until_more(TENSION, 300)
        witness.until_running(FORCE_CONTROLLER)
        reasons.append(run.provoked(lambda: turn(1.0, SWAY_2), turn))
        assert reasons[-1].startswith("/winches/state: the same angle of sway_2 for 5")
        turn()
        run.go_on()

        reasons.append(run.provoked(lambda: lab.report(0.6), lab.report))
        assert reasons[-1].startswith("/winches/state: torque without motion of sway_2: ")
        lab.report()
        run.go_on()
        run.graph.send(RECORDER, 2)
        assert set(run.graph.join().values()) == {0}
    recorded = [reason for _, reason in Evidence(tmp_path / "recording").alarms(FORCE_CONTROLLER)]
    # In this order, and besides them nothing but what passes by itself.
    later = iter(recorded)
    assert all(reason in later for reason in reasons)
    others = [reason for reason in recorded if reason not in reasons]
    assert all(any(each in reason for each in PASSING) for reason in others)


def test_a_run_does_not_begin_outside_the_workspace(warm, tmp_path):
    named = f"waits for drivers to reach {MOTION_CONTROLLER}, tension_distribution"
    with Run(warm, tmp_path) as run:
        # Statics cannot tell: the cables reach so far.
        run.lab.jump(0.0, 0.0, 3.2)
        run.graph.start()
        run.witness.until(lambda: waiting(run.graph) == named, named)
        run.witness.until_more(TENSION, 200)
        assert waiting(run.graph) == named
        log = run.graph.log(MOTION_CONTROLLER)
        run.witness.until(lambda: "(safety.workspace)" in log.read_text(), "the reason in the log")
        run.lab.jump(0.0, 0.0, 2.0)
        run.witness.until_running(FORCE_CONTROLLER)
        run.graph.send(RECORDER, 2)
        assert set(run.graph.join().values()) == {0}
