"""A run in real time with all nodes in one process: nothing is lost, and it stops as safely."""

import signal
import threading
from dataclasses import replace

import numpy as np
import pytest
from error_lines import said
from first_in_line import going_first
from realtime_graph import (
    OWN_RUN,
    TOGETHER,
    WATCHDOG,
    Command,
    Evidence,
    Graph,
    Witness,
    check_plant,
    slow_bundle,
    topics_of,
    under_way,
    warm_processes,
)
from ros_graph import load_ros, new_domain

load_ros()

from cspm_msgs_py.errors import InputError  # noqa: E402
from cspm_msgs_py.graph import RECORDER  # noqa: E402
from cspm_msgs_py.recording import Recording, overview  # noqa: E402
from cspm_msgs_py.recording.recover import recover  # noqa: E402
from cspm_msgs_py.schedule import (  # noqa: E402
    FORCE_CONTROLLER,
    PLANT,
    TENSION,
    TENSION_COMMAND,
    TORQUE_COMMAND,
)
from cspm_msgs_py.topics import EMERGENCY_STOP  # noqa: E402
from cspm_ros.runtime.exit_watchdog import IN_ORDER  # noqa: E402
from cspm_ros.runtime.realtime_run import run_realtime  # noqa: E402 - after ROS is known to be there

pytestmark = [pytest.mark.slow, pytest.mark.realtime]

MS = 1_000_000
PERIOD = 5 * MS


@pytest.fixture(scope="module")
def warm():
    return warm_processes()


class Machine(Graph):
    """The plant, as hardware that leads nobody."""

    def __init__(self, warm, bundle, place, domain):
        place.mkdir()
        super().__init__(warm, bundle, place, members=(PLANT,), domain=domain)
        self.start(remaps=OWN_RUN)


@pytest.mark.parametrize("plant", ["sim", "mujoco"])
def test_every_message_that_is_sent_is_recorded(tmp_path, plant):
    check_plant(plant)
    bundle = replace(slow_bundle(), plant=plant)
    reported = []
    with going_first():
        result = run_realtime(
            bundle, tmp_path / "bag", reported.append, steps=600, domain_id=new_domain()
        )
    assert (result.failure, result.interrupted, result.mode) == (None, False, "realtime")
    assert result.simulated == pytest.approx(3.005, abs=0.1)
    assert reported == sorted(reported)
    assert result.timing[RECORDER] == {"lost": 0, "refused": 0}
    assert result.timing[PLANT]["refused"] == result.timing[FORCE_CONTROLLER]["refused"] == 0
    found = overview(tmp_path / "bag")
    assert found.complete
    counts = {topic.name: topic.count for topic in found.topics}
    assert counts["/truth/bar/pose"] == counts[TENSION] == 600
    # The first command waits for the first tension command, which comes at half the rate; after
    # that what is late is not sent, and counted.
    sent = counts[TORQUE_COMMAND]
    assert 598 - result.timing[FORCE_CONTROLLER]["deadlines_missed"] <= sent <= 605
    # The plant heard no command that is not recorded.
    assert 600 - result.timing[PLANT]["deadlines_missed"] <= sent
    assert max(result.statistics.max_error[:3]) < 0.01


def test_drives_that_take_tensions_are_never_late_for_their_loop(tmp_path):
    bundle = slow_bundle("drive=tension", "rates.load_cells=200")
    with going_first():
        result = run_realtime(bundle, tmp_path / "bag", steps=600, domain_id=new_domain())
    assert result.failure is None
    evidence = Evidence(tmp_path / "bag")
    torques, tensions = evidence.rows[TORQUE_COMMAND], evidence.rows[TENSION]
    # One answers each tension from the first wanted one on, and none is somebody else's.
    first = int(np.searchsorted(tensions.stamp_ns, torques.stamp_ns[0]))
    assert torques.stamp_ns.tolist() == tensions.stamp_ns[first:].tolist()
    assert result.timing[FORCE_CONTROLLER]["deadlines_missed"] == 0
    assert result.timing[PLANT]["refused"] == 0
    assert len(evidence.rows[TENSION_COMMAND].stamp_ns) > 250


