"""Sampled loops against python-control, the controllers themselves, and a run of the machine."""

from dataclasses import replace

import control
import numpy as np
import pytest
from altered_machines import CENTRE, THESIS
from cascade import Cascade
from numpy.testing import assert_allclose
from run_samples import bundle_of, recorded

from cspm_control.allocation.tension_distribution import TensionDistribution
from cspm_control.analysis import sampled_loops
from cspm_control.analysis.loop_view import LoopView, sampled_view
from cspm_control.analysis.loops import CASCADE, DESIGNED, LATE, SAMPLED, analyse_loops
from cspm_control.analysis.sampled_loops import (
    LoopTiming,
    cascade_plant,
    distribution_slopes,
    loop_timing,
    motion_controllers,
    pi_system,
    pid_system,
)
from cspm_control.analysis.sampled_system import closed, diagonal, sample, series
from cspm_control.controllers.force_controller import ForceController
from cspm_control.controllers.motion_controller import MotionController
from cspm_control.design.margins import margins
from cspm_model.equilibrium import gravity_wrench
from cspm_model.kernels.rotation import quaternion_from_euler
from cspm_model.linearisation import linear_model, mass_matrix, motion_subsystem, operating_point
from cspm_model.parameters import nominal_parameters
from cspm_msgs_py.control_spec.force import PiGains
from cspm_msgs_py.dofs import CONTROLLED_AXES, DOFS
from cspm_msgs_py.errors import InputError
from cspm_msgs_py.scenario import ClosedLoop, PidGains, Rates, parse_scenario
from cspm_run.assembly import resolve
from cspm_run.recorded_run import run

PERIOD = 1e-3
PROMPT = LoopTiming(PERIOD, 1, 1, 0, 0, 0)
FREQUENCIES = np.array([0.5, 7.0, 60.0, 900.0])
PARAMETERS = nominal_parameters(THESIS)
# Slower than the margins let it be, so that what each way of looking changes shows by itself.
CROSSOVER = "{surge: 12, sway: 10, heave: 12, pitch: 12, yaw: 10}"
SCENARIO = parse_scenario(
    "{name: loops, testbed: x, duration: 1.0}",
    "test",
    ["control.mode=closed_loop", f"control.motion.crossover={CROSSOVER}"],
)
CONTROL = resolve(SCENARIO, THESIS).control


def some_system(seed=0, inputs=2, outputs=3):
    rng = np.random.default_rng(seed)
    a = rng.normal(size=(4, 4)) * 20.0 - 60.0 * np.eye(4)
    return a, rng.normal(size=(4, inputs)), rng.normal(size=(outputs, 4))


def test_sampling_is_that_of_python_control():
    a, b, c = some_system()
    ours = sample(a, b, c, PERIOD)
    theirs = control.sample_system(control.ss(a, b, c, np.zeros((3, 2))), PERIOD, method="zoh")
    wanted = np.moveaxis(theirs(np.exp(1j * FREQUENCIES * PERIOD)), -1, 0)
    assert_allclose(ours.response(FREQUENCIES), wanted, atol=1e-12 * np.abs(wanted).max())


def test_every_tenth_sample_is_sampling_ten_times_slower():
    a, b, c = some_system(1)
    seldom, direct = sample(a, b, c, PERIOD).every(10), sample(a, b, c, 10 * PERIOD)
    assert seldom.period == pytest.approx(direct.period)
    for name in "ABC":
        assert_allclose(getattr(seldom, name), getattr(direct, name), atol=1e-14)


def test_delays_turn_the_phase_and_leave_the_gain():
    a, b, c = some_system(2)
    prompt = sample(a, b, c, PERIOD)
    late = prompt.late(3, [0, 1, 4])
    turn = np.exp(-1j * FREQUENCIES * PERIOD)[:, None]
    factors = turn ** np.array([3, 4, 7])
    assert_allclose(
        late.response(FREQUENCIES), factors[:, :, None] * prompt.response(FREQUENCIES), atol=1e-12
    )


