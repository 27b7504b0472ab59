"""What sensors' noise must not look like: wrong inertia, less hysteresis than none, a torque."""

from dataclasses import replace

import numpy as np
import pytest
from run_samples import PLUCKED_IN_SURGE, run_to

from cspm_ident.block_simulation import BlockSimulation, Input
from cspm_ident.diagnosis.residuals.cable_and_bar import Suspension
from cspm_ident.diagnosis.residuals.machine_signals import machine_signals
from cspm_ident.diagnosis.residuals.recorded_equations import equations_of
from cspm_ident.diagnosis.residuals.regressors import Place
from cspm_ident.signals.measurement import read_measurement
from cspm_ident.signals.timeline import Timeline
from cspm_model.parameters import nominal_parameters
from cspm_sim.effects import Channel, catalogue
from cspm_sim.effects.signals import CableSignal

BAR = Place(Channel.WRENCH, "bar")
pytestmark = pytest.mark.slow

EFFECTS = [catalogue()["bar_inertia"]]


def recorded(folder, scenario, seconds, *overrides):
    run_to(folder, scenario, f"duration={seconds}", *overrides)
    return read_measurement(folder)


@pytest.fixture(scope="module")
def calm(tmp_path_factory):
    return recorded(tmp_path_factory.mktemp("noise") / "calm_broadband", "calm_broadband", 16)


@pytest.fixture(scope="module")
def locked(tmp_path_factory):
    return recorded(
        tmp_path_factory.mktemp("noise") / "locked", "verification_mid", 16, PLUCKED_IN_SURGE
    )


@pytest.fixture(scope="module")
def equations(calm):
    return equations_of(calm, EFFECTS)


def columns_of(equations, place, name):
    return next(
        columns
        for equation in equations
        if equation.place == place
        for term, columns in equation.columns.items()
        if term.effect_id == name
    )


def test_an_acceleration_that_neither_poses_nor_tensions_show_is_none(equations, locked):
    """A bar that only swings does not turn about its length; both sensors see noise."""
    reported = columns_of(equations, BAR, "bar_inertia")
    without = columns_of(equations_of(locked, EFFECTS), BAR, "bar_inertia")
    assert np.ptp(reported[:, :, 1:], axis=(0, 1)).min() > 0.0
    assert not without[:, :, 2].any()


def test_elongations_of_columns_do_not_have_the_poses_noise(calm):
    """The residual has it; a column with it would show less hysteresis than none."""
    (signals,) = machine_signals(Timeline(calm))
    machine, parameters = calm.machine, nominal_parameters(calm.machine)
    here = Suspension(signals, machine, parameters)
    noise = 2e-4 * np.random.default_rng(3).standard_normal(signals.bar.poses.shape)
    noisy = signals.with_pose_change("bar", noise, 1.0)
    there = Suspension(noisy, machine, parameters, here.start)
    for i in range(len(machine.cables)):
        apart = (there.cable_rows(i) - here.cable_rows(i))[:, CableSignal.ELONGATION]
        assert np.std(apart) < 0.01 * 2e-4


def test_a_lost_reading_is_no_torque(calm):
    """Nobody knows it; a shaft simulated across it takes a speed that it never had."""
    short = calm.within(4.0, 6.0)
    torque = short.torque
    kept = np.delete(np.arange(len(torque.times)), 700)
    torn = replace(short, torque=type(torque)(torque.times[kept], torque.values[kept]))
    lost = torque.times[700]
    line, whole = Timeline(torn), Timeline(short)
    assert np.isfinite(whole.torques[:-1]).all()
    empty = line.times[np.isnan(line.torques).any(axis=1) & (line.times < lost + 0.1)]
    assert empty[0] < lost < empty[-1]
    assert empty[-1] - empty[0] < 0.03
    simulation = BlockSimulation(line, torn.machine)
    for start, end in simulation.windows(Input.SHAFT, 0.5):
        assert line.times[end] <= lost or line.times[start] >= lost
