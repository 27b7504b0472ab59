"""Effects with memory, and those in cables and drums, against closed forms."""

import numpy as np
import pytest
from creep_samples import LENGTH_M, MS, STILL, line, stiffness_of
from machines import WINCH, build, entry

from cspm_model.motion import Motion
from cspm_sim.effects import catalogue
from cspm_sim.effects.signals import CableSignal, FrameSignal, WinchSignal
from cspm_sim.plant import Plant


def bench(effects=(), **winch):
    """One winch without cable."""
    only = {"name": "w", **WINCH, "rotor_inertia": 1e-3, **winch}
    return build({"name": "bench", "cables": [only], "effects": list(effects)})


def heaving(samples, period):
    """The winch frame along z after a periodic path; derivatives from its Fourier series."""
    n = len(samples)
    line_of = np.fft.rfft(samples)
    omega = 2j * np.pi * np.fft.rfftfreq(n, period / n)
    knots = np.zeros((n, 18))
    for k in range(3):
        knots[:, 6 * k + 2] = np.fft.irfft(line_of * omega**k, n)
    return Motion(knots, period / n, True)


def swing(amplitude, period):
    """The exit to and fro by an amplitude [m]."""
    return heaving(-amplitude * np.sin(2 * np.pi * np.arange(256) / 256), period)


def locked_run(machine, motion, seconds, tension=20.0, period_ns=MS):
    """Lengths and tensions of the only cable, its winch locked, and the plant."""
    plant = Plant(machine, motion, period_ns, tensions=[tension], locked=True)
    out = []
    for _ in range(round(seconds * 1e9 / period_ns) + 1):
        out.append((plant.lengths[0], plant.tensions[0]))
        plant.step(np.zeros(1))
    return *np.array(out).T, plant


def work(lengths, tensions):
    """∫ t dl [J] by trapezia."""
    return float(np.sum(0.5 * (tensions[1:] + tensions[:-1]) * np.diff(lengths)))


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_a_lagging_drive_answers_a_step_exponentially(side):
    plant = Plant(bench([entry("winch_torque_lag", time_constant=0.02)]), STILL, MS)
    wanted = np.array([side * 0.5])
    for _ in range(50):
        plant.step(wanted)
    share = 1.0 - np.exp(-0.05 / 0.02)
    # Runge-Kutta's own error per step, (h/T)⁵/120, is below 3e-9.
    assert plant.applied_torque(wanted)[0] == pytest.approx(side * 0.5 * share, rel=1e-6)
    speed = side * 0.5 / 1e-3 * (0.05 - 0.02 * share)
    assert plant.speeds[0] == pytest.approx(speed, rel=1e-6)


def test_a_lagging_drive_lags_behind_its_limit_not_behind_the_command():
    machine = bench([entry("winch_torque_lag", time_constant=0.02)], torque_limit=0.3)
    plant = Plant(machine, STILL, MS)
    for _ in range(500):
        plant.step(np.array([5.0]))
    assert plant.applied_torque(np.array([5.0]))[0] == pytest.approx(0.3, rel=1e-9)


def test_a_lagging_drive_begins_with_the_torque_that_holds():
    machine = line([entry("winch_torque_lag", time_constant=0.05)])
    plant = Plant(machine, STILL, MS, tensions=[20.0])
    hold = np.array([20.0 * 0.025])
    assert plant.applied_torque(np.zeros(1)) == pytest.approx(hold, rel=1e-12)
    for _ in range(200):
        plant.step(hold)
    assert plant.speeds[0] == pytest.approx(0.0, abs=1e-9)


def test_lag_columns_are_commanded_less_reported_torque():
    plant = Plant(bench([entry("winch_torque_lag", time_constant=0.03)]), STILL, MS)
    reported, commanded = [], []
    for k in range(400):
        command = np.array([0.4 * np.sin(2 * np.pi * 3.0 * k * 1e-3)])
        reported.append(plant.applied_torque(command)[0])
        commanded.append(command[0])
        plant.step(command)
    signals = np.zeros((400, len(WinchSignal)))
    signals[:, WinchSignal.TORQUE_RATE] = np.gradient(reported, 1e-3)
    model = (catalogue()["winch_torque_lag"].regressors(signals) @ [0.03])[:, 0]
    left = np.array(commanded) - reported
    # The command is held for a step, which shifts it by half of one: 0.5 ms of 30.
    assert model[5:-5] == pytest.approx(left[5:-5], abs=0.03 * np.abs(left).max())


