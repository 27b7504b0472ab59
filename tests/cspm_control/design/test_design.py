"""Controller design: the reconstructed gain table, and margins by a second road."""

from pathlib import Path

import control
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from schedules import delayed

from cspm_control.design.force_gains import design_force_gains
from cspm_control.design.gains import (
    check_separation,
    design_motion_gains,
    force_margins,
    motion_margins,
)
from cspm_control.design.margins import Margins, margins
from cspm_model.linearisation import (
    linear_model,
    motion_subsystem,
    operating_point,
    tension_subsystem,
)
from cspm_msgs_py.control_spec.force import ForceControl, PiGains
from cspm_msgs_py.dofs import CONTROLLED_AXES, DOFS
from cspm_msgs_py.errors import InputError
from cspm_msgs_py.scenario import MotionControl, PidGains, load_scenario
from cspm_msgs_py.schedule import BAR_POSE
from cspm_msgs_py.testbed import Testbed, load_testbed
from cspm_run.assembly import resolve
from cspm_run.library import find_scenario
from cspm_sim.parameters import plant_parameters

TESTBEDS = Path(__file__).resolve().parents[3] / "scenarios" / "testbeds"
THESIS = load_testbed(TESTBEDS / "thesis.yaml").testbed.model_copy(update={"effects": ()})
PARAMETERS = plant_parameters(THESIS)
SCENARIO = MotionControl()
# That the table of the reconstruction was computed for [rad/s].
CROSSOVER = {"surge": 12.0, "sway": 10.0, "heave": 12.0, "pitch": 12.0, "yaw": 10.0}
CENTRE = SCENARIO.design_pose
AXES = list(CONTROLLED_AXES)
CONTROLLED_DOFS = [DOFS[axis] for axis in AXES]

# Kp, Ki, Kd, −3 dB bandwidth [rad/s], phase margin [°], gain margin [dB].
TABLE = {
    "surge": (191.3, 53.4, 44.5, 16.0, 69.6, 25.7),
    "sway": (137.6, 32.0, 38.4, 13.3, 69.8, 11.3),
    "heave": (434.3, 121.2, 101.0, 15.7, 69.9, np.inf),
    "pitch": (55.9, 15.6, 13.0, 15.6, 70.0, np.inf),
    "yaw": (11.29, 2.625, 3.15, 13.3, 69.8, 11.2),
}


def with_cables(cables) -> Testbed:
    return THESIS.model_copy(update={"cables": tuple(cables)})


def ten_cables() -> Testbed:
    """Two more sway cables at the bar's middle."""
    extra = [
        THESIS.cables[4].model_copy(
            update={"name": name, "exit": (0.0, y, -0.2), "attachment": (0.0, 0.0, -0.02)}
        )
        for name, y in (("left", -0.35), ("right", 0.35))
    ]
    return with_cables((*THESIS.cables, *extra))


def roll_held() -> Testbed:
    """Sway cables attached to both sides of the bar: rank 6."""
    cables = [
        cable.model_copy(update={"attachment": (cable.attachment[0], 0.05 * y, -0.02)})
        for cable in THESIS.cables
        for y in [np.sign(cable.exit[1])]
    ]
    return with_cables(cables)


@pytest.fixture(scope="module")
def motion_gains():
    return design_motion_gains(THESIS, PARAMETERS, CENTRE, CROSSOVER)


@pytest.fixture(scope="module")
def force_gains():
    return design_force_gains(THESIS, PARAMETERS, CENTRE, ForceControl().bandwidth)


@pytest.fixture(scope="module")
def plants():
    point = operating_point(THESIS, PARAMETERS, CENTRE)
    model = linear_model(THESIS, PARAMETERS, point)
    return motion_subsystem(model, PARAMETERS, point, AXES), tension_subsystem(model)


