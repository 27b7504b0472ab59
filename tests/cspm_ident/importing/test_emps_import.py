"""The electro-mechanical positioning system: its test-bed, and its recordings as published."""

import numpy as np
import pytest
from emps_samples import (
    DATA,
    ESTIMATION,
    MAPPING,
    PUBLISHED,
    PULSES,
    RADIUS,
    STATE,
    TESTBED,
    recorded,
)
from import_samples import imported
from scipy.io import loadmat
from scipy.signal import butter, decimate, filtfilt

from cspm_ident.importing.column_store import ColumnStore
from cspm_ident.importing.mapping import load_mapping
from cspm_ident.importing.preparation import prepare
from cspm_ident.importing.write import write_messages
from cspm_model.motion import Motion
from cspm_msgs_py.recording import Recording
from cspm_msgs_py.testbed import load_testbed
from cspm_sim.plant import Plant


def emps(tmp_path, name, mapping=None):
    """Import a recording by the library's mapping, or another text."""
    tmp_path.mkdir(exist_ok=True)
    path = tmp_path / name
    path.symlink_to(DATA / name)
    return imported(path, mapping or MAPPING.read_text(encoding="utf-8"), TESTBED)


def force_fit(found):
    """Least squares of the force balance, all columns filtered equally; see Gautier 1997.

    Returns the four parameters, and the relative force error [%] with them and as published.
    """
    position, force = found.rows[STATE].T * np.array([[RADIUS], [1.0 / RADIUS]])
    step = np.median(np.diff(found.stamps[STATE])) * 1e-9
    smooth = filtfilt(*butter(4, 0.2), position)
    speed = np.gradient(smooth, step)
    columns = [np.gradient(speed, step), speed, np.sign(speed), np.ones_like(speed), force]
    inner = np.stack([decimate(c[200:-200], 10, ftype="iir") for c in columns], axis=1)
    regressors, target = inner[:, :4], inner[:, 4]
    fitted = np.linalg.lstsq(regressors, target, rcond=None)[0]
    errors = [
        100 * np.linalg.norm(target - regressors @ parameters) / np.linalg.norm(target)
        for parameters in (fitted, PUBLISHED)
    ]
    return fitted, errors


@pytest.mark.compiled
def test_the_test_bed_is_the_published_drive():
    """With constant force the carriage gains speed by its mass, until friction takes the force."""
    testbed = load_testbed(TESTBED).testbed
    radius = testbed.cables[0].drum_radius
    plant = Plant(testbed, Motion.still(np.zeros(6)), 1_000_000)
    mass, viscous, coulomb, _ = PUBLISHED
    torque = np.array([100.0 * radius])
    for _ in range(10):
        plant.step(torque)
    assert plant.speeds[0] * radius == pytest.approx((100.0 - coulomb) / mass * 0.01, rel=0.03)
    for _ in range(6000):
        plant.step(torque)
    assert plant.speeds[0] * radius == pytest.approx((100.0 - coulomb) / viscous, rel=1e-3)


@recorded
@pytest.mark.parametrize("name", [ESTIMATION, PULSES])
def test_every_sample_is_there_as_it_was_published(tmp_path, name):
    found, raw = emps(tmp_path, name), loadmat(DATA / name, squeeze_me=True)
    assert found.topics[STATE].fields == ("position/carriage", "effort/carriage")
    assert np.array_equal(found.stamps[STATE], np.rint(raw["t"] * 1e9).astype(np.int64))
    np.testing.assert_allclose(RADIUS * found.rows[STATE][:, 0], raw["qm"], rtol=1e-15)
    force = raw["gtau"] * raw["vir"]
    np.testing.assert_allclose(found.rows[STATE][:, 1] / RADIUS, force, rtol=1e-15)
    assert found.report.topics[0].left_out.total == 0
    assert set(found.report.unused) == {"qg", "pulses_N"} & set(raw) | {"qg"}


@recorded
def test_its_oddities_are_seen(tmp_path):
    """Stamps are k ms rounded to about 40 ns; the position with pulses is on no encoder's grid."""
    estimation, pulses = emps(tmp_path, ESTIMATION), emps(tmp_path, PULSES)
    assert estimation.report.suspicions == []
    assert pulses.suspected == {(f"{STATE} position/carriage", "smoothed")}
    for found in (estimation, pulses):
        steps = np.diff(found.stamps[STATE])
        assert len(np.unique(steps)) <= 6
        assert np.abs(found.stamps[STATE] - np.arange(24841) * 1_000_000).max() <= 33


@recorded
def test_units_and_signs_give_the_published_parameters(tmp_path):
    fitted, (error, published) = force_fit(emps(tmp_path, ESTIMATION))
    np.testing.assert_allclose(fitted, PUBLISHED, rtol=0.01)
    assert error < published < 4.0834
    _, (_, held_out) = force_fit(emps(tmp_path, PULSES))
    assert held_out < 5.9824


@recorded
def test_traps_show_as_suspicions_or_as_nonsense(tmp_path):
    """A forgotten N/V, a turned sign and pulses added once more do not go unseen."""
    text = MAPPING.read_text(encoding="utf-8")
    turned = emps(tmp_path / "turned", ESTIMATION, text.replace("unit: V,", "unit: V, sign: -1,"))
    assert ("/winches/state effort/carriage", "power") in turned.suspected
    found = emps(tmp_path / "pulses", PULSES)
    raw = loadmat(DATA / PULSES, squeeze_me=True)
    found.rows[STATE][:, 1] += RADIUS * raw["gtau"] * raw["pulses_N"]
    assert force_fit(found)[1][1] > 20.0


@recorded
def test_the_recording_holds_it_all(tmp_path):
    testbed = load_testbed(TESTBED)
    with ColumnStore() as store:
        prepared = prepare(
            DATA / PULSES, load_mapping(MAPPING), testbed, store, lambda _: None, trial=False
        )
        write_messages(tmp_path / "emps", prepared.messages, {}, {}, lambda _: None)
    raw = loadmat(DATA / PULSES, squeeze_me=True)
    with Recording(tmp_path / "emps") as recording:
        assert recording.complete
        assert recording.topic(STATE).parts == ("position", "effort")
        assert np.array_equal(recording.rows(STATE).rows[:, 0], 100.0 * raw["qm"])
