"""The published parameters of the electro-mechanical positioning system, from its recordings."""

import numpy as np
import pytest
from emps_samples import DATA, ESTIMATION, MAPPING, PUBLISHED, PULSES, RADIUS, STATE, TESTBED
from import_samples import imported
from scipy.signal import butter, decimate, filtfilt

from cspm_ident.signals.samples import Samples
from cspm_ident.winch import WinchSignals, identify_winch, torque_error

recorded = pytest.mark.skipif(not DATA.is_dir(), reason="the EMPS recordings are not here")

EFFECTS = ("winch_viscous_friction", "winch_coulomb_friction", "winch_torque_offset")
# From kg m² and N m at the shaft to what was published; the effect's torque helps, hence the sign.
AT_CARRIAGE = np.array([RADIUS**-2, RADIUS**-2, 1.0 / RADIUS, -1.0 / RADIUS])
PUBLISHED_FORCE_ERROR = 5.9824  # %, with pulses


@pytest.fixture(scope="module")
def recordings(tmp_path_factory):
    """Both recordings as `cspm import` makes them."""
    folder = tmp_path_factory.mktemp("emps")
    return [_signals(folder, name) for name in (ESTIMATION, PULSES)]


def _signals(folder, name):
    path = folder / name
    path.symlink_to(DATA / name)
    found = imported(path, MAPPING.read_text(encoding="utf-8"), TESTBED)
    times = found.stamps[STATE] * 1e-9
    angle, torque = (Samples(times, column[:, None].copy()) for column in found.rows[STATE].T)
    return WinchSignals(angle, torque, None, RADIUS)


def force_error(signals, values):
    """Relative error [%] of the force, with the filters that were published (Gautier 1997).

    Position through a Butterworth filter of 100 Hz forwards and backwards, then all columns
    decimated by ten.
    """
    position, force = RADIUS * signals.angle.values[:, 0], signals.torque.values[:, 0] / RADIUS
    smooth = filtfilt(*butter(4, 0.2), position)
    speed = np.gradient(smooth, 1e-3)
    columns = [np.gradient(speed, 1e-3), speed, np.sign(speed), np.ones_like(speed), force]
    inner = np.stack([decimate(c[200:-200], 10, ftype="iir") for c in columns], axis=1)
    return 100 * np.linalg.norm(inner[:, 4] - inner[:, :4] @ values) / np.linalg.norm(inner[:, 4])


@recorded
@pytest.mark.parametrize("half_width", [0.01, 0.02, 0.04])
def test_published_parameters_within_one_per_cent(recordings, half_width):
    """At three widths of the window, so that none is the one that happens to fit."""
    estimation, pulses = recordings
    found = identify_winch([estimation], EFFECTS, half_width=half_width)
    values = found.estimate.values * AT_CARRIAGE
    np.testing.assert_allclose(values, PUBLISHED, rtol=0.01)
    ends = np.sort(found.estimate.ci95 * AT_CARRIAGE[:, None], axis=1)
    assert np.all((ends[:, 0] < PUBLISHED) & (ends[:, 1] > PUBLISHED))
    assert found.estimate.unexcited == ()
    assert force_error(pulses, values) <= PUBLISHED_FORCE_ERROR


@recorded
def test_whole_force_is_explained_in_the_band_of_the_publication(recordings):
    estimation, pulses = recordings
    found = identify_winch([estimation], EFFECTS).estimate
    effects = {
        "winch_viscous_friction": {"coefficient": found.values[1]},
        "winch_coulomb_friction": {"torque": found.values[2]},
        "winch_torque_offset": {"torque": found.values[3]},
    }
    assert torque_error(estimation, found.values[0], effects, 40.0).percent < 4.0834
    assert torque_error(pulses, found.values[0], effects, 40.0).percent < PUBLISHED_FORCE_ERROR


@recorded
def test_intervals_know_that_the_residual_is_coloured(recordings):
    """What friction leaves is no white noise: the published standard deviations are too short."""
    published_sd = np.array([0.1085, 1.1460, 0.1012, 0.0444])
    found = identify_winch([recordings[0]], EFFECTS).estimate
    assert np.all(found.sd * np.abs(AT_CARRIAGE) > 2.0 * published_sd)


@recorded
def test_a_turned_sign_or_a_missing_term_is_seen(recordings):
    estimation, _ = recordings
    turned = WinchSignals(
        estimation.angle,
        Samples(estimation.torque.times, -estimation.torque.values),
        None,
        RADIUS,
    )
    assert identify_winch([turned], EFFECTS).estimate.value("inertia") < 0.0
    full = identify_winch([estimation], EFFECTS).error
    for left_out in EFFECTS:
        rest = [name for name in EFFECTS if name != left_out]
        # Each term takes 0.3 percentage points or more.
        assert identify_winch([estimation], rest).error > full + 0.3