def test_steps_are_those_of_a_time_simulation_by_python_control():
    a, b, c = some_system(3, 1, 1)
    loop = closed(
        sample(a, b, c, PERIOD), pi_system(PiGains(kp=3.0, integral_frequency=9.0), PERIOD)
    )
    theirs = control.ss(loop.A, loop.B, loop.C, loop.D, PERIOD)
    time = PERIOD * np.arange(40)
    wanted = control.forced_response(theirs, time, np.ones(40)).outputs
    assert_allclose(loop.steps(np.ones((40, 1)))[:, 0], wanted, atol=1e-12)


def test_closing_a_loop_is_what_algebra_says():
    a, b, c = some_system(4, 2, 2)
    plant = sample(a, b, c, PERIOD)
    controller = diagonal(
        [pi_system(PiGains(kp=k, integral_frequency=5.0), PERIOD) for k in (2.0, 0.5)]
    )
    loop = series(controller, plant).response(FREQUENCIES)
    wanted = np.linalg.solve(np.eye(2) + loop, loop)
    assert_allclose(closed(plant, controller).response(FREQUENCIES), wanted, atol=1e-12)


def test_pid_is_the_motion_controller():
    gains, rng = PidGains(kp=190.0, ki=50.0, kd=44.0), np.random.default_rng(0)
    real = MotionController(
        {"heave": gains},
        THESIS.bar,
        THESIS.gravity,
        period=0.01,
        derivative_filter=200.0,
        integral_limits=(1e9, 1e9),
    )
    errors = np.cumsum(rng.normal(size=50)) * 1e-3
    errors[0] = 0.0  # it starts by cancelling its first proportional term
    pose, reference = np.zeros(7), np.zeros(19)
    pose[6] = reference[6] = 1.0
    found = []
    for error in errors:
        reference[2] = error
        found.append(real.step(pose, reference)[2] + THESIS.bar.mass * THESIS.gravity)
    ours = pid_system(gains, 200.0, 0.01).steps(errors[:, None])[:, 0]
    assert_allclose(found, ours, atol=1e-10)


def test_pi_is_the_force_controller():
    gains, rng = PiGains(kp=0.03, integral_frequency=40.0), np.random.default_rng(1)
    real = ForceController([gains], np.array([0.0]), np.array([1e9]), period=PERIOD)
    errors = rng.normal(size=50)
    errors[0] = 0.0
    found = [real.step(np.array([e]), np.zeros(1))[0] for e in errors]
    assert_allclose(found, pi_system(gains, PERIOD).steps(errors[:, None])[:, 0], atol=1e-12)


def test_slopes_of_the_distribution_are_those_of_the_one_that_runs():
    point = operating_point(THESIS, PARAMETERS, CENTRE)
    real = TensionDistribution(PARAMETERS.cables, np.tile([-1e9, 1e9], (8, 1)))
    frame = np.array([0.0, 0, 0, 0, 0, 0, 1])

    def tensions(pose, wrench):
        row = np.zeros(7)
        row[:3] = pose[:3]
        quaternion_from_euler(*pose[3:], row[3:])
        return real.step(-gravity_wrench(PARAMETERS, pose) + wrench, row, frame).tensions

    per_wrench, per_pose = distribution_slopes(PARAMETERS, point)
    shift = 1e-5 * np.array([1.0, -2.0, 1.0, 0.0, 3.0, -1.0])
    push = 1e-3 * np.array([1.0, 2.0, -1.0, 0.0, 0.5, 1.0])
    moved = tensions(point.bar_pose + shift, push) - tensions(point.bar_pose, 0 * push)
    wanted = per_pose @ shift + per_wrench @ push[[0, 1, 2, 4, 5]]
    assert_allclose(moved, wanted, atol=2e-3 * np.abs(wanted).max())
    assert np.abs(per_pose @ shift).max() > 0.01 * np.abs(wanted).max()


