"""All winches of some recordings identified one by one, and judged on others."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from cspm_ident.estimation.objection import Objection, error_objections, sign_objections
from cspm_ident.recording_roles import check_roles
from cspm_ident.signals.jumps import jumps, without_jumps
from cspm_ident.signals.measurement import Measurement
from cspm_ident.signals.prediction_noise import prediction_noise
from cspm_ident.signals.samples import Samples
from cspm_ident.winch.identification import INERTIA, WinchFit, identify_winch
from cspm_ident.winch.identified_winch import (
    DESCRIBED,
    FITTED,
    IdentifiedWinch,
    WinchesResult,
    WinchJudgement,
    is_one_signed,
)
from cspm_ident.winch.lateness import at_age, fit_beside_lateness, lateness_of
from cspm_ident.winch.motion_source import (
    MotionSource,
    motion_source,
    speed_agrees,
)
from cspm_ident.winch.parsimony import without_unseen
from cspm_ident.winch.reconstruction import TorqueError, torque_error
from cspm_ident.winch.recording import WinchSignals, winch_signals
from cspm_msgs_py.errors import InputError
from cspm_msgs_py.testbed import EffectEntry, Testbed
from cspm_sim.effects import Effect, catalogue
from cspm_sim.effects.effect import Channel

EFFECTS = ("winch_viscous_friction", "winch_coulomb_friction", "winch_torque_offset")
BAND_HZ = 40.0
Equation = tuple[float, dict[str, dict[str, float]]]
Progress = Callable[[str], None]
# Standard deviations of an encoder's noise within which a shaft counts as resting.
_STANDING_NOISES = 3.0
_SIGN_REMEDY = (
    "check the signs of torque and angle, which of them comes late, and what the winch carries"
)


@dataclass(frozen=True)
class _Way:
    """How each winch is identified; see `identify_winches`."""

    effects: Sequence[str]
    torque_age: float
    lateness: bool
    reversals: bool | None
    band: float


def identify_winches(
    searched: Sequence[Measurement],
    names: Sequence[str] = (),
    effects: Sequence[str] = EFFECTS,
    *,
    held_out: Sequence[Measurement] = (),
    torque_age: float = 0.0,
    lateness: bool = False,
    reversals: bool | None = None,
    band: float = BAND_HZ,
    progress: Progress = lambda _: None,
) -> WinchesResult:
    """Fit inertia and effects of winches, each by itself, and predict the torque of recordings.

    Jumps of an encoder are left out; see `jumps`. Accelerations are taken from the drive's speed
    where the angle is too noisy for them; see `motion_source`.

    Args:
        searched: to fit, at least one, all of one machine.
        names: of the winches' cables; none for all that move.
        effects: ids from the catalogue, see `identify_winch`.
        held_out: to judge only.
        torque_age: see `WinchSignals` [s].
        lateness: whether to look for another torque age, and to take it into account.
        reversals: see `identify_winch`; None leaves them out wherever that loses no parameter.
        band: in which torque errors are counted [Hz].
        progress: called with what is being done.

    Raises:
        InputError: recordings that do not go together, a band that is none, no winch that moves, or
            see `winch_signals` and `identify_winch`.
    """
    check_roles(searched, held_out)
    if not band > 0.0:
        raise InputError(f"--band {band:g}: allowed: a frequency above 0 Hz")
    way = _Way(tuple(effects), torque_age, lateness, reversals, band)
    every = searched[0].machine.cable_names
    resting = () if names else tuple(name for name in every if _is_at_rest(searched, name))
    if resting == every:
        raise InputError(
            f"{searched[0].path}: no winch moves by more than its encoder's noise, allowed:"
            " recordings in which one does"
        )
    found = []
    for name in names or [name for name in every if name not in resting]:
        progress(name)
        found.append(_identified(name, searched, held_out, way))
    return WinchesResult(tuple(found), tuple(searched), band, torque_age, resting)


def _is_at_rest(searched: Sequence[Measurement], name: str) -> bool:
    """Return whether a winch's angle is recorded and moves no more than its noise."""
    index = searched[0].machine.cable_names.index(name)
    angles = [m.angle.column(index) for m in searched if m.angle is not None]
    return bool(angles) and all(
        float(np.std(each.values)) <= _STANDING_NOISES * np.sqrt(prediction_noise(each))
        for each in angles
    )


def _identified(
    name: str, searched: Sequence[Measurement], held_out: Sequence[Measurement], way: _Way
) -> IdentifiedWinch:
    recordings = (*searched, *held_out)
    known = tuple(_beside(searched[0].machine, name, way.effects))
    raw = [winch_signals(each, name, way.torque_age) for each in recordings]
    raw = [replace(each, load=(*each.load, *known)) for each in raw]
    signals = [replace(each, angle=without_jumps(each.angle)) for each in raw]
    own = signals[: len(searched)]
    reversals = _reversals(own, way)
    source = motion_source(own, _speeds(searched, own, name), way.effects, reversals=reversals)
    late = lateness_of(source.signals, way.effects, reversals=reversals) if way.lateness else None
    if late is not None:
        source = source._replace(signals=at_age(source.signals, late.age))
    # What a simulated drive reports is known to half a period.
    beside = late is not None or (way.lateness and way.torque_age == 0.0)
    described = described_equation(searched[0].machine, name, way.effects)
    fit = without_unseen(
        _fit(source, way.effects, beside=beside, reversals=reversals),
        way.effects,
        _by_name(described),
        partial(_fit, source, beside=beside, reversals=reversals),
    )
    equations = {DESCRIBED: described, FITTED: fitted_equation(fit, way.effects)}
    age = way.torque_age if late is None else late.age
    others = signals[len(searched) :]
    if source.signals[0].speed is not None:
        speeds = _speeds(held_out, others, name)
        others = [replace(each, speed=own) for each, own in zip(others, speeds, strict=True)]
    judged = at_age([*source.signals, *others], age)
    judgements = tuple(
        WinchJudgement(each, i >= len(searched), _errors(own, equations, way.band))
        for i, (each, own) in enumerate(zip(recordings, judged, strict=True))
    )
    return IdentifiedWinch(
        name,
        raw[0].radius,
        _by_name(described),
        fit,
        _otherwise(source, way.effects, beside=beside, reversals=not reversals),
        judgements,
        reversals,
        _objections(fit, source, judgements),
        late,
        tuple(
            (each.path, tuple(s.angle.times[jumps(s.angle)].tolist()))
            for each, s in zip(recordings, raw, strict=True)
            if len(jumps(s.angle))
        ),
        source.signals[0].speed is not None,
    )