def test_motion_gains_are_those_of_the_table(motion_gains):
    assert tuple(motion_gains) == tuple(TABLE)
    for dof, gains in motion_gains.items():
        found = (gains.kp, gains.ki, gains.kd)
        np.testing.assert_allclose(found, TABLE[dof][:3], rtol=0.01)


def test_motion_margins_are_those_of_the_table(motion_gains):
    found = motion_margins(THESIS, PARAMETERS, CENTRE, motion_gains)
    for dof, row in TABLE.items():
        assert found[dof].crossover == pytest.approx(CROSSOVER[dof], rel=1e-6)
        assert found[dof].bandwidth == pytest.approx(row[3], abs=0.06)
        assert np.degrees(found[dof].phase_margin) == pytest.approx(row[4], abs=0.1)
        assert found[dof].gain_margin == pytest.approx(row[5], abs=0.5)
        assert found[dof].low_frequency_gain == pytest.approx(32.0, abs=0.3)


def test_force_gains_reach_the_bandwidth(force_gains):
    found = force_margins(THESIS, PARAMETERS, CENTRE, force_gains)
    for name, gains in force_gains.items():
        assert found[name].bandwidth == pytest.approx(800.0, rel=1e-6)
        assert np.degrees(found[name].phase_margin) > 80.0
        assert found[name].gain_margin == np.inf
        kind = name.split("_")[0]
        integral = {"hoist": 40.0, "surge": 40.0, "sway": 20.3}[kind]
        assert gains.integral_frequency == pytest.approx(integral, abs=0.1)
    # The reconstruction's gains scaled to this bandwidth.
    wanted = {
        "hoist_1": 0.0255 * 800 / 722,
        "surge_1": 0.38 * 800 / 829,
        "sway_1": 0.802 * 800 / 868,
    }
    for name, kp in wanted.items():
        assert force_gains[name].kp == pytest.approx(kp, rel=0.04)


def test_reconstructed_force_gains_have_their_margins():
    gains = {
        "hoist_2": PiGains(kp=0.0255, integral_frequency=60.0),
        "surge_1": PiGains(kp=0.380, integral_frequency=20.0),
        "sway_4": PiGains(kp=0.802, integral_frequency=20.0),
    }
    found = force_margins(THESIS, PARAMETERS, CENTRE, gains)
    bandwidths = [value.bandwidth for value in found.values()]
    np.testing.assert_allclose(bandwidths, [722.0, 829.0, 868.0], rtol=0.006)
    phases = np.degrees([value.phase_margin for value in found.values()])
    np.testing.assert_allclose(phases, [95.0, 88.0, 85.0], atol=0.5)


def test_force_loops_stay_sixty_degrees_from_the_negative_axis(force_gains, plants):
    frequencies = np.geomspace(0.1, 1e5, 3000)
    responses = plants[1].response(frequencies)
    lowest = []
    for i, gains in enumerate(force_gains.values()):
        controller = 1.0 + gains.integral_frequency / (1j * frequencies)
        lowest.append(np.degrees(np.unwrap(np.angle(controller * responses[:, i, i]))).min())
    assert min(lowest) == pytest.approx(-120.0, abs=0.05)


@given(st.floats(0.05, 1.9), st.floats(0.1, 50.0))
def test_margins_of_a_known_loop(gain, corner):
    """L = gain·corner/(s·(s/corner + 1)²): −180° at the corner, where |L| = gain/2."""

    def loop(frequencies):
        s = 1j * frequencies / corner
        return gain / (s * (s + 1.0) ** 2)

    found = margins(loop, corner * np.geomspace(1e-3, 1e3, 300))
    assert found.gain_margin == pytest.approx(20 * np.log10(2.0 / gain), abs=1e-6)
    assert found.low_frequency_gain == np.inf
    w = found.crossover / corner
    assert w * (1.0 + w**2) == pytest.approx(gain, rel=1e-6)
    wanted = np.pi / 2 - 2 * np.arctan(w)
    assert found.phase_margin == pytest.approx(wanted, abs=1e-6)
    closed = loop(np.array([found.bandwidth]))
    assert abs(closed / (1 + closed))[0] == pytest.approx(np.sqrt(0.5), rel=1e-6)


