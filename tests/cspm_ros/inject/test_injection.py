"""Faults put into runs: from a timetable in every mode, and from outside in real time."""

import os
import subprocess
import time
from functools import partial

import numpy as np
import pytest
from cspm_process import CSPM
from realtime_graph import LATE, Evidence, Graph, Witness, slow_bundle, warm_processes
from ros_graph import assert_same, load_ros, new_domain
from run_samples import bundle_of

from bench.performance.slow_machine import slow_overrides

load_ros()

from cspm_msgs_py.diagnostics import decode_diagnostics  # noqa: E402
from cspm_msgs_py.errors import InputError  # noqa: E402
from cspm_msgs_py.recording import Recording  # noqa: E402
from cspm_msgs_py.scenario_keys.faults import Fault  # noqa: E402
from cspm_msgs_py.schedule import FORCE_CONTROLLER, PLANT, TENSION  # noqa: E402
from cspm_ros.inject.injection import inject, kill_node  # noqa: E402
from cspm_ros.runtime.exit_watchdog import IN_ORDER  # noqa: E402
from cspm_ros.runtime.graph_run import run_graph  # noqa: E402
from cspm_run.recorded_run import run  # noqa: E402
from cspm_run.resim import resimulate  # noqa: E402

WATCHDOG = "plant/watchdog"
GUARDS = (FORCE_CONTROLLER, WATCHDOG)
SAG = 0.1
"""How far the bar may move [m]. A winch at half torque lets it sink 3 cm until the safe state
holds it; one that falls freely sinks 1.2 m in the time after which silence counts."""
ATTEMPTS = 5
STEPS = 300
TIMETABLE = (
    'faults=[{"at": 0.05, "fault": "sensor_biased", "on": "/bar/pose", "amount": 0.001,'
    ' "lasts": 0.05}, {"at": 0.12, "fault": "winch_weak", "on": "sway_1", "amount": 0.5},'
    ' {"at": 0.2, "fault": "brake", "lasts": 0.02}]'
)


def plant_statuses(folder):
    with Recording(folder) as recording:
        payloads = recording.payloads("/diagnostics").payloads
    found = [status for payload in payloads for status in decode_diagnostics(payload).statuses]
    return [status for status in found if status.name == PLANT]


def test_a_timetable_is_the_same_in_every_mode_and_is_repeated(tmp_path):
    bundle = bundle_of("calm", TIMETABLE)
    run(bundle, tmp_path / "one", steps=STEPS)
    run_graph(bundle, tmp_path / "graph", steps=STEPS, domain_id=new_domain())
    assert_same(tmp_path / "one", tmp_path / "graph")
    assert resimulate(tmp_path / "one", lambda *_: None).difference is None
    events = "; ".join(s.values.get("fault_events", "") for s in plant_statuses(tmp_path / "one"))
    assert "began at 0.050 s: sensor_biased on /bar/pose, 0.001, for 0.05 s" in events
    assert "ended at 0.100 s: sensor_biased on /bar/pose, 0.001, for 0.05 s" in events
    assert "began at 0.200 s: brake, for 0.02 s" in events


def test_what_fails_is_what_the_recording_shows(tmp_path):
    for name, faults in {"healthy": (), "faulty": (TIMETABLE,)}.items():
        run(bundle_of("calm", "sensors=ideal", *faults), tmp_path / name, steps=STEPS)
    rows = {}
    for name in ("healthy", "faulty"):
        with Recording(tmp_path / name) as recording:
            rows[name] = {
                topic: recording.rows(topic).rows
                for topic in ("/bar/pose", "/truth/bar/pose", "/winches/state")
            }
    healthy, faulty = rows["healthy"], rows["faulty"]
    assert (healthy["/bar/pose"][:50] == faulty["/bar/pose"][:50]).all()
    bias = faulty["/bar/pose"] - faulty["/truth/bar/pose"]
    assert bias[50:100, :3] == pytest.approx(0.001 + np.zeros((50, 3)), abs=1e-12)
    assert bias[100:200] == pytest.approx(np.zeros((100, 7)), abs=1e-12)
    speeds = faulty["/winches/state"][:, 8:16]
    assert not speeds[202:220].any()
    assert speeds[195].all()


def test_a_fault_that_lockstep_cannot_have_is_refused(tmp_path):
    late = 'faults=[{"fault": "sensor_dropped", "on": "/bar/pose"}]'
    with pytest.raises(InputError, match=r"^faults\[0\]: sensor_dropped, allowed in lockstep"):
        run(bundle_of("calm", late), tmp_path / "never", steps=STEPS)


def fault(kind, **options):
    return Fault(fault=kind, **options)


def reported(each, status):
    """Return whether the plant reports a fault, whatever else its message warns of."""
    return any(str(each) in status.values.get(name, "") for name in ("faults", "fault_events"))


def answered(each, witness, domain, reason):
    """Put a fault into the run; return whether it is why the machine is held after it."""
    inject(each, domain_id=domain)
    over_ns = time.time_ns() + int(each.lasts * 1e9)
    witness.until_said_after(PLANT, over_ns, lambda s: not s.values.get("faults"), f"end of {each}")
    held = witness.until_said_after(
        FORCE_CONTROLLER, over_ns, lambda s: s.values.get("state") == "hold", f"hold after {each}"
    )
    # Both the jump and the jump back are reported.
    witness.until_running(*GUARDS, passing=(*LATE, reason))
    return reason in held.values["reason"]