def creep_machine():
    return line([entry("cable_creep", compliance=2e-3, time_constant=0.5)])


def test_a_cable_at_rest_has_crept_already():
    _, tensions, plant = locked_run(creep_machine(), STILL, 1.0)
    assert tensions == pytest.approx(20.0, abs=1e-8)
    assert plant.state[-2] == pytest.approx(2e-3 * 20.0, rel=1e-9)


@pytest.mark.parametrize("shortened", [0.004, -0.004])
def test_creep_after_a_step_is_the_standard_solid(shortened):
    """t = k(ε − e), T·ė = C·t − e: e approaches Ckε/(1 + Ck) with the time constant T/(1 + Ck)."""
    machine = creep_machine()
    plant = Plant(machine, STILL, MS, tensions=[20.0], locked=True)
    begin = plant.unstretched_lengths[0]
    plant.unstretched_lengths[:] -= shortened
    k = stiffness_of(machine, plant.unstretched_lengths[0])
    stretch = LENGTH_M - plant.unstretched_lengths[0]
    share = plant.unstretched_lengths[0] / begin
    ck = 2e-3 * k * share
    final = ck * stretch / (1.0 + ck)
    for steps in (0, 100, 400):
        for _ in range(steps):
            plant.step(np.zeros(1))
        plant._observe()
        crept = final + (2e-3 * 20.0 * share - final) * np.exp(-plant.time * (1.0 + ck) / 0.5)
        assert plant.tensions[0] == pytest.approx(k * (stretch - crept), rel=1e-6)


@pytest.mark.parametrize(("speed", "tension"), [(2.0, 20.0), (-2.0, 300.0)])
def test_wound_cable_takes_its_creep_with_it(speed, tension):
    """Quick creep makes a cable softer by a share that does not depend on its length."""
    effect = entry("cable_creep", compliance=2e-3, time_constant=0.01)
    machine = line([effect])
    plant = Plant(machine, STILL, MS, tensions=[tension], locked=True)
    begin = plant.unstretched_lengths[0]
    plant.speeds[:] = speed
    for _ in range(1000):
        plant.step(np.zeros(1))
    plant.speeds[:] = 0.0
    for _ in range(300):
        plant.step(np.zeros(1))
    plant._observe()
    length = plant.unstretched_lengths[0]
    assert abs(length / begin - 1.0) > 0.01
    k = stiffness_of(machine, length)
    crept = 2e-3 * length / begin
    assert plant.tensions[0] == pytest.approx(k * (LENGTH_M - length) / (1.0 + k * crept), rel=1e-6)


@pytest.mark.compiled
@pytest.mark.parametrize("period", [0.25, 2.0])
def test_a_hysteresis_loop_has_the_area_of_dahls_at_any_rate(period):
    """Steady loop between ±A: ∮ F dε = 4·force·(A − x·tanh(A/x))."""
    amplitude, force, x = 0.002, 1.5, 0.001
    machine = line([entry("cable_hysteresis", force=force, displacement=x)])
    period_ns = round(period / 2000 * 1e9)
    lengths, tensions, _ = locked_run(
        machine, swing(amplitude, period), 3 * period, period_ns=period_ns
    )
    found = work(lengths[-2001:], tensions[-2001:])
    area = 4.0 * force * (amplitude - x * np.tanh(amplitude / x))
    # Trapezia and the reversal within a step: some 1e-3 of the loop.
    assert found == pytest.approx(area, rel=5e-3)


@pytest.mark.compiled
@pytest.mark.parametrize(
    ("effect", "parameters"),
    [
        ("cable_hysteresis", {"force": 1.0, "displacement": 5e-4}),
        ("cable_creep", {"compliance": 1e-3, "time_constant": 0.1}),
        ("frame_flexibility", {"frequency": 8.0, "damping": 0.2, "compliance": 1e-4}),
    ],
)
@pytest.mark.parametrize("seed", range(2))
def test_what_gives_way_takes_energy_in_any_cycle(effect, parameters, seed):
    rng = np.random.default_rng(seed)
    line_of = np.zeros(129, dtype=complex)
    line_of[1:9] = rng.normal(size=8) + 1j * rng.normal(size=8)
    path = np.fft.irfft(line_of, 256)
    motion = heaving(0.003 * path / np.abs(path).max(), 1.0)
    lengths, tensions, _ = locked_run(line([entry(effect, **parameters)]), motion, 5.0)
    assert tensions.min() > 0.0
    # The frame's own path does the work, not that of the exit, which rings on it.
    moved = np.array([-motion.at(1e-3 * k)[2] for k in range(len(lengths))])
    assert work(moved[-1001:], tensions[-1001:]) > 1e-5


