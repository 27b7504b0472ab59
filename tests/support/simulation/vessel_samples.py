"""Vessel files for tests: made of the law of a small body, or of any response."""

from pathlib import Path

import numpy as np
from scipy.io import savemat

from cspm_control.waves.sea import wave_number
from cspm_control.waves.small_body import small_body_response

SUPPLY = Path(__file__).resolve().parents[4] / "shared" / "data" / "vessel_rao" / "supply.mat"
GRAVITY = 9.81
HEADINGS = np.radians(np.arange(0, 360, 10))


def mss(frequency, heading, operator, speeds=3):
    """Return the content of a vessel file; only its first speed holds `operator` (n, m, 6)."""
    amp, phase = np.empty((1, 6), dtype=object), np.empty((1, 6), dtype=object)
    for dof in range(6):
        shape = (len(frequency), len(heading), speeds)
        amp[0, dof], phase[0, dof] = np.zeros(shape), np.zeros(shape)
        amp[0, dof][:, :, 0] = np.abs(operator[:, :, dof])
        phase[0, dof][:, :, 0] = np.angle(operator[:, :, dof]) + 4 * np.pi
    return {"headings": heading, "motionRAO": {"amp": amp, "phase": phase, "w": frequency}}


def written(tmp_path, vessel):
    path = tmp_path / "vessel.mat"
    savemat(path, {"vessel": vessel})
    return path


def small_body_vessel(frequency):
    number = wave_number(frequency, GRAVITY)
    rows = [small_body_response(HEADINGS, np.full(len(HEADINGS), k)) for k in number]
    return mss(frequency, HEADINGS, np.array(rows))
