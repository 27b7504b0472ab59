"""Whether what goes ahead of the winches' friction is what friction takes, when and how much."""

from dataclasses import replace

import numpy as np
import pytest
from run_samples import bundle_of

from bench.results.tracking import Case, follow
from cspm_control.controllers.force_controller import ForceController
from cspm_control.feedforward.friction_feedforward import (
    COLUMNS,
    DRY,
    LOAD,
    VISCOUS,
    FrictionFeedforward,
    winch_friction,
)
from cspm_control.stages.make import make_controller
from cspm_model.kernels.cable import RADIUS
from cspm_model.kernels.rotation import quaternion_from_euler, rotation_from_euler
from cspm_model.kinematics import inverse_kinematics
from cspm_model.parameters import nominal_parameters
from cspm_msgs_py.control_spec.force import PiGains
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
from cspm_msgs_py.testbed import EffectEntry

PAST = "worst_case_steep_past_thesis"
ON = "control.force.friction_feedforward={}"
THESIS = bundle_of("rest").testbed.testbed
CABLES = nominal_parameters(THESIS).cables
N = len(CABLES)
SMOOTH = 0.003
STRIBECK = {"breakaway_torque": 0.02, "coulomb_torque": 0.004, "stribeck_speed": 1.0}


def with_friction(*entries):
    """Return the thesis's machine with (effect, elements, parameters) more."""
    more = tuple(
        EffectEntry(effect=effect, elements=elements, parameters=parameters)
        for effect, elements, parameters in entries
    )
    return THESIS.model_copy(update={"effects": (*THESIS.effects, *more)})


def reference(position, euler, velocity, spin):
    """Return a row: pose, twist in world axes, no acceleration."""
    quaternion = np.empty(4)
    quaternion_from_euler(*euler, quaternion)
    return np.array([*position, *quaternion, *velocity, *spin, *6 * [0.0]])


BAR = [0.05, -0.03, 1.9], [0.02, 0.1, -0.05], [0.31, -0.23, 0.02], [0.3, 0.2, -0.4]
FRAME = [0.01, 0.02, -0.01], [0.01, -0.02, 0.03], [0.02, 0.05, -0.04], [0.02, -0.03, 0.05]


def moved(body, time):
    """Return x y z φ θ ψ after a short time, by the matrices of the rotations."""
    position, euler, velocity, spin = (np.array(part) for part in body)
    x, y, z = spin * time
    turned = np.array([[1.0, -z, y], [z, 1.0, -x], [-y, x, 1.0]]) @ np.reshape(
        rotation_from_euler(*euler), (3, 3)
    )
    angles = (
        np.arctan2(turned[2, 1], turned[2, 2]),
        np.arcsin(-turned[2, 0]),
        np.arctan2(turned[1, 0], turned[0, 0]),
    )
    return np.array([*(position + velocity * time), *angles])


def winding_speeds():
    """Return how fast motors wind in [rad/s], from lengths a moment before and after."""
    lengths = [inverse_kinematics(CABLES, moved(BAR, t), moved(FRAME, t)) for t in (-1e-6, 1e-6)]
    return -(lengths[1] - lengths[0]) / 2e-6 / CABLES[:, RADIUS]


def test_each_kind_of_friction_at_the_references_speed():
    tensions, speeds = np.linspace(2.0, 16.0, N), winding_speeds()
    rng = np.random.default_rng(5)
    friction = rng.uniform(0.5, 1.0, (N, COLUMNS)) * [0.03, 1e-3, 0.2]
    assert (speeds > 0.0).any()
    assert (speeds < 0.0).any()
    ahead = FrictionFeedforward(CABLES, friction, SMOOTH)
    found = ahead.torque(reference(*BAR), reference(*FRAME), tensions)
    sign = np.tanh(speeds * CABLES[:, RADIUS] / SMOOTH)
    dry = friction[:, DRY] + friction[:, LOAD] * CABLES[:, RADIUS] * tensions
    np.testing.assert_allclose(found, dry * sign + friction[:, VISCOUS] * speeds, rtol=1e-5)


