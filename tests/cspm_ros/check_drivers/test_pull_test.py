"""The pull test finds swapped and inverted signals, on the motion of a simulated machine.

Where a winch gives way, the bar's motion and its motor's angle are the simulator's, with the
winch's torque lowered as far as the hand takes over. What the hand adds to the load cell is added.
"""

import numpy as np
import pytest
from driver_samples import BAR, FRAME, TENSION, WINCHES, Lab, lab_of
from run_samples import SCENARIOS, THESIS_CABLES

from cspm_model.equilibrium import find_equilibrium
from cspm_msgs_py.errors import InputError
from cspm_ros.check_drivers.pull_response import analyse_pull, instruction, swapped
from cspm_sim.parameters import plant_parameters

CABLES = ("hoist_1", "surge_2", "sway_1")
HAND = 12.0  # N
REST = 0.06  # s
ANGLES, TORQUES = slice(0, 8), slice(16, 24)
LIMITS = np.array([[5.0, 60.0], [5.0, 60.0], *[[5.0, 35.0]] * 2, *[[5.0, 15.0]] * 4])


def radii(testbed):
    return np.array([cable.drum_radius / cable.gear_ratio for cable in testbed.cables])


def scenario(folder, testbed, cable):
    """A scenario in which constant torques hold the bar, but for one that falls by 40 %."""
    found = find_equilibrium(plant_parameters(testbed), [0, 0, 2, 0, 0, 0], np.zeros(6), LIMITS)
    lines = [
        "name: pull",
        f"testbed: {SCENARIOS / 'testbeds' / 'thesis.yaml'}",
        "duration: 0.6",
        "target: {mean_pose: [0, 0, 2, 0, 0, 0]}",
        "rates: {motion_capture: 1000}",
        "control:",
        "  mode: torque",
        "  torque:",
    ]
    torques = (found.tensions * radii(testbed)).tolist()
    for name, torque in zip(THESIS_CABLES, torques, strict=True):
        fall = f"sines: [{{amplitude: {-0.4 * torque!r}, frequency: 0.5}}]"
        lines.append(f"    {name}: {{offset: {torque!r}, {fall if name == cable else ''}}}")
    path = folder / f"{cable}.yaml"
    path.write_text("\n".join(lines), encoding="utf-8")
    return path


@pytest.fixture(scope="module")
def simulated(tmp_path_factory, thesis):
    folder = tmp_path_factory.mktemp("pulls")
    return {cable: lab_of(folder / cable, scenario(folder, thesis, cable)) for cable in CABLES}


def windows(lab: Lab, cable, *, gives_way=True):
    """Rows before and during a pull at `cable`, the other drives holding."""
    i, n = THESIS_CABLES.index(cable), len(THESIS_CABLES)
    before = {name: feed.rows for name, feed in lab.window(0.0, REST).feeds.items()}
    feeds = lab.window(REST, 0.6).feeds
    during = {name: feed.rows.copy() for name, feed in feeds.items()}
    count = len(during[WINCHES])
    pull = HAND * np.sin(np.pi * np.arange(count) / count)
    resting = before[WINCHES][np.arange(count) % len(before[WINCHES])]
    free = np.arange(3 * n) == i if gives_way else np.zeros(3 * n, dtype=bool)
    during[WINCHES] = np.where(free, during[WINCHES], resting)
    during[TENSION][:, i] = before[TENSION][:, i].mean() + pull
    if not gives_way:
        during[BAR] = before[BAR][np.arange(count) % len(before[BAR])]
        during[WINCHES][:, 2 * n + i] += pull * radii(lab.testbed)[i]
    return before, during


def changed(both, name, change):
    return tuple({**window, name: change(window[name].copy())} for window in both)


def inverted(columns):
    def change(rows):
        rows[:, columns] *= -1.0
        return rows

    return change


def exchanged(one, other):
    def change(rows):
        a, b = THESIS_CABLES.index(one), THESIS_CABLES.index(other)
        for start in range(0, rows.shape[1], 8):
            rows[:, [start + a, start + b]] = rows[:, [start + b, start + a]]
        return rows

    return change


def findings(verdict):
    return {finding.check: (finding.ok, finding.text) for finding in verdict.findings}


