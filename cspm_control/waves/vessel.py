"""A vessel's motion response, read from a file of the Marine Systems Simulator (MSS).

Convention of such files: `motionRAO.amp{dof}` and `.phase{dof}` are arrays over frequency `w`
[rad/s], heading [rad] and speed; the motion in the wave a·cos(ωt) is amp·a·cos(ωt + phase); heading
is the direction of travel relative to the vessel's x axis, 0 following, π meeting; axes x forward,
y starboard, z down. The tables of the MSS supply vessel bear this out: they tend to the laws of
`small_body.py` at low frequency, and roll lags through its resonance.
The pose is that of the tables' reference point. Speed: the first in the file.
"""

from __future__ import annotations

import warnings
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import scipy

from cspm_control.waves.sea import Array, Complex
from cspm_control.waves.vessel_checks import check_physics
from cspm_msgs_py.errors import InputError

WIDEST_GAP = np.pi / 4  # rad: a table with headings farther apart says too little between them


@dataclass(frozen=True)
class VesselResponse:
    """Complex response amplitude operators at full scale.

    Attributes:
        angular_frequency: shape (n,), increasing [rad/s].
        heading: shape (m,), increasing, in [0, 2π) [rad].
        operator: shape (n, m, 6) [m/m, rad/m].
        source: where it was read from, for errors.
    """

    angular_frequency: Array
    heading: Array
    operator: Complex
    source: str

    def at(self, angular_frequency: Array, relative: Array, scale: float) -> Complex:
        """Return the response of the vessel's model to waves of unit amplitude, shape (n, 6).

        Real and imaginary parts are interpolated linearly, round the circle of headings.

        Args:
            angular_frequency: shape (n,), at the model's scale [rad/s].
            relative: direction of travel relative to the vessel's x axis, shape (n,) [rad].
            scale: full-scale length over model length. Froude's law: frequencies divide by
                its root; a wave of a metre turns a model `scale` times as far.

        Raises:
            InputError: a frequency is outside the table.
        """
        full_scale = angular_frequency / np.sqrt(scale)
        self._check_range(full_scale, scale)
        heading = np.concatenate(
            [self.heading[-1:] - 2.0 * np.pi, self.heading, self.heading[:1] + 2.0 * np.pi]
        )
        operator = np.concatenate(
            [self.operator[:, -1:], self.operator, self.operator[:, :1]], axis=1
        )
        table = scipy.interpolate.RegularGridInterpolator(
            (self.angular_frequency, heading), operator
        )
        response = table(np.stack([full_scale, np.mod(relative, 2.0 * np.pi)], axis=1))
        return np.asarray(response * np.array([1.0, 1.0, 1.0, scale, scale, scale]))

    def _check_range(self, full_scale: Array, scale: float) -> None:
        low, high = self.angular_frequency[0], self.angular_frequency[-1]
        if full_scale.min() < low or full_scale.max() > high:
            hertz = np.sqrt(scale) / (2.0 * np.pi)
            raise InputError(
                f"{self.source}: no response at {full_scale.min() * hertz:.4g} to"
                f" {full_scale.max() * hertz:.4g} Hz, allowed: a band inside {low * hertz:.4g} to"
                f" {high * hertz:.4g} Hz at scale {scale:g}"
            )


def read_vessel(path: Path) -> VesselResponse:
    """Read the motion response at the first speed of an MSS vessel file.

    Raises:
        InputError: the file is missing, no MATLAB file, or lacks a plausible `vessel.motionRAO`;
            see `check_physics`.
    """
    vessel: Any = _load(path).get("vessel")
    if not (hasattr(vessel, "headings") and hasattr(vessel, "motionRAO")):
        raise InputError(f"{path}: allowed: a struct `vessel` with `headings` and `motionRAO`")
    motion = vessel.motionRAO
    try:
        frequency = np.array(motion.w, dtype=np.float64).ravel()
        heading = np.array(vessel.headings, dtype=np.float64).ravel()
        amplitude = _table(motion.amp, len(frequency), len(heading))
        phase = _table(motion.phase, len(frequency), len(heading))
    except (AttributeError, IndexError, TypeError, ValueError):
        raise InputError(
            f"{path}: vessel.motionRAO: allowed: `w` and six arrays each in `amp` and `phase` over"
            " frequency, heading and speed"
        ) from None
    _check_table(path, frequency, heading, amplitude, phase)
    check_physics(path, frequency, heading, amplitude, phase)
    return VesselResponse(frequency, heading, amplitude * np.exp(1j * phase), str(path))


def _load(path: Path) -> dict[str, Any]:
    if not path.is_file():
        raise InputError(f"{path}: no such file, allowed: a MATLAB file of a vessel")
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            content = scipy.io.loadmat(path, squeeze_me=True, struct_as_record=False)
    except Exception as err:  # whatever the reader meets in bytes that are no MATLAB file
        reason = " ".join(str(err).split())[:80]
        raise InputError(
            f"{path}: not readable as MATLAB file ({reason}), allowed: versions up to 7"
        ) from None
    return dict(content)


def _table(cells: Any, frequencies: int, headings: int) -> Array:  # noqa: ANN401 - a MATLAB cell
    tables = [np.array(cells[dof], dtype=np.float64) for dof in range(6)]
    if any(table.shape[:2] != (frequencies, headings) for table in tables):
        raise ValueError
    return np.stack([table.reshape(frequencies, headings, -1)[:, :, 0] for table in tables], axis=2)


def _check_table(
    path: Path, frequency: Array, heading: Array, amplitude: Array, phase: Array
) -> None:
    if not (np.isfinite(amplitude).all() and np.isfinite(phase).all() and (amplitude >= 0).all()):
        raise InputError(f"{path}: vessel.motionRAO: allowed: finite phases, amplitudes ≥ 0")
    if len(frequency) < 2 or not frequency[0] >= 0 or not (np.diff(frequency) > 0).all():
        raise InputError(f"{path}: vessel.motionRAO.w: allowed: increasing rad/s")
    gaps = np.diff(np.concatenate([heading, heading[:1] + 2.0 * np.pi]))
    hint = "; these are degrees?" if 2.0 * np.pi < heading[-1] <= 360.0 else ""
    if not (heading[0] >= 0.0 and heading[-1] < 2.0 * np.pi and (gaps > 0.0).all()):
        raise InputError(f"{path}: vessel.headings: allowed: increasing rad in [0, 2π){hint}")
    if gaps.max() > WIDEST_GAP:
        raise InputError(
            f"{path}: vessel.headings: a gap of {gaps.max():.3g} rad, allowed: at most"
            f" {WIDEST_GAP:.3g} all round"
        )