def test_the_nominal_cable_gives_all_back():
    """The other side of the test above."""
    lengths, tensions, _ = locked_run(line(), swing(0.003, 1.0), 3.0)
    assert abs(work(lengths[-1001:], tensions[-1001:])) < 1e-6


def slack_line(width):
    plant = Plant(line([entry("winch_backlash", width=width)]), STILL, MS)
    plant.unstretched_lengths[:] += 0.5
    return plant


def turn(plant, speed, angle):
    """Turn the motor by an angle at constant speed; no torque is needed, the cable is slack."""
    plant.speeds[:] = speed
    for _ in range(round(abs(angle / speed) * 1e3)):
        plant.step(np.zeros(1))
    return plant.unstretched_lengths[0]


def test_backlash_is_dead_travel_of_its_width_while_the_cable_is_slack():
    plant = slack_line(0.2)
    begin = plant.unstretched_lengths[0]
    assert turn(plant, -1.0, 0.19) == pytest.approx(begin, abs=1e-12)
    paid_out = turn(plant, -1.0, 0.31) - begin
    # 0.5 rad in all, of which 0.3 move the drum; (l0/l) of what is wound is unstretched.
    assert paid_out == pytest.approx(begin * np.expm1(0.025 * 0.3 / LENGTH_M), rel=1e-2)
    there = plant.unstretched_lengths[0]
    assert turn(plant, 1.0, 0.19) == pytest.approx(there, abs=0.025 * 0.002)
    wound = turn(plant, 1.0, 0.21) - there
    assert wound == pytest.approx(there * np.expm1(-0.025 * 0.2 / LENGTH_M), rel=1e-2)


def test_a_taut_cable_shows_no_backlash():
    plants = [
        Plant(line(effects), STILL, MS, tensions=[20.0])
        for effects in ([], [entry("winch_backlash", width=0.2)])
    ]
    for k in range(1000):
        for plant in plants:
            plant.step(np.array([0.5 + 0.2 * np.sin(0.02 * k)]))
    assert plants[0].tensions[0] > 5.0
    assert (plants[1].state[:-1] == plants[0].state).all()
    assert plants[1].state[-1] == 0.0


def test_a_cable_that_becomes_taut_takes_up_the_play():
    plant = slack_line(0.2)
    turn(plant, -1.0, 0.3)
    assert plant.state[-1] == pytest.approx(0.2, abs=1e-6)
    plant.unstretched_lengths[:] = LENGTH_M - 0.006
    plant.locked = True
    taut = plant.unstretched_lengths[0]
    for _ in range(40):
        plant.step(np.zeros(1))
    assert plant.state[-1] == pytest.approx(0.0, abs=1e-3)
    # The drum pays out what it turned.
    assert plant.unstretched_lengths[0] - taut == pytest.approx(0.025 * 0.2, rel=1e-2)
    assert plant.tensions[0] > 0.0


def test_an_eccentric_drum_winds_after_its_angle():
    """d ln l0 = −(r + e·cos(q/n + φ))/(n·l)·dq, integrated in closed form."""
    machine = line(
        [entry("winch_drum_eccentricity", eccentricity=0.004, phase=0.7)], gear_ratio=3.0
    )
    plant = Plant(machine, STILL, MS)
    plant.unstretched_lengths[:] += 1.0
    begin = plant.unstretched_lengths[0]
    for angle in (4.0, 9.0):
        turn(plant, 10.0, angle - plant.angles[0])
        drum = plant.angles[0] / 3.0
        wound = 0.025 * drum + 0.004 * (np.sin(drum + 0.7) - np.sin(0.7))
        expected = begin * np.exp(-wound / LENGTH_M)
        assert plant.unstretched_lengths[0] == pytest.approx(expected, rel=1e-9)