@pytest.mark.parametrize("cable", CABLES)
class TestSoundMachine:
    def test_a_winch_that_gives_way_shows_every_sign(self, simulated, cable):
        lab = simulated[cable]
        verdict = analyse_pull(lab.testbed, cable, *windows(lab, cable))
        found = findings(verdict)
        assert verdict.ok is True
        assert verdict.answered == {"tension": cable, "angle": cable}
        assert {check: ok for check, (ok, _) in found.items()} == {
            "pull_tension": True,
            "pull_angle": True,
            "pull_torque": None,
            "pull_pose": True,
        }
        assert found["pull_tension"][1] == f"pulled {cable}: its tension rose by 12 N"
        assert f"m away from the exit of {cable}" in found["pull_pose"][1]

    def test_a_winch_that_holds_shows_tension_and_torque(self, simulated, cable):
        lab = simulated[cable]
        verdict = analyse_pull(lab.testbed, cable, *windows(lab, cable, gives_way=False))
        assert verdict.ok is True
        assert verdict.answered == {"tension": cable, "torque": cable}
        found = findings(verdict)
        assert found["pull_angle"] == (
            None,
            "cannot decide: no motor turned clearly, the drives hold",
        )
        assert found["pull_pose"] == (None, "cannot decide: the bar did not move clearly")

    def test_an_inverted_load_cell_is_reported(self, simulated, cable):
        lab, i = simulated[cable], THESIS_CABLES.index(cable)
        both = changed(windows(lab, cable), TENSION, inverted(i))
        verdict = analyse_pull(lab.testbed, cable, *both)
        assert verdict.ok is False
        assert findings(verdict)["pull_tension"] == (
            False,
            f"pulled {cable}: its tension fell by 12 N: is its sign inverted?",
        )

    def test_an_inverted_angle_is_reported(self, simulated, cable):
        lab, i = simulated[cable], THESIS_CABLES.index(cable)
        both = changed(windows(lab, cable), WINCHES, inverted(i))
        ok, text = findings(analyse_pull(lab.testbed, cable, *both))["pull_angle"]
        assert ok is False
        assert text.startswith(f"pulled {cable}: its angle wound in 0.0")
        assert text.endswith(" m: is its sign inverted?")

    def test_an_inverted_torque_is_reported(self, simulated, cable):
        lab, i = simulated[cable], 16 + THESIS_CABLES.index(cable)
        both = changed(windows(lab, cable, gives_way=False), WINCHES, inverted(i))
        assert findings(analyse_pull(lab.testbed, cable, *both))["pull_torque"] == (
            False,
            f"pulled {cable}: its torque fell by 12 N: is its sign inverted?",
        )


class TestSwappedCables:
    def test_a_swapped_load_cell_is_reported_with_its_cable(self, simulated):
        lab = simulated["surge_2"]
        both = changed(windows(lab, "surge_2"), TENSION, exchanged("surge_1", "surge_2"))
        verdict = analyse_pull(lab.testbed, "surge_2", *both)
        assert verdict.ok is False
        assert findings(verdict)["pull_tension"] == (
            False,
            "pulled surge_2, but the tension of surge_1 rose by 12 N: are two cables swapped?",
        )
        assert findings(verdict)["pull_angle"][0] is True

    def test_a_swapped_and_inverted_one_is_reported_as_both(self, simulated):
        lab = simulated["surge_2"]
        both = changed(windows(lab, "surge_2"), TENSION, exchanged("surge_1", "surge_2"))
        both = changed(both, TENSION, inverted(2))
        ok, text = findings(analyse_pull(lab.testbed, "surge_2", *both))["pull_tension"]
        assert ok is False
        assert text.endswith("fell by 12 N: are two cables swapped and one inverted?")

    def test_a_swapped_motor_is_reported(self, simulated):
        lab = simulated["sway_1"]
        both = changed(windows(lab, "sway_1"), WINCHES, exchanged("sway_1", "sway_3"))
        ok, text = findings(analyse_pull(lab.testbed, "sway_1", *both))["pull_angle"]
        assert ok is False
        assert text.startswith("pulled sway_1, but the angle of sway_3 let out 0.0")

    def test_two_pulls_say_which_two(self, simulated):
        verdicts = []
        for cable in ("hoist_1", "surge_2", "sway_1"):
            lab = simulated[cable]
            both = changed(windows(lab, cable), TENSION, exchanged("surge_2", "sway_1"))
            verdicts.append(analyse_pull(lab.testbed, cable, *both))
        assert [(f.topic, f.ok, f.text) for f in swapped(verdicts)] == [
            (TENSION, False, "tension of surge_2 and sway_1 are swapped")
        ]
        assert swapped(verdicts[:1]) == swapped(verdicts[:2]) == []