@pytest.mark.slow
@pytest.mark.realtime
def test_each_fault_is_ridden_out_or_answered_with_the_safe_state(tmp_path):
    """In one run, one after the other; recorded are all of them, and the bar never falls."""
    bundle = slow_bundle()
    tension = bundle.testbed.testbed.topics[TENSION]
    ridden_out = [
        fault("sensor_frozen", on="/bar/pose", lasts=0.3),
        fault("sensor_noisy", on="/bar/pose", amount=1e-4, lasts=0.3),
        fault("brake", lasts=0.3),
    ]
    answers = {
        "/tension_command stale": fault("sensor_dropped", on="/bar/pose", lasts=1.5),
        "/winches/state stale": fault("sensor_dropped", on="/winches/state", lasts=1.5),
        "/cables/tension stale": fault("sensor_late", on="/cables/tension", amount=1.0, lasts=1.5),
        "torque without motion": fault("winch_weak", on="surge_2", amount=0.5, lasts=1.0),
        " jumped by ": fault("sensor_biased", on="/bar/pose", amount=0.5, lasts=0.3),
    }
    with (
        Graph(warm_processes(), bundle, tmp_path) as graph,
        Witness(graph.domain, [tension]) as witness,
    ):
        graph.start()
        witness.until_running(*GUARDS)
        for each in ridden_out:
            inject(each, domain_id=graph.domain)
            witness.until_said(PLANT, partial(reported, each), str(each))
            witness.until_more(TENSION, 120)
            witness.until_running(*GUARDS)
        for reason, each in answers.items():
            # A busy computer may be in its safe state already, for being late.
            assert any(answered(each, witness, graph.domain, reason) for _ in range(ATTEMPTS)), each
        with pytest.raises(InputError, match=r"^on surge_9, allowed: hoist_1, "):
            inject(fault("winch_weak", on="surge_9", amount=0.5), domain_id=graph.domain)
        assert kill_node(FORCE_CONTROLLER, domain_id=graph.domain) in {
            process.pid for process in graph.processes.values()
        }
        assert witness.until_state(WATCHDOG, "hold").values["reason"]
        assert set(graph.end().values()) <= {*IN_ORDER, -9}
    evidence = Evidence(graph.folder)
    assert np.ptp(evidence.rows["/truth/bar/pose"].rows[:, 2]) < SAG
    limits = np.array([cable.tension_limits[1] for cable in bundle.testbed.testbed.cables])
    assert (evidence.rows["/truth/cables/tension"].rows <= limits).all()
    events = "; ".join(s.values.get("fault_events", "") for s in evidence.statuses)
    for each in (*ridden_out, *answers.values()):
        assert f"{each}" in events
    with Recording(graph.folder) as recording:
        for name in ("/rosout", "/parameter_events"):
            assert recording.topics[name].count > 0
    reasons = "; ".join(reason for _, reason in evidence.alarms(FORCE_CONTROLLER))
    for reason in answers:
        assert reason in reasons


def test_the_command_says_what_is_allowed(tmp_path):
    environment = os.environ | {"ROS_DOMAIN_ID": str(new_domain())}

    def said(*arguments):
        command = [CSPM, "inject", *arguments]
        found = subprocess.run(
            command, env=environment, cwd=tmp_path, capture_output=True, text=True, check=False
        )
        assert found.returncode == 2
        (line,) = found.stderr.splitlines()
        return line

    kinds = "sensor_frozen, sensor_noisy, sensor_biased, sensor_late, sensor_dropped, winch_weak,"
    assert said("gremlins") == (
        f"cspm inject: gremlins: allowed: {kinds} cable_cut, brake, node_killed"
    )
    assert said("node_killed", "--for", "1") == (
        "cspm inject: node_killed: with --amount or --for, allowed: --on NODE alone"
    )
    domain = environment["ROS_DOMAIN_ID"]
    assert said("brake") == (
        f"cspm inject: no node plant in ROS domain {domain}, allowed: while a run is under way"
    )


@pytest.mark.slow
@pytest.mark.realtime
def test_a_pose_aside_by_more_than_thrice_the_tracking_error_trips(tmp_path):
    fault = '{"at": 2.0, "fault": "sensor_biased", "on": "/bar/pose", "amount": 0.05}'
    waits = [f"safety.{key}=0.5" for key in ("stale_after", "watchdog", "lateness")]
    bundle = bundle_of("rest", *slow_overrides(), *waits, f"faults=[{fault}]")
    with (
        Graph(warm_processes(), bundle, tmp_path) as graph,
        Witness(graph.domain) as witness,
    ):
        graph.start()
        reason = witness.until_state(FORCE_CONTROLLER, "hold").values["reason"]
        assert set(graph.end().values()) <= IN_ORDER
    assert reason.startswith("motion_controller: /bar/pose: 0.0")
    assert " m from /bar/reference, allowed: at most 0.012 m (safety.following_error)" in reason