@pytest.mark.parametrize(("coefficient", "wrap"), [(0.1, np.pi / 2), (0.2, np.pi)])
def test_pulley_friction_is_the_capstan_equation(coefficient, wrap):
    """At 20 N the winch turns beyond r·t·e^{μφ} and below r·t·e^{−μφ}, and rests between."""
    machine = line([entry("pulley_friction", coefficient=coefficient, wrap=wrap)])
    ratio = np.exp(coefficient * wrap)
    for torque, moves in [
        (0.5 * ratio * 1.01, 1),
        (0.5 * ratio * 0.99, 0),
        (0.5 / ratio * 1.01, 0),
        (0.5 / ratio * 0.99, -1),
    ]:
        plant = Plant(machine, STILL, MS, tensions=[20.0])
        for _ in range(20):
            plant.step(np.array([torque]))
        assert np.sign(plant.angles[0]) * (abs(plant.angles[0]) > 1e-6) == moves


def flexible(damping):
    return line([entry("frame_flexibility", frequency=4.0, damping=damping, compliance=2e-5)])


def test_a_flexible_frame_rests_where_the_cable_draws_it():
    plant = Plant(flexible(0.1), STILL, MS, tensions=[20.0], locked=True)
    # The cable runs down from the exit, and draws it down.
    assert plant.state[-6:] == pytest.approx([0, 0, 20.0 * 2e-5, 0, 0, 0], abs=1e-15)
    assert plant.lengths[0] == pytest.approx(LENGTH_M - 20.0 * 2e-5, rel=1e-9)
    for _ in range(200):
        plant.step(np.zeros(1))
    assert plant.tensions[0] == pytest.approx(20.0, abs=1e-6)


@pytest.mark.parametrize("damping", [0.0, 0.1])
def test_a_plucked_frame_rings_with_its_frequency_on_the_cable(damping):
    """d̈ + 2ζω·ḋ + ω²(1 + C·k)·d = 0 about the rest."""
    machine = flexible(damping)
    plant = Plant(machine, STILL, MS, tensions=[20.0], locked=True)
    k = stiffness_of(machine, plant.unstretched_lengths[0])
    plant.state[-4] += 1e-4
    omega = 2 * np.pi * 4.0
    decay = damping * omega
    ringing = np.sqrt(omega**2 * (1 + 2e-5 * k) - decay**2)
    for _ in range(300):
        plant.step(np.zeros(1))
        time = plant.time
        expected = np.exp(-decay * time) * (
            np.cos(ringing * time) + decay / ringing * np.sin(ringing * time)
        )
        assert (plant.state[-4] - 20.0 * 2e-5) / 1e-4 == pytest.approx(expected, abs=1e-5)


def signals_of_cable(lengths, tensions, plant, angles=None):
    """What a recording of the linear cable says, its winch locked where no angles are given."""
    machine, row = plant.testbed, np.zeros((len(lengths), len(CableSignal)))
    row[:, CableSignal.TIME] = plant.period_ns * 1e-9 * np.arange(len(lengths))
    row[:, CableSignal.LENGTH], row[:, CableSignal.TENSION] = lengths, tensions
    row[:, CableSignal.ELONGATION] = lengths - plant.unstretched_lengths[0]
    row[:, CableSignal.STIFFNESS] = stiffness_of(machine, plant.unstretched_lengths[0])
    row[:, CableSignal.WOUND] = plant.unstretched_lengths[0] / lengths
    return row


def rested(signals, seconds=0.5):
    """The same after some time at rest."""
    before = np.repeat(signals[:1], round(seconds / 1e-3), axis=0)
    before[:, CableSignal.TIME] += 1e-3 * np.arange(-len(before), 0)
    return np.vstack([before, signals])


def left_over(signals):
    """Tension less that of the linear law, from the first sample on."""
    law = signals[:, CableSignal.STIFFNESS] * signals[:, CableSignal.ELONGATION]
    left = signals[:, CableSignal.TENSION] - law
    return left - left[0]


@pytest.mark.parametrize(
    ("effect", "parameters"),
    [
        ("cable_hysteresis", {"force": 1.0, "displacement": 1e-3}),
        ("cable_creep", {"compliance": 1e-3, "time_constant": 0.3, "initial_deficit": 0.0}),
    ],
)
def test_columns_of_a_cable_with_memory_are_what_its_law_leaves_over(effect, parameters):
    machine = line([entry(effect, **parameters)])
    signals = rested(signals_of_cable(*locked_run(machine, swing(0.002, 0.4), 1.2)))
    found = catalogue()[effect]
    point = {name: parameters[name] for name in found.signature.nonlinear}
    model = (found.regressors(signals, **point) @ found.weights(parameters))[:, 0]
    left = left_over(signals)
    assert np.abs(left).max() > 0.1
    # Straight lines between samples of 1 ms in a cycle of 400.
    assert model - model[0] == pytest.approx(left, abs=5e-3 * np.abs(left).max())


