"""Controllers from files that a scenario names: in a run, in its recording, and repeated."""

import hashlib

import numpy as np
import pytest
from own_controllers import BOTH, LIFT, TENSION_PI, written
from rewritten_recordings import rewrite
from run_samples import bundle_of, run_to

import cspm
from cspm_msgs_py.errors import InputError
from cspm_msgs_py.recording import Recording
from cspm_run.bundle import read_bundle
from cspm_run.recorded_bundle import recorded_bundle
from cspm_run.recorded_run import run
from cspm_run.resim import resimulate

STEPS = 300


@pytest.fixture(scope="module")
def place(tmp_path_factory):
    folder = tmp_path_factory.mktemp("own")
    run(bundle_of(written(folder, BOTH)), folder / "bag", steps=STEPS)
    return folder


def again(path, *controllers):
    return resimulate(path, lambda now, total: None, controllers)


def test_the_named_class_computes(place, tmp_path):
    """The torque is what the file's formula gives from the recorded tensions."""
    _, rows = run_to(tmp_path / "bag", place / "mine.yaml", steps=STEPS)
    wanted = rows["/tension_command"].rows
    measured, torque = rows["/cables/tension"].rows, rows["/winches/torque_command"].rows
    held = np.repeat(wanted, len(measured) // len(wanted), axis=0)
    error = held - measured
    cables = bundle_of("rest").testbed.testbed.cables
    radius = np.array([c.drum_radius / c.gear_ratio for c in cables])
    expected = radius * (held + 0.5 * error + 2e-3 * np.cumsum(error, axis=0))
    limits = np.array([c.torque_limit for c in cables])
    assert torque == pytest.approx(np.clip(expected, -limits, limits), abs=1e-12)


def test_it_is_what_the_same_object_does_from_python(place):

    spaces = [{}, {}]
    exec(TENSION_PI, spaces[0])
    exec(LIFT, spaces[1])
    objects = {
        "force_controller": spaces[0]["TensionPi"](0.5),
        "motion_controller": spaces[1]["Lift"](),
    }
    named = cspm.simulate(place / "mine.yaml", duration=0.3)
    given = cspm.simulate("rest", duration=0.3, controllers=objects)
    assert np.array_equal(named.torque_command, given.torque_command)
    assert np.array_equal(named.bar_pose, given.bar_pose)


def test_the_recording_carries_file_and_sha256(place):
    with Recording(place / "bag") as recording:
        attachments, about = recording.attachments, recording.metadata["cspm"]
    assert attachments["tension_pi.py"] == TENSION_PI.encode()
    assert about["own_controllers"] == "force_controller: TensionPi, motion_controller: Lift"
    named = read_bundle(attachments, "bag").scenario.controllers["force_controller"]
    assert named.sha256 == hashlib.sha256(TENSION_PI.encode()).hexdigest()
    assert named.parameters == {"gain": 0.5}


def test_a_run_repeats_with_the_users_own_files(place):
    found = again(place / "bag", place / "lift.py", place / "tension_pi.py")
    assert found.difference is None


def test_no_code_of_a_recording_runs_unasked(place, tmp_path):
    """Neither what it carries nor what lies where it points to, in whatever way it is opened."""
    trap, ran = tmp_path / "trap.py", tmp_path / "ran"
    trap.write_text(f"open({str(ran)!r}, 'w')\nclass Trap:\n    def step(self, t, i): ...\n")
    bundle = bundle_of(written(tmp_path, f"{{force_controller: '{trap}:Trap'}}"))
    carried = bundle.attachments()
    text = carried["scenario.yaml"].decode()
    pointing = text.replace("python: trap.py", f"python: {trap}")
    assert pointing != text
    unpinned = "\n".join(line for line in pointing.splitlines() if "sha256" not in line)
    for i, scenario in enumerate((text, pointing, unpinned)):
        changed = carried | {"scenario.yaml": scenario.encode()}
        bag = rewrite(place / "bag", tmp_path / f"bag{i}", attachments=changed)
        with pytest.raises(InputError, match=r"not run unasked, allowed: `cspm resim .*bag"):
            again(bag)
        for overrides in ((), ("seed=2",)):
            found = recorded_bundle(bag, overrides)
            with pytest.raises(InputError, match="not run unasked"), found.unpacked():
                pass
    assert not ran.exists()


def test_a_part_of_the_files_is_not_enough(place):
    with pytest.raises(InputError, match=r"motion_controller: Lift, SHA-256 [0-9a-f]{64}\), which"):
        again(place / "bag", place / "tension_pi.py")


def test_another_file_is_refused(place, tmp_path):
    other = tmp_path / "tension_pi.py"
    other.write_text(TENSION_PI + "\n")
    with pytest.raises(InputError, match=r"--controller .*tension_pi.py: SHA-256 .*, allowed: "):
        again(place / "bag", other, place / "lift.py")


def test_a_file_for_a_run_without_one_is_refused(place, tmp_path):
    run(bundle_of("rest"), tmp_path / "bag", steps=20)
    with pytest.raises(InputError, match="allowed: none: no controller of one's own"):
        again(tmp_path / "bag", place / "lift.py")


@pytest.mark.parametrize(
    ("controllers", "line"),
    [
        (
            "{force_controller: 'none.py:Pi'}",
            r"none\.py: not readable \(No such file .*\), all",
        ),
        (
            "{force_controller: 'lift.py:Pi'}",
            r"controllers\.force_controller: .*lift\.py has no class Pi, allowed: a class with",
        ),
        (
            "{force_controller: 'tension_pi.py:TensionPi'}",
            r"parameters: missing a required argument: 'gain', allowed by TensionPi: gain, more",
        ),
        (
            "{force_controller: {python: 'tension_pi.py:TensionPi', parameters: {gian: 1}}}",
            r"parameters: .*, allowed by TensionPi: gain, more",
        ),
        (
            "{force_controller: {python: 'tension_pi.py:TensionPi', sha256: abc}}",
            r"tension_pi\.py has SHA-256 [0-9a-f]{12}…, allowed: abc, or no sha256",
        ),
        ("{force_controller: tension_pi}", r"python: tension_pi, allowed: FILE\.py:CLASS"),
        ("{autopilot: 'lift.py:Lift'}", r"autopilot.*allowed"),
        ("{target_tracker: 'lift.py:Lift'}", r"controllers: target_tracker, allowed: wave_traj"),
        ("{force_controller: 'short.py:Short'}", r"has step\(self\), allowed: a class with step"),
        ("{force_controller: 'short.py:Empty'}", r"Empty of .* has no step, allowed: a class with"),
        ("{force_controller: 'broken.py:A'}", r"broken\.py line 2: .*syntax|line 2: "),
        (
            "{force_controller: 'needy.py:A'}",
            r"needy\.py line 1: ModuleNotFoundError: .*allowed: one file that imports what is inst",
        ),
        (
            "{force_controller: 'short.py:Late'}",
            r"short\.py line 8: ValueError: too late, in Late\(\)",
        ),
    ],
)
def test_what_cannot_be_used_is_refused_in_one_line(tmp_path, controllers, line):
    (tmp_path / "short.py").write_text(
        "class Short:\n    def step(self):\n        ...\nclass Empty:\n    pass\n"
        "class Late:\n    def __init__(self):\n        raise ValueError('too late')\n"
        "    def step(self, time, inputs):\n        ...\n"
    )
    (tmp_path / "broken.py").write_text("class A:\n  def\n")
    (tmp_path / "needy.py").write_text("import no_such_module_at_all\n")
    with pytest.raises(InputError, match=line) as caught:
        cspm.simulate(written(tmp_path, controllers), duration=0.1)
    assert "\n" not in str(caught.value)


def test_a_motion_controller_that_fails_ends_the_run_in_one_line(tmp_path):
    named = "{motion_controller: {python: 'lift.py:Lift', parameters: {fails_at: 0.2}}}"
    result = run(bundle_of(written(tmp_path, named)), tmp_path / "bag", steps=STEPS)
    assert result.failure == (
        "motion_controller: lift.py line 17: ZeroDivisionError: nothing to divide by"
    )
    assert result.simulated == pytest.approx(0.2)
    assert again(tmp_path / "bag", tmp_path / "lift.py").difference is None


def test_a_force_controller_that_fails_leaves_the_bar_where_it_is(tmp_path):
    named = "{force_controller: {python: 'half.py:Half'}}"
    path = written(tmp_path, named)
    (tmp_path / "half.py").write_text(
        TENSION_PI.replace("TensionPi", "Half")
        .replace("gain, more", "gain=0.5, more")
        .replace("wanted, measured =", "assert time < 0.2\n        wanted, measured =")
    )
    result, rows = run_to(tmp_path / "bag", path, steps=1000)
    assert result.failure == (
        "force_controller: safe state hold since 0.200 s: force_controller: half.py line 16:"
        " AssertionError"
    )
    assert again(tmp_path / "bag", tmp_path / "half.py").difference is None
    assert result.simulated == pytest.approx(1.0)
    heave = rows["/truth/bar/pose"].rows[:, 2]
    assert np.abs(heave - heave[0]).max() < 0.01


def test_a_force_controller_stays_within_the_motors_limits(tmp_path):
    path = written(tmp_path, "{force_controller: 'strong.py:Strong'}")
    (tmp_path / "strong.py").write_text(
        "class Strong:\n    def step(self, time, inputs):\n"
        "        return 1e6 * (inputs['/tension_command'] > 0)\n"
    )
    _, rows = run_to(tmp_path / "bag", path, steps=3)
    limits = [c.torque_limit for c in bundle_of("rest").testbed.testbed.cables]
    assert rows["/winches/torque_command"].rows[0].tolist() == limits


def test_errors_are_those_against_the_reference_that_was_sent(tmp_path):
    """Of a reference 0.1 m above, the bar at rest is 0.1 m below at the first instant."""
    path = written(tmp_path, "{wave_trajectory: 'higher.py:Higher'}")
    (tmp_path / "higher.py").write_text(
        "class Higher:\n    def step(self, time, inputs):\n"
        "        return {'/bar/reference': [0, 0, HEIGHT, 0, 0, 0, 1] + 12 * [0]}\n"
        f"HEIGHT = {bundle_of('rest').scenario.bar_mean_pose[2] - 0.1}\n"
    )
    run_ = cspm.simulate(path, duration=0.02)
    assert run_.errors["heave"]["max"] == pytest.approx(0.1, abs=2e-3)


def test_a_row_of_another_length_is_reported(tmp_path):
    path = written(tmp_path, "{motion_controller: 'short.py:Short'}")
    (tmp_path / "short.py").write_text(
        "class Short:\n    def step(self, time, inputs):\n        return [0.0, 1.0]\n"
    )
    assert run(bundle_of(path), None, steps=20).failure == (
        "motion_controller: Short returned /wrench_command of shape (2,), allowed: (6,), in"
        " short.py"
    )
