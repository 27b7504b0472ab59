"""The torques that hold the bar, and what the bar does under them."""

import numpy as np
import pytest
from machines import with_bar
from run_samples import SCENARIOS, bundle_of

from cspm_control.safe_state import FREQUENCY, Brake, Hold, balancing_tensions, make_safe_state
from cspm_model.equilibrium import gravity_wrench
from cspm_model.kinematics import geometry
from cspm_msgs_py.errors import InputError
from cspm_msgs_py.safety_spec import Safety
from cspm_msgs_py.scenario import parse_scenario
from cspm_msgs_py.schedule import FORCE_CONTROLLER, MOTION_CONTROLLER, TENSION, TORQUE_COMMAND
from cspm_msgs_py.stepping.safe_state import Winches
from cspm_run.assembly import assemble
from cspm_run.loop import Loop
from cspm_sim.parameters import plant_parameters

MS = 1_000_000
N = 8
REST = Winches(np.zeros(N), np.zeros(N))


def scenario(height=2.0, beside=0.0):
    return parse_scenario(
        "name: plain\ntestbed: none.yaml\nduration: 1.0\n"
        f"target: {{mean_pose: [{beside}, 0.0, {height}, 0.0, 0.0, 0.0]}}\n",
        "my.yaml",
    )


# Balancing tensions


def test_balancing_tensions_carry_the_bar_and_nothing_else(thesis):
    found = balancing_tensions(scenario(), thesis)
    limits = np.array([cable.tension_limits for cable in thesis.cables])
    assert ((found >= limits[:, 0]) & (found <= limits[:, 1])).all()
    parameters = plant_parameters(thesis)
    pose = np.array([0.0, 0.0, 2.0, 0.0, 0.0, 0.0])
    pulled = -geometry(parameters.cables, pose, np.zeros(6)).bar.T @ found
    np.testing.assert_allclose(pulled, -gravity_wrench(parameters, pose), atol=1e-6)
    heavier = balancing_tensions(scenario(), with_bar(thesis, mass=8.0))
    assert heavier.sum() > 1.5 * found.sum()


def test_where_nothing_hangs_nothing_is_balanced(rig):
    np.testing.assert_array_equal(balancing_tensions(scenario(), rig), [0.0])


def test_a_mean_pose_at_which_the_bar_cannot_hang_cannot_be_held(thesis):
    beside = scenario(beside=9.0)
    with pytest.raises(InputError) as caught:
        make_safe_state(beside, thesis)
    line = str(caught.value)
    assert line.startswith(
        "safety.state: hold at the bar's mean pose, no tensions within the limits"
    )
    assert line.endswith("allowed: brake, or a mean pose at which the bar can hang")
    # The brakes need no tensions.
    braked = beside.model_copy(update={"safety": Safety(state="brake")})
    assert make_safe_state(braked, thesis).name == "brake"


# Torques of the safe states


def radii(testbed):
    return np.array([cable.drum_radius / cable.gear_ratio for cable in testbed.cables])


def torque_range(testbed):
    tensions = np.array([cable.tension_limits for cable in testbed.cables])
    limits = np.array([cable.torque_limit for cable in testbed.cables])
    return np.minimum(limits, radii(testbed) * tensions.T)


def test_brake_is_no_torque_and_the_brakes():
    state = Brake(3)
    state.begin(np.ones(3))
    np.testing.assert_array_equal(state.torque(0, None), np.zeros(3))
    assert state.brake


def test_hold_ramps_from_the_measured_tensions_to_the_balancing_ones(thesis):
    balance, start = np.full(N, 5.0), np.linspace(3.0, 12.0, N)
    state = Hold(thesis, balance, 0.5)
    state.begin(start)
    assert not state.brake
    for ms in (0, 1, 100, 250, 499, 500, 501, 10_000):
        share = min(1.0, ms / 500)
        expected = radii(thesis) * (start + (balance - start) * share)
        np.testing.assert_allclose(state.torque(7 * MS + ms * MS, REST), expected, rtol=1e-12)
    assert not state.brake


def test_hold_without_ramp_or_measurement_balances_at_once(thesis):
    balance = np.full(N, 5.0)
    for ramp, start in ((0.0, np.full(N, 9.0)), (0.5, None)):
        state = Hold(thesis, balance, ramp)
        state.begin(start)
        np.testing.assert_allclose(state.torque(0, REST), radii(thesis) * balance, rtol=1e-12)


def test_hold_asks_for_no_tension_beyond_the_limits(thesis):
    low, high = torque_range(thesis)
    for start, expected in ((np.full(N, 1e4), high), (np.zeros(N), low)):
        state = Hold(thesis, np.full(N, 5.0), 0.5)
        state.begin(start)
        np.testing.assert_array_equal(state.torque(0, REST), expected)
        # Not even where the winches are far away.
        for sign, limit in ((-1.0, high), (1.0, low)):
            away = Winches(np.full(N, sign * 1e4), np.zeros(N))
            np.testing.assert_array_equal(state.torque(0, away), limit)