def test_at_1_khz_nothing_is_lost_however_late_the_nodes_are(tmp_path):
    bundle = slow_bundle(
        "rates={plant: 1000, winches: 1000, load_cells: 1000, motion_capture: 1000,"
        " wave_trajectory: 1000, motion_controller: 1000, tension_distribution: 1000,"
        " force_controller: 1000}",
    )
    stop = threading.Event()

    def burn():
        while not stop.is_set():
            pass

    burner = threading.Thread(target=burn)
    burner.start()
    try:
        result = run_realtime(bundle, tmp_path / "bag", steps=2000, domain_id=new_domain())
    finally:
        stop.set()
        burner.join()
    # The plant's own totals come every 100 steps, of which there may be fewer.
    tensions = Evidence(tmp_path / "bag").rows[TENSION]
    assert (tensions.log_ns - tensions.stamp_ns).max() > MS
    assert result.timing[RECORDER]["lost"] == 0


def test_an_emergency_stop_from_outside_is_obeyed_at_once(tmp_path):
    bundle = slow_bundle("duration=600.0")
    with (
        Command(tmp_path, bundle, TOGETHER) as command,
        Witness(command.domain, topics_of(bundle, TENSION)) as witness,
    ):
        under_way(witness)
        witness.emergency_stop(True)
        reported = witness.until_state(FORCE_CONTROLLER, "hold")
        assert reported.values["reason"] == "emergency stop set"
        assert not witness.reset(FORCE_CONTROLLER)[0]
        witness.emergency_stop(False)
        witness.until_reset(FORCE_CONTROLLER)
        witness.until_running(FORCE_CONTROLLER, WATCHDOG)
        command.process.send_signal(signal.SIGINT)
        code, _, err = command.done()
    assert code == 1
    assert said(err).startswith("force_controller: safe state hold since ")
    evidence = Evidence(command.folder)
    ((since, _),) = evidence.alarms(FORCE_CONTROLLER)
    with Recording(command.folder) as recording:
        pressed = int(recording.payloads(EMERGENCY_STOP.name).log_ns[0])
    gap = evidence.longest_gap(TORQUE_COMMAND, pressed, since + 10 * PERIOD)
    # What it reports is rounded to 1 ms.
    assert since - pressed <= 2 * PERIOD + gap + MS


def test_hardware_stops_by_itself_when_the_process_is_killed(warm, tmp_path):
    bundle = slow_bundle("duration=600.0")
    with (
        Command(tmp_path, bundle, TOGETHER, "--plant", "external") as command,
        Machine(warm, bundle, tmp_path / "lab", command.domain) as machine,
        Witness(command.domain, topics_of(bundle, TENSION)) as witness,
    ):
        under_way(witness)
        command.process.kill()
        assert command.done()[0] == -signal.SIGKILL
        reported = witness.until_state(WATCHDOG, "hold")
        assert reported.values["reason"].startswith(f"no {TORQUE_COMMAND} for ")
        assert set(machine.end().values()) <= IN_ORDER
    recover(command.folder)
    assert len(Evidence(command.folder).stamps(TENSION)) >= 60


def test_hardware_that_dies_is_missed(warm, tmp_path):
    bundle = slow_bundle("duration=600.0")
    with (
        Command(tmp_path, bundle, TOGETHER, "--plant", "external") as command,
        Machine(warm, bundle, tmp_path / "lab", command.domain) as machine,
        Witness(command.domain, topics_of(bundle, TENSION, TORQUE_COMMAND)) as witness,
    ):
        under_way(witness)
        machine.processes[PLANT].kill()
        witness.until_state(FORCE_CONTROLLER, "hold")
        witness.until_more(TORQUE_COMMAND, 50)
        command.process.send_signal(signal.SIGTERM)
        code, _, err = command.done()
    assert code == 1
    assert said(err).startswith("force_controller: safe state hold since ")


def test_an_existing_folder_is_left_alone(tmp_path):
    (tmp_path / "bag").mkdir()
    with pytest.raises(InputError, match="already exists, allowed: a new folder"):
        run_realtime(slow_bundle(), tmp_path / "bag", steps=10, domain_id=new_domain())
