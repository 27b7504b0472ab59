"""Whether what goes ahead of the winches is what they take, when and how much."""

from dataclasses import replace

import numpy as np
import pytest
from machines import build, pulley_content, route_content
from run_samples import bundle_of

from bench.results.tracking import Case, follow
from cspm_control.feedforward.winch_feedforward import WinchFeedforward, winding_accelerations
from cspm_control.stages.make import make_controller
from cspm_model.equilibrium import unstretched_lengths
from cspm_model.kernels.cable import (
    DAMPING_CONSTANT,
    DAMPING_SLOPE,
    INERTIA,
    OFFSET_LENGTH,
    RADIUS,
    elastic_tension,
    law_scale,
)
from cspm_model.kernels.rows import reference_row
from cspm_model.parameters import nominal_parameters
from cspm_msgs_py.errors import InputError
from cspm_msgs_py.schedule import (
    BAR_REFERENCE,
    FORCE_CONTROLLER,
    FRAME_REFERENCE,
    TENSION,
    TENSION_COMMAND,
    WINCH_STATE,
    schedule_of,
)

PAST = "worst_case_steep_past_thesis"
ON = "control.force.winch_feedforward={}"
STRETCHED = "control.force.winch_feedforward={stretch_bandwidth: 200.0}"
MACHINE = nominal_parameters(bundle_of("rest").testbed.testbed)
CABLES = MACHINE.cables
N = len(CABLES)
PULLEYS = nominal_parameters(build(pulley_content())).cables
ROUTES = nominal_parameters(build(route_content())).cables
PERIOD = 1e-3
# Where bar and frame are at t = 0, x y z φ θ ψ, how fast, and how that changes.
BAR = np.array(
    [
        [0.05, -0.03, 1.9, 0.02, 0.1, -0.05],
        [0.31, -0.23, 0.02, 0.3, 0.2, -0.4],
        [1.1, -2.0, 3.0, -0.7, 0.9, 1.3],
    ]
)
FRAME = np.array(
    [
        [0.01, 0.02, -0.01, 0.01, -0.02, 0.03],
        [0.02, 0.05, -0.04, 0.02, -0.03, 0.05],
        [0.3, -0.2, 0.5, 0.1, -0.2, 0.3],
    ]
)
STILL = np.array([[0.0, 0.0, 2.0, 0.0, 0.0, 0.0], 6 * [0.0], 6 * [0.0]])
AT_REST = np.zeros((3, 6))


def row(motion, time=0.0):
    """Return the reference row at a time, of which the pose is a parabola."""
    pose, rate, change = motion
    values = [pose + time * (rate + 0.5 * time * change), rate + time * change, change]
    out = np.empty(19)
    reference_row(np.concatenate(values), out)
    return out


def geometry(time=0.0, bar=BAR, frame=FRAME, cables=CABLES):
    """Return lengths and how their decrease grows."""
    lengths, winding = np.empty(N), np.empty(N)
    winding_accelerations(cables, row(bar, time), row(frame, time), lengths, winding)
    return lengths, winding


def elongation(lengths, tensions):
    return lengths - unstretched_lengths(MACHINE, lengths, tensions)


def feedforward(bandwidth=None):
    return WinchFeedforward(MACHINE, bandwidth, period=PERIOD)


@pytest.mark.parametrize(
    ("cables", "least"),
    [(CABLES, 0.1), (PULLEYS, 0.02), (ROUTES, 0.02)],
    ids=["straight", "pulleys", "routes"],
)
def test_the_winding_acceleration_is_the_second_difference_of_lengths(cables, least):
    h = 1e-4
    before, here, after = (geometry(time, cables=cables)[0] for time in (-h, 0.0, h))
    found = geometry(cables=cables)[1]
    np.testing.assert_allclose(found, -(before - 2.0 * here + after) / h**2, rtol=1e-4, atol=1e-5)
    assert np.abs(found).min() > least


def test_without_stretch_it_is_the_rotor_that_is_turned_and_the_change_of_tension():
    found, tensions = feedforward(), np.linspace(4.0, 11.0, N)
    lengths, winding = geometry()
    share = lengths / (lengths - elongation(lengths, tensions))
    turned = CABLES[:, INERTIA] / CABLES[:, RADIUS] * share * winding
    first = found.torque(row(BAR), row(FRAME), tensions)
    np.testing.assert_allclose(first, turned, rtol=1e-4)
    more = found.torque(row(BAR), row(FRAME), tensions + 2.0)
    np.testing.assert_allclose(more - first, 2.0 * CABLES[:, RADIUS], rtol=1e-9)
    found.restart()
    again = found.torque(row(BAR), row(FRAME), tensions + 2.0)
    assert not np.allclose(again, more)
    np.testing.assert_allclose(again, turned, rtol=1e-3)


