"""A bar that follows what is measured of its target."""

from pathlib import Path

import numpy as np
import pytest
from loops import Listener
from run_samples import bundle_of, recorded

from cspm_model.kernels.rotation import euler_from_quaternion
from cspm_msgs_py.errors import InputError
from cspm_msgs_py.schedule import BAR_REFERENCE, TARGET_POSE, TARGET_REFERENCE
from cspm_run.assembly import assemble
from cspm_run.bundle import make_bundle
from cspm_run.recorded_run import run
from cspm_run.resim import resimulate

NAME = "calm_measured_target"
PRESCRIBED, IDEAL = "target.source=prescribed", "sensors=ideal"
# A moderate swell that is there from the start, in heave alone.
SWELL = (
    "target.motion={type: moves, moves: [{at: 0.5, duration: 2.0, by: [0, 0, 0.1, 0, 0, 0]}]}",
)
STEPS = 2500


def heard(*overrides, **changes):
    """Listen to a run whose sensor of the target is changed."""
    bundle = bundle_of(NAME, "duration=4", *SWELL, *overrides)
    sensor = bundle.testbed.testbed.sensors[TARGET_POSE].model_copy(update=changes)
    return Listener(bundle, {TARGET_POSE: sensor}).run(STEPS)


def coordinates(rows):
    angles = [euler_from_quaternion(row[3:7]) for row in rows]
    return np.hstack([rows[:, :3], np.array(angles)])


def test_without_noise_and_delay_it_is_the_prescribed_one_within_the_filters_error():
    measured, prescribed = heard(IDEAL), heard(IDEAL, PRESCRIBED)
    found, wanted = (coordinates(each.rows(BAR_REFERENCE)) for each in (measured, prescribed))
    wrong = np.abs(found - wanted)
    # Largest jerk 60·0.1 m/2³ s³ = 0.75 m/s³ over the bandwidth's third power, 12 µm.
    assert wrong[:, 2].max() == pytest.approx(0.75 / 40.0**3, rel=0.3)
    assert wrong[:, [0, 1, 3, 4, 5]].max() < 1e-9
    truth = measured.rows("/truth/target/pose")
    np.testing.assert_allclose(measured.rows(TARGET_REFERENCE)[:, :7], truth, rtol=0.0, atol=1e-15)
    # The bar's is above it by its offset.
    np.testing.assert_allclose(truth[:, 2] - 0.2, wanted[:, 2], atol=1e-12)


@pytest.mark.parametrize("late_ms", [0, 50])
def test_a_late_pose_lags(late_ms):
    late = heard(delay=late_ms * 1e-3, noise=(0.0, 0.0))
    wanted = coordinates(heard(IDEAL, PRESCRIBED).rows(BAR_REFERENCE))[:, 2]
    found = coordinates(late.rows(BAR_REFERENCE))[:, 2]
    # The first reference comes with the first pose.
    found = np.concatenate([np.full(late_ms, found[0]), found])

    def missed(lag_ms):
        return np.abs(found[1000:2000] - wanted[1000 - lag_ms : 2000 - lag_ms]).max()

    assert min(range(-100, 101), key=missed) == late_ms


def test_noise_reaches_the_torque():
    def spread(size):
        bundle = bundle_of(NAME, "duration=4")
        quiet = {
            name: sensor.model_copy(update={"noise": tuple(0.0 for _ in sensor.noise)})
            for name, sensor in bundle.testbed.testbed.sensors.items()
        }
        quiet[TARGET_POSE] = quiet[TARGET_POSE].model_copy(update={"noise": (size, 0.0)})
        rows = Listener(bundle, quiet).run(1000).rows("/winches/torque_command")
        return np.diff(rows, axis=0)[200:].std()

    silent, usual, loud = (spread(size) for size in (0.0, 5e-6, 5e-5))
    assert usual > 2 * silent
    assert loud == pytest.approx(10 * usual, rel=0.3)


def test_the_target_is_repeated_from_its_recording(tmp_path):
    run(bundle_of(NAME), tmp_path / "kept", steps=300)
    assert resimulate(tmp_path / "kept", lambda now, total: None).difference is None
    assert {TARGET_POSE, TARGET_REFERENCE, "/truth/target/twist"} <= set(
        recorded(tmp_path / "kept")
    )


def test_the_summary_counts_errors_from_the_reference_that_was_sent():
    result = run(bundle_of(NAME, "duration=1"), None)
    assert result.controlled
    assert (result.statistics.max_error[[0, 1, 2, 4, 5]] < 0.01).all()
    assert (result.statistics.max_error > 0.0).all()


def test_a_target_that_no_sensor_sees_is_refused():
    bundle = bundle_of("calm", "target.source=measured")
    with pytest.raises(InputError) as caught:
        assemble(bundle.scenario, bundle.testbed.testbed, Path())
    assert str(caught.value) == (
        "target.source: measured without sensor /target/pose, allowed: prescribed, or a test-bed"
        " with a bar and /target/pose among its sensors"
    )


def test_a_driver_in_lockstep_is_refused():
    bundle = bundle_of(NAME, "target.source=external")
    with pytest.raises(InputError) as caught:
        assemble(bundle.scenario, bundle.testbed.testbed, Path())
    assert str(caught.value) == (
        "target.source: external, /target/pose of a driver, in lockstep, allowed: mode realtime,"
        " or source measured"
    )


def test_its_machine_differs_by_that_sensor_alone():
    ours, others = (bundle_of(name).testbed.testbed for name in (NAME, "calm"))
    sensors = {name: each for name, each in ours.sensors.items() if name != TARGET_POSE}
    assert ours.model_copy(update={"name": others.name, "sensors": sensors}) == others


def test_the_key_survives_a_bundle():
    bundle = bundle_of(NAME)
    again = make_bundle(bundle.scenario, bundle.testbed, Path())
    assert again.scenario.target == bundle.scenario.target
