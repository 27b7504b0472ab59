"""From recordings to a verdict: where the model misses, what is missing, and how well it helps."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from cspm_ident.diagnosis.columns import Candidate, Place
from cspm_ident.diagnosis.curves import Curve, held_out_curves
from cspm_ident.diagnosis.equation import Equation, in_noise
from cspm_ident.diagnosis.evidence import Evidence, gather
from cspm_ident.diagnosis.recorded import equations_of
from cspm_ident.diagnosis.refine import Cut, needs_refining, refine
from cspm_ident.diagnosis.search import Findings, Named, Search
from cspm_ident.signals.measurement import Measurement
from cspm_msgs_py.errors import InputError
from cspm_sim.effects import Effect, catalogue

Array = NDArray[np.float64]
Progress = Callable[[str], None]
Parts = Sequence[Sequence[Equation]]

BLOCKS = 24
SHORTEST_BLOCK_S = 1.0
# Of a recording that has to serve as its own held-out data.
SEARCHED_SHARE = 0.7
GAP_SHARE = 0.02
# A finding must take this share of a held-out squared residual, or it does not stand.
CONFIRMED_SHARE = 0.03


@dataclass(frozen=True)
class HeldOut:
    """One residual on data that was not searched.

    Root mean squares in its unit; of the bar's six channels together, in units of their noise.

    Attributes:
        place: which residual.
        measured: standard deviation of the measured quantity.
        before: with the file's model.
        retuned: with the file's parameters fitted to the searched data, nothing added.
        after: with what was found.
        noise: what differs from row to row.
    """

    place: Place
    measured: float
    before: float
    retuned: float
    after: float
    noise: float


@dataclass(frozen=True, eq=False)
class Diagnosis:
    """What a diagnosis found.

    Attributes:
        searched: recordings in which was looked.
        held_out: those on which it was judged; empty where the end of each searched one was.
        findings: what was found, without what did not stand on held-out data.
        rejected: what did not.
        weights: of each candidate found, with half the width of its 95 % interval.
        fit: residual by residual.
        silent: effects and elements that these recordings cannot show.
        places: the residuals that there are.
        starts: of the blocks [s], shape (blocks,).
        curves: the residuals on what was not searched, over time.
        noise: of each residual, what differs from row to row, one number per channel.
    """

    searched: Sequence[Measurement]
    held_out: Sequence[Measurement]
    findings: Findings
    rejected: tuple[Named, ...]
    weights: dict[Candidate, tuple[Array, Array]]
    fit: tuple[HeldOut, ...]
    silent: tuple[tuple[str, tuple[str, ...]], ...]
    places: tuple[Place, ...]
    starts: Array
    curves: tuple[Curve, ...]
    noise: dict[Place, Array]


def diagnose(
    searched: Sequence[Measurement],
    held_out: Sequence[Measurement] = (),
    progress: Progress = lambda _: None,
) -> Diagnosis:
    """Look for what the described machine lacks.

    Args:
        searched: recordings in which to look; all of one machine.
        held_out: others on which to judge what was found; none: the last part of each searched one.
        progress: called with what is being done.

    Raises:
        InputError: the recordings have no residual that could be looked at.
    """
    effects = list(catalogue().values())
    search_parts, judge_parts = _parts(searched, held_out, effects, progress)
    noise = _noise(search_parts)
    spans = [_span(part) for part in search_parts]
    block = max(SHORTEST_BLOCK_S, sum(b - a for a, b in spans) / BLOCKS)
    evidence = gather(in_noise(search_parts, noise), block)
    search = Search(evidence, progress)
    found = search.run()
    progress("held-out data")
    judge = gather(in_noise(judge_parts, noise), block)
    kept, rejected = _confirmed(search, judge, found)
    progress("parameters")
    candidates = [c for each in kept for c in each.hypothesis.candidates]
    weights = _weights(search, kept)
    if any(needs_refining(candidate.effect) for candidate in candidates):
        searched_part: Cut = _whole if held_out else _first
        weights = refine(searched, candidates, noise, block, searched_part)
    fit = _fit(search, kept, judge, in_noise(judge_parts, noise), noise)
    return Diagnosis(
        searched,
        held_out,
        Findings(kept, found.unknown, found.candidates),
        rejected,
        weights,
        fit,
        _silent(search, effects),
        tuple(place.place for place in evidence.places),
        evidence.times,
        held_out_curves(judge_parts, {c: w for c, (w, _) in _weights(search, kept).items()}),
        noise,
    )


def _parts(
    searched: Sequence[Measurement],
    held_out: Sequence[Measurement],
    effects: Sequence[Effect],
    progress: Progress,
) -> tuple[Parts, Parts]:
    found = [equations_of(m, effects, progress) for m in searched]
    for measurement, equations in zip(searched, found, strict=True):
        if not equations:
            raise InputError(
                f"{measurement.path}: no residual, allowed: recordings with /winches/state angle"
                " and torque, and with /cables/tension where there are cables"
            )
    if held_out:
        return found, [equations_of(m, effects, progress) for m in held_out]
    return _first(found), _last(found)


def _whole(parts: Parts) -> Parts:
    """Return what is searched where other recordings are held out."""
    return parts


def _first(parts: Sequence[Sequence[Equation]]) -> list[list[Equation]]:
    """Return what is searched where nothing else is held out."""
    return [[e.within(-np.inf, _cut(part, 0.0)) for e in part] for part in parts]


def _last(parts: Sequence[Sequence[Equation]]) -> list[list[Equation]]:
    """Return the rest, after a gap."""
    return [[e.within(_cut(part, GAP_SHARE), np.inf) for e in part] for part in parts]


def _cut(equations: Sequence[Equation], beyond: float) -> float:
    start, end = _span(equations)
    return start + (SEARCHED_SHARE + beyond) * (end - start)


def _span(equations: Sequence[Equation]) -> tuple[float, float]:
    times = [e.times for e in equations if len(e.times)]
    return min(float(t[0]) for t in times), max(float(t[-1]) for t in times)


def _noise(parts: Sequence[Sequence[Equation]]) -> dict[Place, Array]:
    """Return the noise of every residual, the median over recordings and stretches."""
    found: dict[Place, list[Array]] = {}
    for equations in parts:
        for equation in equations:
            if len(equation.times) > 8:
                found.setdefault(equation.place, []).append(equation.noise)
    return {place: np.median(noises, axis=0) for place, noises in found.items()}


def _confirmed(
    search: Search, judge: Evidence, found: Findings
) -> tuple[tuple[Named, ...], tuple[Named, ...]]:
    """Part what was found by whether it lowers a residual that was not searched."""
    kept = list(found.named)
    rejected: list[Named] = []
    for each in found.named:
        whole = _weights(search, kept)
        own = set(each.hypothesis.candidates)
        fewer = {c: w for c, w in whole.items() if c not in own}
        with_it = judge.left_with({c: w for c, (w, _) in whole.items()})
        without = judge.left_with({c: w for c, (w, _) in fewer.items()})
        shares = [1.0 - with_it[p] / without[p] for p in without if without[p] > 0.0]
        if max(shares) < CONFIRMED_SHARE:
            kept.remove(each)
            rejected.append(each)
    return tuple(kept), tuple(rejected)


def _weights(search: Search, named: Sequence[Named]) -> dict[Candidate, tuple[Array, Array]]:
    candidates = [c for each in named for c in each.hypothesis.candidates]
    columns = search.evidence.with_nuisance(candidates)
    values = search.evidence.parted(candidates, search.sums.weights(columns))
    widths = search.evidence.parted(candidates, search.sums.half_width(columns))
    return {c: (values[c], widths[c]) for c in candidates}


def _fit(
    search: Search,
    kept: Sequence[Named],
    judge: Evidence,
    equations: Sequence[Sequence[Equation]],
    noise: dict[Place, Array],
) -> tuple[HeldOut, ...]:
    after = {c: w for c, (w, _) in _weights(search, kept).items()}
    retuned = search.retuned()
    left = [judge.left_with(weights) for weights in ({}, retuned, after)]
    rows = {place.place: float(place.rows.sum()) for place in judge.places}
    out = []
    for place, count in rows.items():
        measured = np.concatenate(
            [e.measured for part in equations for e in part if e.place == place]
        )
        unit = float(noise[place][0]) if len(noise[place]) == 1 else 1.0
        before, tuned, now = (unit * float(np.sqrt(e[place] / max(count, 1.0))) for e in left)
        spread = unit * float(np.sqrt(np.mean((measured - measured.mean(axis=0)) ** 2)))
        out.append(HeldOut(place, spread, before, tuned, now, unit))
    return tuple(out)


def _silent(search: Search, effects: Sequence[Effect]) -> tuple[tuple[str, tuple[str, ...]], ...]:
    """Return effects that have no column that is not zero, with the elements."""
    heard = {(c.effect_id, c.element) for c in search.heard}
    seen = {(t.effect_id, t.element) for t in search.evidence.terms if isinstance(t, Candidate)}
    found = []
    for effect in effects:
        deaf = sorted(element for name, element in seen - heard if name == effect.id)
        if deaf or not any(name == effect.id for name, _ in seen):
            found.append((effect.id, tuple(deaf)))
    return tuple(found)