def stretched_by(wanted, bandwidth=200.0, scale=1.0):
    """Return what of the torque stretches the cables of a bar at rest, per step."""
    with_it, without = feedforward(bandwidth), feedforward()
    rows = row(STILL), row(AT_REST)
    return np.array(
        [
            with_it.torque(*rows, scale * tensions) - without.torque(*rows, scale * tensions)
            for tensions in wanted
        ]
    )


def test_tensions_that_stay_stretch_nothing():
    wanted = np.tile(np.linspace(4.0, 11.0, N), (50, 1))
    np.testing.assert_allclose(stretched_by(wanted), 0.0, atol=1e-9)


def test_what_stretches_adds_up_to_the_elongation_that_the_new_tension_makes():
    """Torque over inertia, summed twice, is what the drum winds: independent of law and filter."""
    first, last = np.full(N, 5.0), np.full(N, 5.3)
    steps = 2000
    share = np.clip(np.arange(steps) / 500.0, 0.0, 1.0)
    wanted = first + np.outer(share, last - first)
    turned = stretched_by(wanted) * CABLES[:, RADIUS] / CABLES[:, INERTIA]
    speeds = np.cumsum(turned, axis=0) * PERIOD
    wound = speeds.sum(axis=0) * PERIOD
    lengths, _ = geometry(bar=STILL, frame=AT_REST)
    stretch = elongation(lengths, last) - elongation(lengths, first)
    # The drum winds stretched cable, of which l0/l is unstretched.
    share = 1.0 - elongation(lengths, 0.5 * (first + last)) / lengths
    np.testing.assert_allclose(share * wound, stretch, rtol=1e-3)
    assert (stretch > 5e-5).all()
    assert np.abs(speeds[-1]).max() < 1e-3 * np.abs(speeds).max()


def test_the_stretch_that_is_foreseen_carries_the_tension_that_is_wanted():
    """The law and the damper of the plant, fed with the foreseen stretch, by another road."""
    times = PERIOD * np.arange(4000)
    wanted = 7.0 + 2.0 * np.outer(np.sin(3.0 * times), np.ones(N))
    turned = stretched_by(wanted, bandwidth=800.0) * CABLES[:, RADIUS] / CABLES[:, INERTIA]
    lengths, _ = geometry(bar=STILL, frame=AT_REST)
    speeds = np.cumsum(turned, axis=0) * PERIOD
    for i in range(N):
        elastic = lengths[i] - elongation(lengths, wanted[0])[i] + CABLES[i, OFFSET_LENGTH]
        damping = CABLES[i, DAMPING_CONSTANT] - CABLES[i, DAMPING_SLOPE] * elastic
        reached = elongation(lengths, wanted[0])[i] + PERIOD * np.cumsum(speeds[:, i])
        law = elastic, law_scale(elastic, CABLES, i), CABLES, MACHINE.tables, i
        found = np.array([elastic_tension(e, *law)[0] for e in reached]) + damping * speeds[:, i]
        np.testing.assert_allclose(found, wanted[:, i], atol=0.1)


class Stage:
    """A force stage of the thesis's machine."""

    def __init__(self, *overrides):
        bundle = Case(PAST, overrides).bundle()
        self.stage = make_controller(FORCE_CONTROLLER, bundle.scenario, bundle.testbed.testbed)
        self.now_ms, self.sent = 0, None

    def step(self, tension=6.0, **references):
        """Step with these references; return the torques."""
        rows = {TENSION: np.full(N, 6.0), TENSION_COMMAND: np.full(N, tension)}
        rows[WINCH_STATE] = np.zeros(3 * N)
        topics = {"bar": BAR_REFERENCE, "frame": FRAME_REFERENCE}
        rows |= {topics[name]: each for name, each in references.items()}
        self.stage.step(self.now_ms * 1_000_000, rows, self._keep)
        self.now_ms += 1
        return self.sent

    def _keep(self, _, torques):
        self.sent = torques.copy()


