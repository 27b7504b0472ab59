"""What was identified of winches, and how well it predicts recordings."""

from __future__ import annotations

from dataclasses import dataclass
from math import isfinite
from pathlib import Path
from typing import Any

from cspm_ident.estimation.objection import Objection
from cspm_ident.signals.measurement import Measurement
from cspm_ident.winch.identification import INERTIA, WinchFit
from cspm_ident.winch.lateness import Lateness
from cspm_ident.winch.reconstruction import TorqueError
from cspm_sim.effects import catalogue
from cspm_sim.effects.effect import EffectParameter

# The equations that judgements are of.
DESCRIBED, FITTED = "described", "fitted"


def parameter_of(name: str) -> EffectParameter:
    """Return the catalogue's parameter of "effect parameter"."""
    effect, _, parameter = name.partition(" ")
    return next(each for each in catalogue()[effect].parameters if each.name == parameter)


def absent_value(name: str) -> float:
    """Return the value of "effect parameter" at which the effect does nothing."""
    return parameter_of(name).absent or 0.0


def is_one_signed(name: str) -> bool:
    """Return whether a parameter cannot be below 0: the inertia, or a friction's."""
    return name == INERTIA or parameter_of(name).minimum >= 0.0


@dataclass(frozen=True, eq=False)
class WinchJudgement:
    """A recording's torque beside what equations say of it.

    Attributes:
        measurement: the recording.
        held_out: whether nothing was fitted to it.
        errors: by equation, `described` and `fitted`; in one band.
    """

    measurement: Measurement
    held_out: bool
    errors: dict[str, TorqueError]

    def data(self) -> dict[str, Any]:
        """Return the figures as plain data for JSON."""
        errors = {label: found.percent for label, found in self.errors.items()}
        path = str(self.measurement.path)
        return {"recording": path, "held_out": self.held_out, "torque_error_percent": errors}


@dataclass(frozen=True, eq=False)
class IdentifiedWinch:
    """One winch.

    Attributes:
        name: of its cable.
        radius: drum radius / gear ratio [m].
        described: the parameters as the test-bed file has them, by the estimate's names.
        fit: values with intervals.
        otherwise: the same with the windows across reversals left out, or, where `fit` did without
            them, with them; None where that leaves no window.
        judgements: searched recordings first, then those held out.
        reversals: whether windows counted in which the shaft reverses.
        objections: why parameters are no result.
        lateness: of the torque, which was taken into account; None where its stamps agree.
        jumps: times at which the angle's reading jumps, by recording [s]; left out.
        from_speed: whether accelerations are those of the drive's speed, not the angle's.
    """

    name: str
    radius: float
    described: dict[str, float]
    fit: WinchFit
    otherwise: WinchFit | None
    judgements: tuple[WinchJudgement, ...]
    reversals: bool = True
    objections: tuple[Objection, ...] = ()
    lateness: Lateness | None = None
    jumps: tuple[tuple[Path, tuple[float, ...]], ...] = ()
    from_speed: bool = False

    @property
    def valid(self) -> tuple[str, ...]:
        """Parameters that are excited and to which there is no objection."""
        refused = {name for each in self.objections for name in each.parameters}
        estimate = self.fit.estimate
        return tuple(
            name
            for name in estimate.names
            if name not in refused and all(map(isfinite, estimate.interval(name)))
        )

    @property
    def unseen(self) -> tuple[str, ...]:
        """Valid parameters of effects whose interval holds the value at which they do nothing."""
        estimate = self.fit.estimate
        ends = {name: estimate.interval(name) for name in self.valid if name != INERTIA}
        return tuple(
            name for name, (low, high) in ends.items() if low <= absent_value(name) <= high
        )

    @property
    def one_signed(self) -> tuple[str, ...]:
        """Parameters that cannot be below 0, such as those of friction."""
        return tuple(name for name in self.fit.estimate.names if is_one_signed(name))

    @property
    def torn(self) -> tuple[str, ...]:
        """Parameters for which the windows across reversals differ significantly."""
        if self.otherwise is None:
            return ()
        pair = self.fit.estimate, self.otherwise.estimate
        return tuple(
            name
            for name in pair[0].names
            if max(each.interval(name)[0] for each in pair)
            > min(each.interval(name)[1] for each in pair)
        )

    def data(self) -> dict[str, Any]:
        """Return everything as plain data for JSON."""
        return {
            "name": self.name,
            "radius_m": self.radius,
            "described": self.described,
            "estimate": self.fit.estimate.data(),
            "otherwise": None if self.otherwise is None else self.otherwise.estimate.data(),
            "weak_form_error_percent": self.fit.error,
            "judgements": [each.data() for each in self.judgements],
            "reversals": self.reversals,
            "valid": list(self.valid),
            "objections": [each.data() for each in self.objections],
            "torque_lateness": None if self.lateness is None else self.lateness._asdict(),
            "jumps": [{"recording": str(path), "at_s": list(at)} for path, at in self.jumps],
            "acceleration_from": "speed" if self.from_speed else "angle",
        }


@dataclass(frozen=True, eq=False)
class WinchesResult:
    """Winches of one machine.

    Attributes:
        winches: in the order requested.
        searched: recordings that were fitted.
        band: in which the torque errors are counted [Hz].
        torque_age: see `WinchSignals` [s].
        standing: winches that never move, of which nothing can be identified.
    """

    winches: tuple[IdentifiedWinch, ...]
    searched: tuple[Measurement, ...]
    band: float
    torque_age: float
    standing: tuple[str, ...] = ()

    @property
    def objections(self) -> tuple[str, ...]:
        """Why numbers of some winches are no result, in words."""
        return tuple(f"{w.name}: {each.text}" for w in self.winches for each in w.objections)

    def data(self) -> dict[str, Any]:
        """Return everything as plain data for JSON."""
        return {
            "recordings": [{"path": str(m.path), "sha256": m.sha256} for m in self.searched],
            "band_hz": self.band,
            "torque_age_s": self.torque_age,
            "standing": list(self.standing),
            "winches": [winch.data() for winch in self.winches],
        }