def test_hold_pulls_a_winch_back_to_where_it_was_and_damps_it(thesis):
    """The torques are those of a mass on a critically damped spring."""
    at = np.linspace(-3.0, 3.0, N)
    share = thesis.bar.mass / N
    inertia = share * radii(thesis) ** 2 + [cable.rotor_inertia for cable in thesis.cables]

    def torque(angles, speeds):
        state = Hold(thesis, np.full(N, 5.0), 0.5)
        state.begin(np.full(N, 5.0))
        state.torque(0, Winches(at, np.zeros(N)))
        return state.torque(MS, Winches(angles, speeds)) - radii(thesis) * 5.0

    np.testing.assert_allclose(torque(at, np.zeros(N)), 0.0, atol=1e-15)
    paid_out = torque(at - 0.1, np.zeros(N))
    assert (paid_out > 0.0).all()  # winds in
    np.testing.assert_allclose(paid_out, 0.1 * inertia * FREQUENCY**2, rtol=1e-9)
    winding_in = torque(at, np.full(N, 0.2))
    assert (winding_in < 0.0).all()
    np.testing.assert_allclose(winding_in, -0.4 * inertia * FREQUENCY, rtol=1e-9)


def test_hold_that_does_not_see_the_winches_balances_and_sets_the_brakes_for_good(thesis):
    state = Hold(thesis, np.full(N, 5.0), 0.5)
    state.begin(np.full(N, 8.0))
    state.torque(0, REST)
    assert not state.brake
    np.testing.assert_allclose(state.torque(600 * MS, None), radii(thesis) * 5.0, rtol=1e-12)
    assert state.brake
    state.torque(601 * MS, REST)
    assert state.brake
    state.begin(None)
    assert not state.brake


def test_a_clock_that_is_set_back_does_not_take_the_ramp_back(thesis):
    state = Hold(thesis, np.full(N, 5.0), 0.5)
    state.begin(np.full(N, 10.0))
    state.torque(9000 * MS, REST)
    np.testing.assert_allclose(state.torque(9250 * MS, REST), radii(thesis) * 7.5, rtol=1e-12)
    np.testing.assert_allclose(state.torque(0, REST), radii(thesis) * 7.5, rtol=1e-12)
    np.testing.assert_allclose(state.torque(125 * MS, REST), radii(thesis) * 6.25, rtol=1e-12)


def test_hold_of_a_machine_without_bar_lets_go_softly(rig):
    state = make_safe_state(scenario(), rig)
    state.begin(np.array([20.0]))
    still = Winches(np.zeros(1), np.zeros(1))
    assert state.torque(0, still)[0] == pytest.approx(20.0 * 0.025)
    assert state.torque(250 * MS, still)[0] == pytest.approx(10.0 * 0.025)
    assert state.torque(500 * MS, still)[0] == 0.0
    # No cable is kept taut, but a drum that runs is stopped.
    assert state.torque(600 * MS, Winches(np.zeros(1), np.ones(1)))[0] < 0.0


@pytest.mark.parametrize("name", ["general", "point", "rig", "thesis"])
def test_every_machine_has_a_safe_state(request, name):
    testbed = request.getfixturevalue(name)
    state = make_safe_state(scenario(), testbed)
    n = len(testbed.cables)
    torque = state.torque(0, Winches(np.zeros(n), np.zeros(n)))
    assert torque.shape == (n,)
    assert np.isfinite(torque).all()


# What the bar does, in simulation


class Run:
    """A scenario under its controllers, with the stage that may trip; `rows` are the latest."""

    def __init__(self, name, *overrides, plant="sim"):
        bundle = bundle_of(name, *overrides)
        testbed = bundle.testbed.testbed
        self.parts = assemble(bundle.scenario, testbed, SCENARIOS, plant)
        self.plant = self.parts.plant
        self.rows = {}
        self.loop = Loop(
            self.parts, {name: self._keep(name) for name in testbed.topics}, lambda *_: None
        )
        self.stage = next(s for s in self.parts.stages if s.node == FORCE_CONTROLLER)
        stages = self.parts.stages
        self.motion = next((s for s in stages if s.node == MOTION_CONTROLLER), None)
        self.highest = np.array([cable.tension_limits[1] for cable in testbed.cables])

    def _keep(self, topic):
        def keep(log_ns, stamp_ns, row):
            self.rows[topic] = row.copy()

        return keep

    @property
    def now_ns(self):
        return self.plant.steps * self.parts.period_ns

    def go(self, count):
        """Step; return bar states and tensions on the way."""
        states, tensions = [], []
        for _ in range(count):
            self.loop.step()
            states.append(self.plant.bar_state.copy())
            tensions.append(self.plant.tensions.copy())
        return np.array(states), np.array(tensions)

    def trip(self, count):
        """Trip; return heave from there on [m], positive down, and tensions.

        Meanwhile nobody follows the motion controller, as its node finds out by itself.
        """
        before = self.plant.bar_state[2]
        self.stage.trip(self.now_ns, "test")
        for suspended in (True, False):
            if self.motion is not None:
                self.motion.suspend(suspended)
            if suspended:
                states, tensions = self.go(count)
        return states[:, 2] - before, tensions