@pytest.mark.parametrize("every", [1, 10])
def test_poles_of_the_cascade_are_those_of_its_own_bookkeeping(every):
    """Against another coding of the same loop, state by state."""
    point = operating_point(THESIS, PARAMETERS, CENTRE)
    model = linear_model(THESIS, PARAMETERS, point, exact=True)
    rows = motion_subsystem(model, PARAMETERS, point).C
    timing = replace(PROMPT, motion=every)
    plant = cascade_plant(model, PARAMETERS, point, rows, timing, CONTROL.force.gains)
    whole = closed(plant, motion_controllers(CONTROL.motion, plant.period))
    poles = np.linalg.eigvals(whole.A)
    ours = np.log(poles[np.abs(poles) > 1e-9].astype(complex)) / plant.period
    other = Cascade(THESIS, CENTRE, CONTROL.motion.gains, CONTROL.force.gains, exact=True)
    for pole in other.sampled(every):
        if abs(pole) < 100.0 and abs(pole) > 1e-3:
            assert np.abs(ours - pole).min() < 1e-3 * abs(pole), pole


def test_the_motion_controller_meets_a_free_bar_as_the_distribution_follows_it(
    monkeypatch,
):
    """Neither the winches' inertia nor the pendulum's stiffness is left of the exact model."""
    point = operating_point(THESIS, PARAMETERS, CENTRE)
    model = linear_model(THESIS, PARAMETERS, point, exact=True)
    rows = motion_subsystem(model, PARAMETERS, point).C
    frequencies = np.array([0.5, 2.0, 5.0])
    axes = list(CONTROLLED_AXES)
    mass = np.diag(mass_matrix(PARAMETERS, point.bar_pose))[axes]

    def inertia_found():
        plant = cascade_plant(model, PARAMETERS, point, rows, PROMPT, CONTROL.force.gains)
        own = np.abs(np.diagonal(plant.response(frequencies)[:, axes], axis1=1, axis2=2))
        return 1.0 / (own * frequencies[:, None] ** 2)

    assert_allclose(inertia_found() / mass, 1.0, atol=0.01)
    still = distribution_slopes(PARAMETERS, point)[0], np.zeros((8, 6))
    monkeypatch.setattr(sampled_loops, "distribution_slopes", lambda *_: still)
    assert (np.abs(inertia_found() / mass - 1.0).max(axis=0) > 0.3).all()


def test_gain_and_phase_margins_are_how_far_instability_is():
    """The gain may rise, and samples may be late, just so far until a pole leaves the circle."""
    a = np.array([[-80.0]])
    plant = sample(a, np.array([[4e4]]), np.ones((1, 1)), PERIOD)
    gains = PiGains(kp=0.02, integral_frequency=20.0)
    found = sampled_view(plant, pi_system(gains, PERIOD), 0.05).margins
    for share, stable in ((0.999, True), (1.001, False)):
        kp = gains.kp * 10 ** (found.gain_margin / 20.0) * share
        louder = pi_system(PiGains(kp=kp, integral_frequency=20.0), PERIOD)
        poles = np.linalg.eigvals(closed(plant, louder).A)
        assert (np.abs(poles).max() < 1.0) == stable
    loop = series(pi_system(gains, PERIOD), plant)
    # Its gain margin is round-off at the integrator's own pole, z = 1.
    theirs = control.margin(control.ss(loop.A, loop.B, loop.C, loop.D, PERIOD))
    assert theirs[1] == pytest.approx(np.degrees(found.phase_margin))
    assert theirs[3] == pytest.approx(found.crossover)
    fast = pi_system(PiGains(kp=0.03, integral_frequency=20.0), PERIOD)
    beyond = sampled_view(plant.late(2, [0]), fast, 0.05).margins
    assert beyond.phase_margin < 0.0
    assert beyond.gain_margin == np.inf
    late = sampled_view(plant.late(1, [0]), pi_system(gains, PERIOD), 0.05).margins
    lost = found.phase_margin - late.phase_margin
    assert lost == pytest.approx(found.crossover * PERIOD)