def _beside(
    machine: Testbed, name: str, fitted: Sequence[str]
) -> Iterator[tuple[Effect, dict[str, float]]]:
    """Yield what the test-bed file has at a winch's shaft beside inertia and fitted effects."""
    for entry in machine.effects:
        effect = catalogue()[entry.effect]
        here = not entry.elements or name in entry.elements
        physics, channel = effect.physics, effect.signature.regression.channel
        adds = channel is Channel.SHAFT and physics.sense is None and physics.alter is None
        if here and adds and entry.effect not in fitted:
            yield effect, dict(entry.numbers)


def _speeds(
    recordings: Sequence[Measurement], signals: Sequence[WinchSignals], name: str
) -> list[Samples | None]:
    """Return the speeds that drives report, where they are the angles' derivatives.

    There may be no recording, as where none is held out.
    """
    found: list[Samples | None] = []
    for each, own in zip(recordings, signals, strict=True):
        index = each.machine.cable_names.index(name)
        speed = None if each.speed is None else each.speed.column(index)
        found.append(speed if speed is not None and speed_agrees(own.angle, speed) else None)
    return found


def _reversals(signals: Sequence[WinchSignals], way: _Way) -> bool:
    """Return whether windows with a reversal count: by default only if a parameter needs them.

    Dry friction sticks there, and then holds what no law of the speed says.
    """
    if way.reversals is not None:
        return way.reversals
    try:
        without = identify_winch(signals, way.effects, reversals=False)
    except InputError:
        # A shaft that never keeps one direction for a window.
        return True
    all_windows = identify_winch(signals, way.effects)
    return len(without.estimate.unexcited) > len(all_windows.estimate.unexcited)


def _fit(
    source: MotionSource, effects: Sequence[str], *, beside: bool, reversals: bool
) -> WinchFit:
    """Return the fit; the inertia's interval reaches as far as noise may have made it too small.

    With `beside`, all intervals hold that the torque's age is known to a period only.
    """
    fitted = fit_beside_lateness if beside else identify_winch
    fit = fitted(source.signals, effects, reversals=reversals)
    ends = fit.estimate.ci95.copy()
    if source.shows_acceleration:
        ends[0, 1] += source.noise_share / (1.0 - source.noise_share) * abs(fit.estimate.values[0])
    return fit._replace(estimate=replace(fit.estimate, ci95=ends))


def _otherwise(
    source: MotionSource, effects: Sequence[str], *, beside: bool, reversals: bool
) -> WinchFit | None:
    try:
        return _fit(source, effects, beside=beside, reversals=reversals)
    except InputError:
        return None


def _objections(
    fit: WinchFit,
    source: MotionSource,
    judgements: Sequence[WinchJudgement],
) -> tuple[Objection, ...]:
    """Return why parameters of a winch are no result."""
    frictions = set(filter(is_one_signed, fit.estimate.names))
    always = {INERTIA} if source.shows_acceleration else set()
    found = sign_objections(fit.estimate, always, frictions - {INERTIA}, _SIGN_REMEDY)
    if not source.shows_acceleration:
        found = [_noise_objection(source), *found]
    errors = [
        (each.measurement.path.name, each.errors[FITTED].percent)
        for each in judgements
        if not each.held_out
    ]
    return (*found, *error_objections(fit.estimate, errors, "torque"))


def _noise_objection(source: MotionSource) -> Objection:
    share, stamps, step = source.noise_share, 1e3 * source.stamp_error, 1e3 * source.interval
    return Objection(
        (INERTIA,),
        f"{100.0 * share:.0f} % of what would be its accelerations is noise of the angle, as stamps"
        f" that scatter by {stamps:.2g} ms at {step:.3g} ms make it",
        "record stamps of the instant of measurement, or the drive's speed",
    )


def described_equation(machine: Testbed, name: str, effects: Sequence[str]) -> Equation:
    """Return a winch's inertia [kg·m²] and its effects' parameters, as the test-bed file has them.

    Effects that are in several entries add up, those that are in none do nothing.
    """
    inertia = next(cable.rotor_inertia for cable in machine.cables if cable.name == name)
    inertia += sum(e.numbers["inertia"] for e in _acting(machine, name, "winch_inertia"))
    values = {}
    for effect in effects:
        parameters = catalogue()[effect].parameters
        total = {p.name: p.absent or 0.0 for p in parameters}
        for entry in _acting(machine, name, effect):
            for p in parameters:
                total[p.name] += entry.numbers[p.name] - (p.absent or 0.0)
        values[effect] = total
    return inertia, values


def _acting(machine: Testbed, name: str, effect: str) -> list[EffectEntry]:
    """Return the entries of an effect that act on a winch."""
    here = [e for e in machine.effects if not e.elements or name in e.elements]
    return [entry for entry in here if entry.effect == effect]


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