def test_the_sign_turns_without_a_step():
    """Between rest and the speed at which the sign is ±1, and against direction, it is odd."""
    friction = np.zeros((N, COLUMNS))
    friction[:, DRY] = 0.01
    ahead, still = FrictionFeedforward(CABLES, friction, SMOOTH), reference(*(4 * [[0.0] * 3]))

    def torque(fall):
        row = reference([0.0, 0.0, 2.0], [0.0] * 3, [0.0, 0.0, fall], [0.0] * 3)
        return ahead.torque(row, still, np.full(N, 5.0))

    np.testing.assert_array_equal(torque(0.0), 0.0)
    np.testing.assert_allclose(torque(0.001), -torque(-0.001), rtol=1e-12)
    # A bar that falls pays cables out: friction holds with the motor, which needs less torque.
    falls = np.linspace(0.0, 0.05, 500)
    steps = np.diff([torque(fall) for fall in falls], axis=0)
    assert (steps < 0.0).all()
    # A cable is paid out no faster than the bar falls.
    assert np.abs(steps).max() <= 0.01 * falls[1] / SMOOTH
    np.testing.assert_allclose(torque(0.05), -0.01, rtol=1e-3)


def test_what_the_file_says_of_friction():
    machine = with_friction(
        ("winch_coulomb_friction", ("hoist_1", "sway_2"), {"torque": 0.01}),
        ("winch_stribeck_friction", ("hoist_1",), STRIBECK),
        ("winch_viscous_friction", (), {"coefficient": 2e-5}),
        ("winch_load_friction", ("surge_1",), {"coefficient": 0.1}),
        ("pulley_friction", ("surge_2",), {"coefficient": 0.1, "wrap": 1.0}),
    )
    expected = np.zeros((N, COLUMNS))
    names = machine.cable_names
    expected[names.index("hoist_1"), DRY] = 0.014
    expected[names.index("sway_2"), DRY] = 0.01
    expected[:, VISCOUS] = 2e-5
    expected[names.index("surge_1"), LOAD] = 0.1
    np.testing.assert_allclose(winch_friction(machine), expected, rtol=1e-12)


def test_a_file_that_has_no_friction_is_refused_in_one_line():
    scenario = bundle_of(PAST, ON).scenario
    with pytest.raises(InputError) as caught:
        make_controller(FORCE_CONTROLLER, scenario, THESIS)
    assert str(caught.value) == (
        "control.force.friction_feedforward: the effects of test-bed thesis tell of no friction,"
        " allowed: with winch_coulomb_friction, winch_stribeck_friction, winch_viscous_friction,"
        " winch_load_friction"
    )


@pytest.mark.parametrize("value", ["0", "-0.001"])
def test_the_speed_about_which_the_sign_turns_is_above_zero(value):
    key = r"friction_feedforward.smooth_below: .*greater than 0"
    with pytest.raises(InputError, match=key):
        bundle_of(PAST, f"control.force.friction_feedforward={{smooth_below: {value}}}")


def controller(limit=2.0):
    gains = [PiGains(kp=0.01, integral_frequency=40.0)]
    return ForceController(gains, np.array([0.025]), np.array([limit]), period=1e-3)


def test_the_torque_ahead_is_added_and_is_no_jump_at_the_start():
    plain, ahead = controller(), controller()
    at, more = np.array([10.0]), np.array([0.05])
    np.testing.assert_allclose(ahead.step(at, at, more), plain.step(at, at), rtol=1e-12)
    for wanted in (10.5, 9.0, 11.0):
        without = plain.step(np.array([wanted]), at)
        np.testing.assert_allclose(ahead.step(np.array([wanted]), at, more), without, rtol=1e-12)
    np.testing.assert_allclose(ahead.step(at, at, -more) - plain.step(at, at), -0.1, rtol=1e-9)


def test_the_torque_ahead_counts_towards_the_limit():
    found = controller(limit=0.3)
    at = np.array([10.0])
    found.step(at, at)
    assert found.saturated == 0
    np.testing.assert_array_equal(found.step(at, at, np.array([0.1])), 0.3)
    assert found.saturated == 1