@pytest.fixture(scope="module")
def analysis():
    return analyse_loops(THESIS, CONTROL, replace(PROMPT, torque_delay=1))


@pytest.mark.slow
def test_designed_loops_are_those_of_the_design(analysis):
    surge = analysis.motion[DESIGNED]["surge"].margins
    assert surge.crossover == pytest.approx(12.0)
    assert np.degrees(surge.phase_margin) == pytest.approx(69.6, abs=0.1)
    for view in analysis.force[DESIGNED].values():
        assert view.margins.bandwidth == pytest.approx(800.0, rel=1e-3)


@pytest.mark.slow
def test_sampling_takes_phase_and_computing_more(analysis):
    for cable, designed in analysis.force[DESIGNED].items():
        phases = [
            views[cable].margins.phase_margin
            for views in (analysis.force[DESIGNED], analysis.force[SAMPLED], analysis.force[LATE])
        ]
        assert phases[0] > phases[1] > phases[2] > 0.0
        crossover = analysis.force[SAMPLED][cable].margins.crossover
        assert phases[1] - phases[2] == pytest.approx(crossover * PERIOD)
        assert designed.margins.gain_margin == np.inf
        assert analysis.force[LATE][cable].margins.gain_margin < 3.0


@pytest.mark.slow
def test_force_loops_take_the_winches_inertia_out_of_heave_and_pitch(analysis):
    """The bar alone is lighter than with its winches, by which the crossover rises."""
    ratio = {
        dof: analysis.motion[CASCADE][dof].margins.crossover / view.margins.crossover
        for dof, view in analysis.motion[SAMPLED].items()
    }
    assert ratio["heave"] > 1.9
    assert ratio["pitch"] > 2.7
    assert_allclose([ratio["surge"], ratio["sway"], ratio["yaw"]], 1.0, atol=0.05)


@pytest.mark.slow
def test_roll_creeps_up_and_all_else_settles(analysis):
    for growth, frequency in analysis.growth.values():
        assert growth == pytest.approx(0.0059, abs=2e-4)
        assert frequency == pytest.approx(26.7, abs=0.1)
    for view in analysis.motion[CASCADE].values():
        assert 0.3 < view.settling_time < 1.0


def test_two_periods_of_computing_are_one_too_many():
    growth = {}
    for late in (1, 2):
        point = operating_point(THESIS, PARAMETERS, CENTRE)
        model = linear_model(THESIS, PARAMETERS, point, exact=True)
        rows = motion_subsystem(model, PARAMETERS, point).C
        timing = replace(PROMPT, torque_delay=late)
        plant = cascade_plant(model, PARAMETERS, point, rows, timing, CONTROL.force.gains)
        poles = np.linalg.eigvals(closed(plant, motion_controllers(CONTROL.motion, PERIOD)).A)
        growth[late] = np.log(np.abs(poles).max()) / PERIOD
    assert growth[1] < 0.01
    assert growth[2] == pytest.approx(90.4, abs=0.1)


@pytest.mark.slow
def test_cascade_with_the_loop_opened_and_closed_again_is_the_whole(analysis):
    point = operating_point(THESIS, PARAMETERS, CENTRE)
    model = linear_model(THESIS, PARAMETERS, point, exact=True)
    rows = motion_subsystem(model, PARAMETERS, point).C
    plant = cascade_plant(model, PARAMETERS, point, rows, PROMPT, CONTROL.force.gains)
    whole = closed(plant, motion_controllers(CONTROL.motion, PERIOD))
    for dof in ("surge", "heave"):
        view, i = analysis.motion[CASCADE][dof], DOFS.index(dof)
        some = slice(20, 100, 20)
        wanted = whole.response(view.frequencies[some])[:, i, i]
        loop = view.open_loop[some]
        assert_allclose(loop / (1.0 + loop), wanted, rtol=1e-6)


