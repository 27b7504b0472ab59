"""Effects with memory begin settled where a recording is simulated from its middle."""

from dataclasses import replace

import numpy as np
import pytest
from run_samples import bundle_of

from cspm_ident.block_simulation import BlockSimulation, Input
from cspm_ident.comparison.compare import compare
from cspm_ident.signals.measurement import read_measurement
from cspm_ident.signals.timeline import Timeline
from cspm_msgs_py.testbed import parse_testbed
from cspm_run.recorded_run import run

CREEP = """  - effect: cable_creep
    elements: [hoist_1, hoist_2]
    parameters: {compliance: 2.0e-4, time_constant: 5.0}
  - effect: frame_flexibility
    parameters: {frequency: 8.0, damping: 0.1, compliance: 1.0e-5}
  - effect: winch_torque_lag
    elements: [surge_1]
    parameters: {time_constant: 0.01}
"""


def recorded(place, effects=""):
    """Hanging still for two seconds, so that everything has settled there."""
    bundle = bundle_of("verification_mid", "duration=5")
    testbed = parse_testbed(bundle.testbed.text + effects, "recorded")
    assert not run(replace(bundle, testbed=testbed), place).failure
    return read_measurement(place)


@pytest.fixture(scope="module")
def measurement(tmp_path_factory):
    return recorded(tmp_path_factory.mktemp("memory") / "bag", CREEP)


@pytest.fixture(scope="module")
def simulation(measurement):
    return BlockSimulation(Timeline(measurement), measurement.machine)


def test_memory_is_what_it_is_at_rest_under_the_measured_tensions(simulation):
    step = 1500
    memory = simulation.state_at(step)[12 + 3 * 8 :]
    tensions = simulation.timeline.smooth_tensions[step]
    np.testing.assert_allclose(memory[:4:2], 2e-4 * tensions[:2], rtol=1e-9)
    np.testing.assert_allclose(memory[1:4:2], 1.0 / simulation.state_at(step)[12:14], rtol=1e-9)
    weight = simulation.testbed.bar.mass * simulation.testbed.gravity
    np.testing.assert_allclose(memory[4:7], [0, 0, 1e-5 * weight], atol=1e-6 * weight)
    assert not memory[7:].any()


def test_a_drive_that_reports_its_torque_lags_no_second_time(simulation):
    assert [e.effect for e in simulation.testbed.effects] == [
        "bar_linear_damping",
        "cable_creep",
        "frame_flexibility",
    ]


@pytest.mark.slow
def test_settled_memory_leaves_no_transient(measurement, tmp_path):
    found = compare(measurement).channels
    for channel in (each for each in found if each.name.startswith("cables/tension")):
        assert channel.rms < 1.5 * channel.floor, (channel.block, channel.name)
    # Five seconds hold too few swings of a bar to know their floor: the same noise leaves as much
    # where nothing has a memory.
    without = compare(recorded(tmp_path / "bag")).channels
    for channel, bare in zip(found, without, strict=True):
        assert channel.rms < 1.05 * bare.rms, (channel.block, channel.name)


def test_no_memory_at_the_start_would_show(simulation):
    window = simulation.windows(Input.CABLE, None)[0]
    settled = simulation.run(Input.CABLE, [window]).tensions[window[0] :, 0]
    kept, state_at = simulation.offsets(window), simulation.state_at

    def blank(step):
        state = state_at(step)
        state[12 + 3 * 8 :] = 0.0
        return state

    simulation.state_at = blank
    try:
        emptied = simulation.run(Input.CABLE, [window], kept).tensions[window[0] :, 0]
    finally:
        del simulation.state_at
    # A creep of 2e-4 m/N under 8 N at 3 kN/m.
    assert np.abs(emptied - settled).max() > 1.0
