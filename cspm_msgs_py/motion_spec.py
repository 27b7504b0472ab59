"""The key `motion:` of a scenario: how a body's prescribed motion comes about.

Every motion is a displacement from the body's mean pose, coordinate by coordinate: x, y, z [m]
along world_ned (z down) and roll, pitch, yaw [rad]. Directions of waves are directions of travel,
measured from the world's x axis (surge) towards y (sway): 0 follows, π meets a body that faces x.
"""

from __future__ import annotations

from fractions import Fraction
from itertools import pairwise
from math import pi
from typing import Annotated, Literal

from pydantic import (
    Field,
    NonNegativeFloat,
    PositiveFloat,
    field_validator,
    model_validator,
)
from typing_extensions import Self

from cspm_msgs_py.dofs import DOFS
from cspm_msgs_py.scenario_keys.curves import (
    CircleMotion,
    HelixMotion,
    LemniscateMotion,
    LineMotion,
    SinesMotion,
    WaypointsMotion,
)
from cspm_msgs_py.yaml_file import StrictModel

Six = tuple[float, float, float, float, float, float]
HIGHEST_FREQUENCY = 25.0  # Hz: Nyquist of knots 0.02 s apart, the coarsest in use
TIME_GRID = 0.001  # s: moves start and end on it


class StillMotion(StrictModel):
    """The body rests at its mean pose."""

    type: Literal["still"] = "still"


class Sea(StrictModel):
    """What all motions made by waves have in common.

    Attributes:
        peak_period: period of the spectrum's peak [s].
        peak_enhancement: γ of the JONSWAP spectrum.
        heading: mean direction of travel [rad], see the module.
        spreading: s of the directional spreading cos^2s((direction - heading)/2); 0 is all round,
            large is long-crested. Standard deviation about √(2/(1 + s)) rad.
        band: lowest and highest frequency of the waves [Hz].
        period: after this time the motion repeats [s]; all frequencies are multiples of 1/period.
        ramp: the motion grows from rest during the first `ramp` seconds [s]; 0 for none. With a
            ramp it is not periodic, and lasts as long as the scenario.
        position: x, y of the body in the sea [m]; shifts the phase of every wave.
    """

    peak_period: PositiveFloat
    peak_enhancement: float = Field(default=3.3, ge=1.0, le=20.0)
    heading: float = Field(default=0.0, ge=-2 * pi, le=2 * pi)
    spreading: float = Field(default=15.0, ge=0.0, le=10_000.0)
    band: tuple[float, float]
    period: float = Field(gt=0.0, le=10_800.0)
    ramp: NonNegativeFloat = 0.0
    position: tuple[float, float] = (0.0, 0.0)

    @field_validator("band")
    @classmethod
    def _ordered(cls, band: tuple[float, float]) -> tuple[float, float]:
        if not 0.0 < band[0] < band[1] <= HIGHEST_FREQUENCY:
            raise ValueError(
                f"[{band[0]:g}, {band[1]:g}] Hz, allowed: 0 < lowest < highest ≤"
                f" {HIGHEST_FREQUENCY:g}"
            )
        return band

    @model_validator(mode="after")
    def _holds_waves(self) -> Self:
        low, high, period = (Fraction(repr(v)) for v in (*self.band, self.period))
        if (high - low) * period < 1:
            raise ValueError(
                f"period: {self.period:g} s is too short for waves in the band {self.band[0]:g} to"
                f" {self.band[1]:g} Hz, allowed: at least {1 / (self.band[1] - self.band[0]):g} s"
            )
        return self


class JonswapMotion(Sea):
    """A body that follows a JONSWAP sea, each coordinate scaled to a given excursion.

    Every coordinate has the shape of the sea's spectrum within the band.

    Attributes:
        amplitudes: largest absolute excursion of x, y, z [m], roll, pitch, yaw [rad] over one
            period, before any ramp.
    """

    type: Literal["jonswap"] = "jonswap"
    amplitudes: Six

    @field_validator("amplitudes")
    @classmethod
    def _plausible(cls, amplitudes: Six) -> Six:
        limits = (float("inf"),) * 3 + (pi / 2, pi / 2, pi)
        for name, value, limit in zip(DOFS, amplitudes, limits, strict=True):
            if not 0.0 <= value < limit:
                allowed = "≥ 0 m" if limit > pi else f"0 ≤ amplitude < {limit:.4f} rad"
                raise ValueError(f"{name} {value:g}, allowed: {allowed}")
        return amplitudes


class VesselMotion(Sea):
    """A vessel's motion: its response amplitude operators times a JONSWAP sea.

    Attributes:
        significant_wave_height: Hs of the whole spectrum, at the model's scale [m]. Waves outside
            `band` are left out.
        rao: MATLAB file in the format of the Marine Systems Simulator, relative to the scenario's
            folder.
        scale: full-scale length over model length. By Froude's law the vessel's lengths are
            divided by it, its frequencies multiplied by its root; angles stay.
    """

    type: Literal["vessel"] = "vessel"
    significant_wave_height: PositiveFloat
    rao: str = Field(min_length=1)
    scale: PositiveFloat = 1.0


class FileMotion(StrictModel):
    """A recorded motion, read from a CSV file with the header `t,x,y,z,roll,pitch,yaw`.

    Attributes:
        path: the file, relative to the scenario's folder.
        rate: knots per second [Hz]; absent: as many as the file's shortest time step requires.
    """

    type: Literal["file"] = "file"
    path: str = Field(min_length=1)
    rate: float | None = Field(default=None, gt=0.0, le=10_000.0)


class Move(StrictModel):
    """One displacement along the minimum-jerk profile 10s³ - 15s⁴ + 6s⁵, from rest to rest.

    Attributes:
        at: start [s].
        duration: length [s].
        by: displacement of x, y, z [m], roll, pitch, yaw [rad].
    """

    at: NonNegativeFloat
    duration: PositiveFloat
    by: Six

    @field_validator("at", "duration")
    @classmethod
    def _on_grid(cls, time: float) -> float:
        steps = time / TIME_GRID
        if abs(steps - round(steps)) > 1e-6:
            raise ValueError(f"{time:g} s, allowed: a multiple of {TIME_GRID:g} s")
        return time

    @property
    def end(self) -> float:
        """Instant at which the move is complete [s]."""
        return self.at + self.duration


class MovesMotion(StrictModel):
    """A sequence of moves with rests between them; the body stays where the last one ends."""

    type: Literal["moves"] = "moves"
    moves: tuple[Move, ...] = Field(min_length=1)

    @field_validator("moves")
    @classmethod
    def _one_after_another(cls, moves: tuple[Move, ...]) -> tuple[Move, ...]:
        for index, (first, second) in enumerate(pairwise(moves)):
            if second.at < first.end - 1e-9:
                raise ValueError(
                    f"[{index + 1}] starts at {second.at:g} s, allowed: at or after the end of"
                    f" [{index}], {first.end:g} s"
                )
        return moves


MotionSpec = Annotated[
    StillMotion
    | JonswapMotion
    | VesselMotion
    | FileMotion
    | MovesMotion
    | LineMotion
    | CircleMotion
    | LemniscateMotion
    | HelixMotion
    | SinesMotion
    | WaypointsMotion,
    Field(discriminator="type"),
]