def test_settling_time_is_when_the_response_stays():
    time = np.arange(6.0)
    found = margins(lambda w: 1.0 / (1j * w), np.array([0.1, 10.0]))
    nothing = np.zeros(0)

    def settled(*step):
        return LoopView(found, nothing, nothing, nothing, time, np.array(step)).settling_time

    assert settled(0, 1.0, 1.1, 1.01, 0.99, 1.0) == 3.0
    assert np.isnan(settled(0, 1.0, 1.0, 1.0, 1.0, 1.1))
    assert np.isnan(settled(1, 1, 1, 1, 1, 1))


def test_timing_is_in_periods_of_the_plant():
    rates = Rates(plant=2000, force_controller=1000)
    found = loop_timing(rates, {"/cables/tension": 0.0005, "/bar/pose": 0.004}, 0.001)
    assert found == LoopTiming(0.0005, 2, 20, 1, 8, 2)


@pytest.mark.parametrize(
    ("rates", "text"),
    [
        (
            {"tension_distribution": 200},
            "rates.tension_distribution: 200 Hz, allowed here: that",
        ),
        ({"force_controller": 250}, "rates.motion_controller: 100 Hz, allowed here: a divisor of"),
        (
            {"motion_capture": 50},
            "rates.motion_capture: 50 Hz, allowed here: a multiple of the",
        ),
        ({"load_cells": 500}, "rates.load_cells: 500 Hz, allowed here: a multiple of the 1000 Hz"),
    ],
)
def test_rates_that_cannot_be_followed_are_refused(rates, text):
    with pytest.raises(InputError, match=text):
        loop_timing(Rates(**rates), {}, 0.0)


@pytest.mark.slow
@pytest.mark.compiled
@pytest.mark.parametrize(("dof", "rate"), [("heave", 1000), ("yaw", 1000), ("pitch", 100)], ids=str)
def test_the_machine_follows_a_small_move_as_the_cascade_says(dof, rate, tmp_path):
    """A nonlinear run on the MuJoCo plant against the linear loop, fed with the same reference."""
    pytest.importorskip("mujoco", minversion="4.0", reason="the MuJoCo plant needs MuJoCo 4")
    i = DOFS.index(dof)
    by = [0.0] * 6
    by[i] = 1e-3
    keys = ("motion_capture", "motion_controller", "tension_distribution")
    bundle = bundle_of(
        "rest",
        "duration=1.2",
        "sensors=ideal",
        f"target.motion={{type: moves, moves: [{{at: 0.1, duration: 0.3, by: {by}}}]}}",
        *(f"rates.{key}={rate}" for key in keys),
    )
    result = _run_mujoco(bundle, tmp_path)
    reference, pose = result["/bar/reference"], result["/truth/bar/pose"]
    gains = bundle.scenario.control
    assert isinstance(gains, ClosedLoop)
    point = operating_point(THESIS, PARAMETERS, CENTRE)
    model = linear_model(THESIS, PARAMETERS, point, exact=True)
    rows = motion_subsystem(model, PARAMETERS, point).C
    timing = replace(PROMPT, motion=1000 // rate)
    plant = cascade_plant(model, PARAMETERS, point, rows, timing, gains.force.gains)
    whole = closed(plant, motion_controllers(gains.motion, plant.period))
    wanted = np.zeros((1200 * rate // 1000, 6))
    wanted[:, i] = _coordinate(reference[:: 1000 // rate], i)[: len(wanted)]
    found = _coordinate(pose[:: 1000 // rate], i)[: len(wanted)]
    linear = whole.steps(wanted)[:, i]
    assert np.abs(found - linear).max() < 0.01 * np.abs(linear).max()
    assert np.abs(linear - wanted[:, i]).max() > 0.05 * np.abs(linear).max()


def _run_mujoco(bundle, folder):

    run(replace(bundle, plant="mujoco"), folder / "bag")
    return {name: rows.rows for name, rows in recorded(folder / "bag").items()}


def _coordinate(rows, i):
    """A DOF's small deviation from its first value, of rows that begin with a pose."""
    if i < 3:
        return rows[:, i] - rows[0, i]
    return 2.0 * rows[:, i]  # of a quaternion near 1