def test_an_unstable_known_loop_has_a_negative_phase_margin_and_gain_to_lose():
    found = margins(lambda w: 4.0 / (1j * w * (1j * w + 1.0) ** 2), np.geomspace(1e-3, 1e3, 300))
    assert found.phase_margin < 0.0
    assert found.low_frequency_gain == pytest.approx(20 * np.log10(2.0), abs=1e-6)


@pytest.mark.parametrize("rounding", [1e-15, -1e-15])
def test_a_crossover_on_the_grid_is_found_whichever_way_it_rounds(rounding):
    def loop(frequencies):
        return (1.0 + rounding * np.sign(len(frequencies) - 1.5)) / (1j * frequencies)

    found = margins(loop, np.array([0.25, 0.5, 1.0, 2.0, 4.0]))
    assert found.crossover == 1.0
    assert found.phase_margin == pytest.approx(np.pi / 2)


def test_a_loop_below_one_has_no_crossover():
    found = margins(lambda w: 0.1 / (1.0 + 1j * w), np.geomspace(1e-3, 1e3, 300))
    assert (found.crossover, found.phase_margin, found.gain_margin) == (0.0, np.inf, np.inf)


@pytest.mark.parametrize("dof", TABLE)
def test_python_control_finds_the_same_motion_margins(dof, motion_gains, plants):
    plant, gains = plants[0], motion_gains[dof]
    row, column = CONTROLLED_DOFS.index(dof), CONTROLLED_DOFS.index(dof)
    c, b = plant.C[AXES[row]], plant.B[:, column]
    frequencies = np.geomspace(0.01, 1e4, 4000)
    siso = control.ss(plant.A, b[:, None], c[None, :], 0.0)(1j * frequencies)
    pid = gains.kp + gains.ki / (1j * frequencies) + gains.kd * 1j * frequencies
    loop = control.frd(siso * pid, frequencies, smooth=True)
    gain, phase, _, at_gain, at_phase, _ = control.stability_margins(loop, returnall=True)
    found = motion_margins(THESIS, PARAMETERS, CENTRE, {dof: gains})[dof]
    assert np.degrees(found.phase_margin) == pytest.approx(min(phase), abs=0.01)
    assert found.crossover == pytest.approx(max(at_phase), rel=1e-4)
    low, high = gain[at_gain < found.crossover], gain[at_gain > found.crossover]
    assert found.low_frequency_gain == pytest.approx(-20 * np.log10(low[-1]), abs=0.01)
    wanted = 20 * np.log10(high[0]) if len(high) else np.inf
    assert found.gain_margin == pytest.approx(wanted, abs=0.01)


@pytest.mark.parametrize(
    ("dof", "frequency", "line"),
    [
        ("surge", 60.0, "surge at 60 rad/s has a phase margin of 21.7°, allowed: at least 60°"),
        ("sway", 25.0, "sway at 25 rad/s has a gain margin of 4.35 dB, allowed: at least 6 dB"),
        ("yaw", 4.0, "yaw at 4 rad/s has a bandwidth of 5.14 rad/s, allowed: at least 7.3 rad/s"),
    ],
)
def test_a_missed_requirement_is_refused(dof, frequency, line):
    with pytest.raises(InputError) as caught:
        design_motion_gains(THESIS, PARAMETERS, CENTRE, {dof: frequency})
    assert str(caught.value) == f"control.motion.crossover: {line}"


def test_requirements_hold_up_to_their_bounds():
    for dof, frequency in {"surge": 33.0, "sway": 18.0, "heave": 38.0, "pitch": 40.0}.items():
        design_motion_gains(THESIS, PARAMETERS, CENTRE, {dof: frequency})


