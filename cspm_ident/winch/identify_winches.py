"""All winches of some recordings identified one by one, and judged on others."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

from cspm_ident.recording_roles import check_roles
from cspm_ident.signals.measurement import Measurement
from cspm_ident.winch.identification import INERTIA, WinchFit, identify_winch
from cspm_ident.winch.reconstruction import TorqueError, torque_error
from cspm_ident.winch.recording import WinchSignals, winch_signals
from cspm_msgs_py.errors import InputError
from cspm_msgs_py.testbed import Testbed
from cspm_sim.effects import catalogue

EFFECTS = ("winch_viscous_friction", "winch_coulomb_friction", "winch_torque_offset")
BAND_HZ = 40.0
DESCRIBED, FITTED = "described", "fitted"
Equation = tuple[float, dict[str, dict[str, float]]]
Progress = Callable[[str], None]


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
    """

    name: str
    radius: float
    described: dict[str, float]
    fit: WinchFit
    otherwise: WinchFit | None
    judgements: tuple[WinchJudgement, ...]

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
        }


@dataclass(frozen=True, eq=False)
class WinchesResult:
    """Winches of one machine.

    Attributes:
        winches: in the order requested.
        searched: recordings that were fitted.
        band: in which the torque errors are counted [Hz].
        torque_age: see `WinchSignals` [s].
        reversals: whether windows counted in which the shaft reverses.
    """

    winches: tuple[IdentifiedWinch, ...]
    searched: tuple[Measurement, ...]
    band: float
    torque_age: float
    reversals: bool

    def data(self) -> dict[str, Any]:
        """Return everything as plain data for JSON."""
        return {
            "recordings": [{"path": str(m.path), "sha256": m.sha256} for m in self.searched],
            "band_hz": self.band,
            "torque_age_s": self.torque_age,
            "reversals": self.reversals,
            "winches": [winch.data() for winch in self.winches],
        }


def identify_winches(
    searched: Sequence[Measurement],
    names: Sequence[str] = (),
    effects: Sequence[str] = EFFECTS,
    *,
    held_out: Sequence[Measurement] = (),
    torque_age: float = 0.0,
    reversals: bool = True,
    band: float = BAND_HZ,
    progress: Progress = lambda _: None,
) -> WinchesResult:
    """Fit inertia and effects of winches, each by itself, and predict the torque of recordings.

    Args:
        searched: to fit, at least one, all of one machine.
        names: of the winches' cables; none for all.
        effects: ids from the catalogue, see `identify_winch`.
        held_out: to judge only.
        torque_age: see `WinchSignals` [s].
        reversals: see `identify_winch`.
        band: in which torque errors are counted [Hz].
        progress: called with what is being done.

    Raises:
        InputError: recordings that do not go together, a band that is none, or see `winch_signals`
            and `identify_winch`.
    """
    check_roles(searched, held_out)
    if not band > 0.0:
        raise InputError(f"--band {band:g}: allowed: a frequency above 0 Hz")
    found = []
    for name in names or searched[0].machine.cable_names:
        progress(name)
        signals = [winch_signals(each, name, torque_age) for each in (*searched, *held_out)]
        fit = identify_winch(signals[: len(searched)], effects, reversals=reversals)
        otherwise = _otherwise(signals[: len(searched)], effects, not reversals)
        described = described_equation(searched[0].machine, name, effects)
        equations = {DESCRIBED: described, FITTED: fitted_equation(fit, effects)}
        judgements = tuple(
            WinchJudgement(measurement, i >= len(searched), _errors(each, equations, band))
            for i, (measurement, each) in enumerate(
                zip((*searched, *held_out), signals, strict=True)
            )
        )
        found.append(
            IdentifiedWinch(
                name, signals[0].radius, _by_name(described), fit, otherwise, judgements
            )
        )
    return WinchesResult(tuple(found), tuple(searched), band, torque_age, reversals)


def _otherwise(
    signals: Sequence[WinchSignals], effects: Sequence[str], reversals: bool
) -> WinchFit | None:
    try:
        return identify_winch(signals, effects, reversals=reversals)
    except InputError:
        # A shaft that never keeps one direction for a window.
        return None


def described_equation(machine: Testbed, name: str, effects: Sequence[str]) -> Equation:
    """Return a winch's inertia [kg·m²] and its effects' parameters, as the test-bed file has them.

    Effects that stand in several entries add up, those that stand in none do nothing.
    """
    inertia = next(cable.rotor_inertia for cable in machine.cables if cable.name == name)
    values = {}
    for effect in effects:
        parameters = catalogue()[effect].parameters
        total = {p.name: p.absent or 0.0 for p in parameters}
        for entry in machine.effects:
            if entry.effect == effect and (not entry.elements or name in entry.elements):
                for p in parameters:
                    total[p.name] += entry.parameters[p.name] - (p.absent or 0.0)
        values[effect] = total
    return inertia, values


def fitted_equation(fit: WinchFit, effects: Sequence[str]) -> Equation:
    """Return the same as the fit found it."""
    values = {
        effect: {
            p.name: fit.estimate.value(f"{effect} {p.name}") for p in catalogue()[effect].parameters
        }
        for effect in effects
    }
    return fit.estimate.value(INERTIA), values


def _errors(
    signals: WinchSignals, equations: dict[str, Equation], band: float
) -> dict[str, TorqueError]:
    return {
        label: torque_error(signals, inertia, effects, band)
        for label, (inertia, effects) in equations.items()
    }


def _by_name(equation: Equation) -> dict[str, float]:
    inertia, effects = equation
    named = {f"{e} {name}": v for e, values in effects.items() for name, v in values.items()}
    return {INERTIA: inertia, **named}