def test_a_rope_that_is_fresh_at_the_start_stretches_from_then_on():
    values = {"compliance": 1e-7, "time_constant": 0.8, "initial_deficit": 2e-3}
    signals = signals_of_cable(*locked_run(line([entry("cable_creep", **values)]), STILL, 1.2))
    found = catalogue()["cable_creep"]
    model = (found.regressors(signals, time_constant=0.8) @ found.weights(values))[:, 0]
    left = left_over(signals)
    assert left[-1] < -0.1
    assert model - model[0] == pytest.approx(left, abs=5e-3 * np.abs(left).max())


def test_one_wrong_tension_at_the_beginning_is_no_creep():
    """It would be forgotten within a time constant, and look like creep that long."""
    signals = rested(signals_of_cable(*locked_run(line(), swing(0.002, 2.0), 4.0)))
    regressors = catalogue()["cable_creep"].regressors
    clean = regressors(signals, time_constant=3.0)[:, 0, 0]
    signals[0, CableSignal.TENSION] += 2.0
    assert regressors(signals, time_constant=3.0)[1:, 0, 0] == pytest.approx(
        clean[1:], abs=2e-3 * np.abs(clean).max()
    )


def test_columns_of_a_flexible_frame_are_what_the_law_leaves_over():
    parameters = {"frequency": 6.0, "damping": 0.05, "compliance": 2e-4}
    machine = line([entry("frame_flexibility", **parameters)])
    motion = swing(0.003, 0.4)
    _, tensions, plant = locked_run(machine, motion, 1.2)
    moved = [motion.at(1e-3 * k)[2] for k in range(len(tensions))]
    signals = np.zeros((len(tensions), FrameSignal.STIFFNESS + 1))
    signals[:, FrameSignal.TIME] = 1e-3 * np.arange(len(tensions))
    signals[:, FrameSignal.DIRECTION + 2] = 1.0
    signals[:, FrameSignal.FORCE + 2] = tensions
    signals[:, FrameSignal.STIFFNESS] = stiffness_of(machine, plant.unstretched_lengths[0])
    found = catalogue()["frame_flexibility"]
    point = {name: parameters[name] for name in found.signature.nonlinear}
    model = (found.regressors(signals, **point) @ found.weights(parameters))[:, 0]
    # The length as measured: from the frame as it is measured, without its giving way.
    law = signals[:, FrameSignal.STIFFNESS] * (LENGTH_M - np.array(moved))
    left = tensions - law
    assert np.abs(left - left[0]).max() > 0.2
    assert model == pytest.approx(left - left[0], abs=5e-3 * np.abs(left - left[0]).max())


def test_columns_of_backlash_are_the_length_that_the_drum_does_not_follow():
    """Kinematics of a slack cable, at a stiffness of one: what the drum's lead winds too much."""
    plant = slack_line(0.2)
    begin, angles, lengths = plant.unstretched_lengths[0], [0.0], [0.0]
    for speed in (-1.0, 1.0, -1.0):
        plant.speeds[:] = speed
        for _ in range(300):
            plant.step(np.zeros(1))
            angles.append(plant.angles[0])
            lengths.append(np.log(plant.unstretched_lengths[0] / begin) * LENGTH_M)
    signals = np.zeros((len(angles), len(CableSignal)))
    signals[:, CableSignal.ANGLE], signals[:, CableSignal.RADIUS] = angles, 0.025
    signals[:, CableSignal.STIFFNESS] = signals[:, CableSignal.WOUND] = 1.0
    column = catalogue()["winch_backlash"].regressors(signals, width=0.2)[:, 0, 0]
    # A longer elongation is a shorter unstretched length than the motor's angle says.
    extra = -0.025 * np.array(angles) - np.array(lengths)
    assert np.abs(extra).max() == pytest.approx(0.025 * 0.2, rel=1e-2)
    # The flank is met within a few steps, here of 1 mrad each.
    assert 0.2 * column == pytest.approx(extra, abs=0.025 * 2e-3)