class Stage:
    """A force stage of the machine with 10 mN·m of dry friction at every motor."""

    def __init__(self, *overrides):
        friction = (("winch_coulomb_friction", (), {"torque": 0.01}),)
        bundle = Case(PAST, overrides, friction).bundle()
        self.stage = make_controller(FORCE_CONTROLLER, bundle.scenario, bundle.testbed.testbed)
        self.now_ms, self.sent = 0, None

    def step(self, **references):
        """Step with these references; return the torques."""
        rows = {TENSION: np.full(N, 6.0), TENSION_COMMAND: np.full(N, 6.0)}
        rows[WINCH_STATE] = np.zeros(3 * N)
        topics = {"bar": BAR_REFERENCE, "frame": FRAME_REFERENCE}
        rows |= {topics[name]: row for name, row in references.items()}
        self.stage.step(self.now_ms * 1_000_000, rows, self._keep)
        self.now_ms += 1
        return self.sent

    def _keep(self, _, row):
        self.sent = row.copy()


def test_the_stage_sends_it_as_soon_as_a_reference_is_there():
    stage, plain = Stage(ON), Stage()
    np.testing.assert_array_equal(stage.step(), plain.step(bar=reference(*BAR)))
    more = stage.step(bar=reference(*BAR), frame=reference(*FRAME)) - plain.step()
    sign = np.tanh(winding_speeds() * CABLES[:, RADIUS] / SMOOTH)
    np.testing.assert_allclose(more, 0.01 * sign, rtol=1e-4)
    # Without a message about it the frame stands still.
    still = reference(*(4 * [[0.0] * 3]))
    np.testing.assert_array_equal(
        stage.step(bar=reference(*BAR)), stage.step(bar=reference(*BAR), frame=still)
    )


@pytest.mark.parametrize("name", ["bar", "frame"])
@pytest.mark.parametrize(
    ("row", "text"),
    [
        (np.full(19, np.nan), "nan, allowed: finite numbers"),
        (np.full(7, 0.0), "a row of shape (7,), allowed: (19,)"),
    ],
)
def test_a_reference_that_cannot_be_right_trips(name, row, text):
    stage, plain = Stage(ON), Stage()
    rows = {"bar": reference(*BAR), "frame": reference(*FRAME)}
    for each in (stage, plain):
        each.step(**rows)
        each.step(**rows | {name: row})
    assert stage.stage.safe
    assert not plain.stage.safe
    topic = {"bar": BAR_REFERENCE, "frame": FRAME_REFERENCE}[name]
    assert f"{topic}: {text}" in stage.stage.status().values["reason"]


def test_only_those_who_want_it_read_references():
    machine = with_friction(("winch_coulomb_friction", (), {"torque": 0.01}))
    for overrides, wanted in (((), set()), ((ON,), {BAR_REFERENCE, FRAME_REFERENCE})):
        plan = schedule_of(bundle_of(PAST, *overrides).scenario, machine).nodes[FORCE_CONTROLLER]
        read = {name for name in (*plan.inputs, *plan.held) if name.endswith("/reference")}
        assert read == wanted


@pytest.mark.compiled
def test_it_takes_away_what_friction_costs_and_its_opposite_adds_to_it(monkeypatch):
    """Pitch hangs on the hoists, whose gear makes 10 mN·m at the motor 4 N at the cable."""
    overrides = ("duration=6.0", "control.motion.governor=null")
    friction = (("winch_coulomb_friction", (), {"torque": 0.01}),)

    def pitch_error(case):
        errors, *_ = follow(case.bundle())
        return np.sqrt((errors[1000:, 4] ** 2).mean())

    clean = pitch_error(Case(PAST, overrides))
    without = pitch_error(Case(PAST, overrides, friction))
    ahead = Case(PAST, (*overrides, ON), friction)
    with_it = pitch_error(ahead)
    monkeypatch.setattr(
        "cspm_control.stages.make.winch_friction", lambda testbed: -winch_friction(testbed)
    )
    inverted = pitch_error(ahead)
    assert without > 3.0 * clean
    assert with_it - clean < 0.2 * (without - clean)
    assert inverted - clean > 1.5 * (without - clean)


@pytest.mark.slow
@pytest.mark.compiled
def test_it_holds_on_the_other_plant():
    """MuJoCo's winches rub by its own contact model."""
    overrides = ("duration=6.0", "control.motion.governor=null")
    friction = (("winch_coulomb_friction", (), {"torque": 0.01}),)
    found = [
        follow(replace(Case(PAST, (*overrides, *more), friction), plant="mujoco").bundle())[0]
        for more in ((), (ON,))
    ]
    without, with_it = (np.sqrt((errors[1000:, 4] ** 2).mean()) for errors in found)
    assert with_it < 0.4 * without