def test_force_requirements_are_checked():
    with pytest.raises(
        InputError, match="bandwidth: 1001 rad/s, allowed: above 0 and at most 1000"
    ):
        design_force_gains(THESIS, PARAMETERS, CENTRE, 1001.0)
    with pytest.raises(
        InputError, match=r"at 100 rad/s the loop of \w+ already falls below −3 dB at"
    ):
        design_force_gains(THESIS, PARAMETERS, CENTRE, 100.0)
    undamped = with_cables(
        cable.model_copy(update={"damping": cable.damping.model_copy(update={"factor": 0.1})})
        for cable in THESIS.cables
    )
    with pytest.raises(
        InputError, match=r"control.force: \w+'s tension falls \d+° behind its torq"
    ):
        design_force_gains(undamped, plant_parameters(undamped), CENTRE, 790.0)


def test_force_loops_must_be_ten_times_as_fast(motion_gains, force_gains):
    motion = motion_margins(THESIS, PARAMETERS, CENTRE, motion_gains)
    force = force_margins(THESIS, PARAMETERS, CENTRE, force_gains)
    check_separation(motion, force)
    slow = Margins(100.0, 1.0, np.inf, np.inf, 159.0)
    with pytest.raises(InputError) as caught:
        check_separation(motion, {**force, "surge_2": slow})
    assert str(caught.value) == (
        "control.force: surge_2 has a bandwidth of 159 rad/s, allowed: at least 159.6 rad/s, 10"
        " times that of surge"
    )
    check_separation(motion, {**force, "surge_2": slow._replace(bandwidth=160.0)})


def test_what_cannot_be_controlled_is_refused():
    with pytest.raises(
        InputError, match=r"control.motion: roll is not controlled, allowed: surge,"
    ):
        design_motion_gains(THESIS, PARAMETERS, CENTRE, {"roll": 10.0})
    with pytest.raises(
        InputError, match=r"control.motion: roll is not controlled, allowed: surge,"
    ):
        motion_margins(THESIS, PARAMETERS, CENTRE, {"roll": PidGains(kp=1.0, ki=0.0, kd=0.0)})
    with pytest.raises(
        InputError, match=r"control.force.gains: hoist_9, allowed: hoist_1, hoist_2"
    ):
        force_margins(
            THESIS, PARAMETERS, CENTRE, {"hoist_9": PiGains(kp=1.0, integral_frequency=1.0)}
        )
    planar = with_cables(THESIS.cables[:4])
    with pytest.raises(
        InputError, match="the cables span 3 of the wrench's 5 controlled directions"
    ):
        design_motion_gains(planar, plant_parameters(planar), CENTRE, {"surge": 12.0})
    bare = THESIS.model_copy(update={"bar": None})
    for design, goal in ((design_motion_gains, {"surge": 12.0}), (design_force_gains, 800.0)):
        with pytest.raises(InputError, match="this test-bed has no bar"):
            design(bare, plant_parameters(bare), CENTRE, goal)


@pytest.mark.parametrize("testbed", [ten_cables(), roll_held()], ids=["ten", "rank_6"])
def test_another_machine(testbed):
    parameters = plant_parameters(testbed)
    motion = design_motion_gains(testbed, parameters, CENTRE, CROSSOVER)
    force = design_force_gains(testbed, parameters, CENTRE, 700.0)
    assert list(force) == list(testbed.cable_names)
    found = force_margins(testbed, parameters, CENTRE, force)
    assert all(value.bandwidth == pytest.approx(700.0) for value in found.values())
    check_separation(motion_margins(testbed, parameters, CENTRE, motion), found)


def test_a_late_camera_gets_slower_motion_loops():
    scenario = load_scenario(find_scenario("rest"))
    prompt, late = (
        resolve(scenario, machine).control.motion.gains
        for machine in (THESIS, delayed(THESIS, {BAR_POSE: 5}))
    )
    assert prompt.keys() == late.keys() == set(CONTROLLED_DOFS)
    assert all(late[dof].kp < 0.9 * prompt[dof].kp for dof in prompt)
