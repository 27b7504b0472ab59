"""The widest loops: their margins by python-control, and that no wider one has them."""

from itertools import product
from pathlib import Path

import control
import numpy as np
import pytest

from cspm_control.design.gains import design_widest_gains, motion_plant
from cspm_control.design.margins import grid_margins, loop_frequencies
from cspm_control.design.widest_loop import Axis, LoopRequirement, PidShape, widest_loop
from cspm_model.parameters import nominal_parameters
from cspm_msgs_py.dofs import CONTROLLED_AXES, DOFS
from cspm_msgs_py.errors import InputError
from cspm_msgs_py.testbed import load_testbed

TESTBEDS = Path(__file__).resolve().parents[3] / "scenarios" / "testbeds"
THESIS = load_testbed(TESTBEDS / "thesis.yaml").testbed.model_copy(update={"effects": ()})
PARAMETERS = nominal_parameters(THESIS)
CONTROLLED_DOFS = [DOFS[axis] for axis in CONTROLLED_AXES]
CENTRE = (0.0, 0.0, 2.0, 0.0, 0.0, 0.0)
REQUIRED = LoopRequirement(np.radians(60.0), 6.0, 20.0, 80.0)


def designed(dead_time=0.0, force_bandwidth=800.0):
    return design_widest_gains(
        THESIS,
        PARAMETERS,
        CENTRE,
        CONTROLLED_DOFS,
        dead_time=dead_time,
        force_bandwidth=force_bandwidth,
    )


@pytest.fixture(scope="module")
def plant():
    return motion_plant(THESIS, PARAMETERS, CENTRE)


@pytest.fixture(scope="module")
def gains():
    return designed()


def loop_of(plant, dof, gains):
    """Return the open loop as python-control has it."""
    output, column = DOFS.index(dof), CONTROLLED_DOFS.index(dof)
    system = control.ss(plant.A, plant.B[:, [column]], plant.C[[output]], plant.D[[output], column])
    pid = control.tf([gains.kd, gains.kp, gains.ki], [1.0, 0.0])
    frequencies = np.geomspace(1e-2, 1e4, 20_000)
    values = (pid(1j * frequencies) * system(1j * frequencies)).ravel()
    return frequencies, values


def margins_of(frequencies, values):
    """Return crossover, phase margin [°], gain margins above and below 0 dB, and bandwidth."""
    crossings = np.flatnonzero(np.diff(np.sign(np.abs(values) - 1.0)))
    phases = np.degrees(np.angle(-values[crossings]))
    real = np.flatnonzero(np.diff(np.sign(values.imag)) != 0)
    gains = 20.0 * np.log10(np.abs(values[real][values[real].real < 0.0]))
    closed = np.abs(values / (1.0 + values))
    bandwidth = frequencies[np.flatnonzero(closed < np.sqrt(0.5))[0]]
    low = gains[gains > 0.0].min(initial=np.inf)
    return frequencies[crossings[-1]], phases.min(), (-gains[gains <= 0.0]), low, bandwidth


@pytest.mark.parametrize("dof", CONTROLLED_DOFS)
def test_each_loop_uses_up_what_the_procedure_leaves(plant, gains, dof):
    _, phase, above, low, bandwidth = margins_of(*loop_of(plant, dof, gains[dof]))
    assert phase == pytest.approx(60.0, abs=0.3)
    assert low == pytest.approx(20.0, abs=0.1)
    assert above.min(initial=np.inf) >= 6.0 - 0.05
    assert bandwidth <= 80.0
    if dof in ("sway", "yaw"):
        assert above.min() == pytest.approx(6.0, abs=0.1)


def test_the_thesis_machine_has_loops_of_about_these_crossovers(plant, gains):
    found = [margins_of(*loop_of(plant, dof, gains[dof]))[0] for dof in CONTROLLED_DOFS]
    np.testing.assert_allclose(found, [37.1, 18.5, 43.0, 44.4, 18.1], rtol=0.02)


@pytest.mark.parametrize("dof", ["surge", "yaw"])
def test_no_wider_loop_keeps_the_margins(plant, gains, dof):
    """Every other place of the zeros, at a crossover five per cent higher, misses something."""
    frequencies = loop_frequencies(plant, 7.3)
    response = plant.response(frequencies)[:, DOFS.index(dof), CONTROLLED_DOFS.index(dof)]
    axis = Axis(frequencies, response)
    crossover = 1.05 * margins_of(*loop_of(plant, dof, gains[dof]))[0]
    kept = []
    for derivative, integral in product(np.geomspace(1.0, 10.0, 40), np.geomspace(2.0, 60.0, 40)):
        if integral <= derivative:
            continue
        found = axis.margins(PidShape(crossover, derivative, integral))
        tight = abs(found.low_frequency_gain - 20.0) < 0.5
        kept.append(tight and found.phase_margin > REQUIRED.phase_margin and found.gain_margin > 6)
    # A loop with all derivative action there is may be wider in surge, but has no integral action
    # to speak of; those of yaw end at the gain margin.
    assert not any(kept)


def test_dead_time_costs_crossover(plant, gains):
    late = designed(dead_time=0.01)
    for dof in CONTROLLED_DOFS:
        assert late[dof].ki < 0.5 * gains[dof].ki


def test_faster_force_loops_allow_wider_motion_loops(gains):
    slower = designed(force_bandwidth=300.0)
    for dof in CONTROLLED_DOFS:
        assert slower[dof].ki < gains[dof].ki


def test_a_shape_is_the_pid_it_says():
    frequencies = np.geomspace(0.1, 100.0, 50)
    shape = PidShape(12.0, 3.0, 40.0)
    gains = shape.gains(7.0)
    s = 1j * frequencies
    pid = gains.kp + gains.ki / s + gains.kd * s
    np.testing.assert_allclose(pid, 7.0 * shape.response(frequencies), rtol=1e-12)
    np.testing.assert_allclose(
        np.sort(np.roots([gains.kd, gains.kp, gains.ki])), [-12.0 / 3.0, -12.0 / 40.0]
    )


def test_a_double_integrator_has_the_zeros_in_closed_form():
    """1/s² has no −180° but at low frequency: only the closed loop's bandwidth ends it."""
    frequencies = np.geomspace(1e-2, 1e4, 2000)
    axis = Axis(frequencies, 1.0 / (1j * frequencies) ** 2)
    gains = widest_loop("heave", axis, REQUIRED)
    loop = (gains.kp + gains.ki / (1j * frequencies) + gains.kd * 1j * frequencies) / (
        (1j * frequencies) ** 2
    )
    found = grid_margins(frequencies, loop)
    # Phase: atan(ω_c/ω_d) − atan(ω_i/ω_c); low gain: at ω² = ω_i·ω_d, from kp and ki alone.
    at = np.sqrt(gains.ki / gains.kd)
    assert 20.0 * np.log10(gains.kp / at**2) == pytest.approx(20.0, abs=0.02)
    assert np.degrees(found.phase_margin) == pytest.approx(60.0, abs=0.2)
    assert found.bandwidth == pytest.approx(80.0, rel=5e-3)


def test_what_no_pid_can_do_is_one_line():
    frequencies = np.geomspace(1e-2, 1e4, 500)
    late = np.exp(-1j * frequencies * 20.0) / (1j * frequencies) ** 2
    with pytest.raises(InputError) as caught:
        widest_loop("sway", Axis(frequencies, late), REQUIRED)
    assert str(caught.value) == (
        "control.motion: no PID of sway has 60° and 6 dB of margins and a bandwidth of at most"
        " 80 rad/s, allowed: control.motion.gains"
    )