class TestPose:
    @pytest.mark.parametrize(("rise", "ok"), [(0.02, False), (-0.02, True)])
    def test_a_bar_that_comes_nearer_to_the_exit_is_reported(self, simulated, rise, ok):
        lab = simulated["sway_1"]
        before, during = windows(lab, "sway_1", gives_way=False)
        during[BAR] = during[BAR] - np.array([0.0, 0.0, rise, 0, 0, 0, 0])
        found = findings(analyse_pull(lab.testbed, "sway_1", before, during))["pull_pose"]
        assert found[0] is ok
        mirrored = "m towards the exit of sway_1, expected: away from it; is the pose mirrored, or"
        assert (mirrored in found[1]) is not ok

    def test_a_mirrored_pose_is_reported_at_a_cable_to_the_side(self, simulated):
        lab = simulated["sway_1"]
        before, during = windows(lab, "sway_1", gives_way=False)
        aside = -0.05 if lab.testbed.cables[4].exit[1] > 0 else 0.05
        during[BAR] = during[BAR] + np.array([0.0, aside, 0.0, 0, 0, 0, 0])
        both = (before, during)
        assert findings(analyse_pull(lab.testbed, "sway_1", *both))["pull_pose"][0] is True
        both = changed(both, BAR, inverted(1))
        assert findings(analyse_pull(lab.testbed, "sway_1", *both))["pull_pose"][0] is False

    def test_a_move_across_the_cable_leaves_it_open(self, simulated):
        lab = simulated["hoist_1"]
        before, during = windows(lab, "hoist_1", gives_way=False)
        during[BAR] = during[BAR].copy()
        during[BAR][:, 1] += 0.02
        found = findings(analyse_pull(lab.testbed, "hoist_1", before, during))
        assert found["pull_pose"] == (
            None,
            "cannot decide: the bar moved across hoist_1, not along it",
        )

    def test_a_moving_frame_is_taken_into_account(self, simulated):
        # Frame and bar move together: no cable changes its length.
        lab = simulated["hoist_1"]
        before, during = windows(lab, "hoist_1", gives_way=False)
        for name in (BAR, FRAME):
            during[name] = during[name] + np.array([0.0, 0.0, 0.05, 0, 0, 0, 0])
        found = findings(analyse_pull(lab.testbed, "hoist_1", before, during))
        assert found["pull_pose"][0] is None


class TestUndecided:
    def test_no_pull_is_no_verdict(self, simulated):
        lab = simulated["surge_2"]
        before, _ = windows(lab, "surge_2")
        verdict = analyse_pull(lab.testbed, "surge_2", before, before)
        assert verdict.ok is None
        assert verdict.answered == {}
        assert findings(verdict)["pull_tension"] == (
            None,
            "no tension changed clearly: pull harder, or no load cell is on",
        )

    def test_two_cables_that_answer_equally_leave_it_open(self, simulated):
        lab = simulated["surge_2"]
        before, during = windows(lab, "surge_2")
        during[TENSION][:, 0] += 0.9 * (during[TENSION][:, 3] - 5.0)
        verdict = analyse_pull(lab.testbed, "surge_2", before, during)
        assert verdict.ok is None
        assert findings(verdict)["pull_tension"] == (
            None,
            "cannot decide: the tension of hoist_1 and surge_2 answered equally; hold the bar",
        )

    def test_a_weaker_answer_elsewhere_does_not_matter(self, simulated):
        lab = simulated["surge_2"]
        before, during = windows(lab, "surge_2")
        during[TENSION][:, 0] += 0.5 * (during[TENSION][:, 3] - 5.0)
        assert analyse_pull(lab.testbed, "surge_2", before, during).ok is True

    @pytest.mark.parametrize("name", [TENSION, WINCHES, BAR, FRAME])
    def test_missing_messages_are_said(self, simulated, name):
        lab = simulated["surge_2"]
        before, during = windows(lab, "surge_2")
        del during[name]
        verdict = analyse_pull(lab.testbed, "surge_2", before, during)
        texts = [finding.text for finding in verdict.findings if finding.ok is None]
        assert f"cannot decide: too few messages of {name}" in texts
        assert verdict.ok is (None if name == TENSION else True)


def test_a_machine_without_bar_has_no_pose_to_judge(rig):
    rng = np.random.default_rng(0)
    before = {TENSION: rng.normal(5.0, 0.1, (50, 1))}
    during = {TENSION: rng.normal(25.0, 0.1, (50, 1))}
    verdict = analyse_pull(rig, "only", before, during)
    assert verdict.ok is True
    assert "pull_pose" not in findings(verdict)


def test_an_unknown_cable_is_refused(thesis):
    with pytest.raises(InputError, match=r"^no cable 'surge_9' in the test-bed, allowed: hoist_1,"):
        analyse_pull(thesis, "surge_9", {}, {})


def test_the_instruction_names_cable_and_time():
    assert instruction("surge_2", 3.0).endswith(
        "pull cable surge_2 by hand, outwards of its winch, for 3 s"
    )