def test_the_stage_sends_it_and_without_the_option_or_a_reference_what_it_always_sent():
    references = {"bar": row(BAR), "frame": row(FRAME)}
    plain, ahead, later = Stage(), Stage(ON), Stage(ON)
    start = plain.step(**references)
    # No jump at the start, and none of the whole tension when references come later.
    np.testing.assert_allclose(ahead.step(**references), start, rtol=1e-12)
    np.testing.assert_array_equal(later.step(), start)
    more = ahead.step(7.0, **references) - plain.step(7.0)
    np.testing.assert_allclose(more, CABLES[:, RADIUS], rtol=1e-9)
    turned = later.step(**references) - Stage().step()
    expected = feedforward().torque(row(BAR), row(FRAME), np.full(N, 6.0))
    np.testing.assert_allclose(turned, expected, atol=1e-12)


def test_friction_and_winches_go_ahead_together():
    friction = "control.force.friction_feedforward={}"
    rubbing = (("winch_coulomb_friction", (), {"torque": 0.01}),)
    references = {"bar": row(BAR), "frame": row(FRAME)}
    found = []
    for overrides in ((), (friction,), (ON,), (friction, ON)):
        bundle = Case(PAST, overrides, rubbing).bundle()
        stage = Stage()
        stage.stage = make_controller(FORCE_CONTROLLER, bundle.scenario, bundle.testbed.testbed)
        stage.step()
        found.append(stage.step(**references))
    plain, rubbed, wound, both = found
    np.testing.assert_allclose(both - plain, (rubbed - plain) + (wound - plain), atol=1e-12)
    assert np.abs(rubbed - plain).min() > 1e-3


def test_only_those_who_want_it_read_references_and_a_wrong_one_trips():
    for overrides, wanted in (((), set()), ((ON,), {BAR_REFERENCE, FRAME_REFERENCE})):
        bundle = bundle_of(PAST, *overrides)
        plan = schedule_of(bundle.scenario, bundle.testbed.testbed).nodes[FORCE_CONTROLLER]
        read = {name for name in (*plan.inputs, *plan.held) if name.endswith("/reference")}
        assert read == wanted
    stage = Stage(ON)
    stage.step(bar=row(BAR))
    assert not stage.stage.safe
    stage.step(bar=np.full(19, np.nan))
    assert stage.stage.safe
    assert f"{BAR_REFERENCE}: nan" in stage.stage.status().values["reason"]


@pytest.mark.parametrize("value", ["0", "-100"])
def test_the_bandwidth_of_stretch_is_above_zero(value):
    with pytest.raises(InputError, match=r"stretch_bandwidth: .*greater than 0"):
        bundle_of(PAST, f"control.force.winch_feedforward={{stretch_bandwidth: {value}}}")


SLOW = (
    "duration=6.0",
    "sensors=ideal",
    "control.motion.governor=null",
    "control.force.bandwidth=200",
)


def heave_error(case):
    errors, *_ = follow(case.bundle())
    return np.sqrt((errors[1000:, 2] ** 2).mean())


@pytest.mark.compiled
def test_slow_force_controllers_follow_with_it_and_with_its_opposite_worse(monkeypatch):
    without = heave_error(Case(PAST, SLOW))
    ahead = Case(PAST, (*SLOW, STRETCHED))
    assert heave_error(ahead) < 0.1 * without
    right = WinchFeedforward.torque
    monkeypatch.setattr(
        "cspm_control.feedforward.winch_feedforward.WinchFeedforward.torque",
        lambda *arguments: -right(*arguments),
    )
    assert heave_error(ahead) > 1.5 * without


@pytest.mark.slow
@pytest.mark.compiled
def test_stretch_pays_where_cables_are_soft_and_its_opposite_does_not(monkeypatch):
    soft = {"cables": (0.25, 0.5)}
    without = heave_error(Case(PAST, (*SLOW, ON), **soft))
    ahead = Case(PAST, (*SLOW, STRETCHED), **soft)
    with_it = heave_error(ahead)
    assert with_it < 0.8 * without
    right = WinchFeedforward.torque

    def inverted(self, *arguments):
        found, numbers = right(self, *arguments), self.numbers
        self.numbers = np.array([0.0, PERIOD])
        stiff, self.numbers = right(self, *arguments), numbers
        return 2.0 * stiff - found

    monkeypatch.setattr(WinchFeedforward, "torque", inverted)
    assert heave_error(ahead) > 1.2 * without


@pytest.mark.slow
@pytest.mark.compiled
def test_it_holds_on_the_other_plant():
    """MuJoCo's winches and cables are computed by its own integrator."""
    found = [
        heave_error(replace(Case(PAST, (*SLOW, *more)), plant="mujoco")) for more in ((), (ON,))
    ]
    assert found[1] < 0.2 * found[0]