@pytest.mark.slow
@pytest.mark.compiled
@pytest.mark.parametrize(
    ("name", "plant", "trips"),
    [("worst_case_steep", "sim", 4), ("calm", "sim", 3), ("worst_case_steep", "mujoco", 1)],
)
def test_hold_keeps_the_bar_and_a_reset_takes_it_up_again(name, plant, trips):
    """At random instants of the run: neither down nor up by 0.1 m, no cable slack or overloaded."""
    if plant == "mujoco":
        pytest.importorskip("mujoco", minversion="4.0", reason="the MuJoCo plant needs MuJoCo 4")
    run = Run(name, plant=plant)
    run.go(12_000)
    rng = np.random.default_rng(1)
    for _ in range(trips):
        run.go(int(rng.integers(2000, 4000)))
        heave, tensions = run.trip(5000)
        assert np.abs(heave).max() < 0.1
        assert tensions.min() > 0.5
        assert (tensions < run.highest).all()
        held = run.rows[TORQUE_COMMAND]
        assert run.stage.reset(run.now_ns) is None
        run.go(1)
        assert np.abs(run.rows[TORQUE_COMMAND] - held).max() < 0.01
        _, tensions = run.go(6000)
        # Wanted tensions end at the limits; the cables overshoot them a little.
        assert (tensions < 1.1 * run.highest).all()
        assert not run.stage.safe
        reference = run.parts.references["/bar/reference"].values[:3]
        assert np.abs(run.plant.bar_state[:3] - reference).max() < 0.1


@pytest.fixture(scope="module")
def sea():
    """The worst case after 12.5 s, and how far its bar sinks in 3 s under a law of torques [m]."""
    run = Run("worst_case_steep")
    run.go(12_500)
    state = run.plant.state.copy()

    def sunk(law, braked=False):
        plant = run.plant
        plant.locked = False
        plant.state[:], plant.steps = state, 12_500
        plant.locked = braked
        for _ in range(3000):
            plant.step(law(plant))
        return plant.bar_state[2] - state[2]

    return run, sunk


def safe_law(run, *, sees):
    """Return the torques of hold, with or without knowing the winches, as a law."""
    hold = make_safe_state(run.parts.scenario, run.parts.testbed)
    hold.begin(run.rows[TENSION])

    def law(plant):
        winches = Winches(plant.angles, plant.speeds) if sees else None
        return hold.torque(plant.steps * MS, winches)

    return law


@pytest.mark.compiled
def test_zero_torque_drops_the_bar_that_hold_and_brakes_keep(sea):
    run, sunk = sea

    def zero(plant):
        return np.zeros(N)

    assert sunk(zero) > 10.0
    assert abs(sunk(zero, braked=True)) < 0.1
    assert abs(sunk(safe_law(run, sees=True))) < 0.1


@pytest.mark.compiled
def test_the_balancing_torque_alone_would_lose_the_bar(sea):
    """Why hold also looks at the winches."""
    run, sunk = sea
    assert abs(sunk(safe_law(run, sees=False))) > 0.3


@pytest.mark.compiled
def test_an_overload_trips_the_run_in_which_it_happens():
    run = Run("worst_case_steep", "safety.tension_trip=8.0")
    while not run.stage.safe:
        assert run.now_ns < 30_000 * MS
        run.go(1)
    measured = run.rows[TENSION]
    assert measured.max() > 8.0
    i = int(np.argmax(measured > 8.0))
    name = run.parts.testbed.cable_names[i]
    assert run.stage.status().message.endswith(
        f": /cables/tension: {measured[i]:.1f} N in {name}, allowed: at most 8 N"
    )


@pytest.mark.compiled
def test_the_thesis_runs_need_every_torque_at_once():
    """In one period from one torque limit to the other: no slew limit below that never acts."""
    found, last = np.zeros(N), None
    run = Run("worst_case_steep")
    for _ in range(12_000):
        run.go(1)
        torque = run.rows[TORQUE_COMMAND]
        found = found if last is None else np.maximum(found, np.abs(torque - last))
        last = torque.copy()
    limits = np.array([cable.torque_limit for cable in run.parts.testbed.cables])
    assert (found <= 2.0 * limits).all()
    assert found[4:].max() == 2.0 * limits[4]
    status = run.stage.status()
    assert status.values["state"] == "running"
    assert status.values["slew_share"] == "0.000"
    assert status.values["tension_limited_share"] == "0.000"


@pytest.mark.compiled
def test_a_tripped_rig_without_bar_comes_to_rest():
    run = Run("one_winch")
    run.go(700)
    angle = run.plant.angles[0]
    run.stage.trip(run.now_ns, "test")
    run.go(3000)
    assert abs(run.plant.speeds[0]) < 0.1
    assert abs(run.plant.angles[0] - angle) < 1.0
    assert run.plant.tensions[0] < 2.0
