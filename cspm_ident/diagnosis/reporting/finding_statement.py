"""What a diagnosis says of one finding, in sentences that a person can act on."""

from __future__ import annotations

from collections.abc import Sequence

from cspm_ident.diagnosis.diagnose import Diagnosis
from cspm_ident.diagnosis.regression.hypothesis import Named, members_of
from cspm_ident.diagnosis.reporting.machine_part import Kind, kind_of
from cspm_ident.diagnosis.reporting.quantity import amount_words
from cspm_ident.diagnosis.reporting.statement import Number, channel_of, numbers_of
from cspm_ident.diagnosis.residuals.regressors import Candidate
from cspm_ident.diagnosis.selection.onset import Onset
from cspm_ident.diagnosis.selection.region import Region
from cspm_ident.diagnosis.validation.holdout_residuals import HeldOut
from cspm_ident.diagnosis.validation.holdout_simulation import Worth
from cspm_sim.effects import Block, Effect, Elements

_DOUBT = (
    " Doubtful: beside it is much that nothing in the catalogue explains, of which this may be a"
    " part, so that its numbers have no interval."
)
_FAINT = " What was not searched moves so little that it shows little of it."
# Of the noise from row to row: windows overlap, and leave a sound machine 1.4 times as much.
_AT_NOISE = 1.5
# What is left apart from where shafts turn round is told where it is so much less.
_AWAY = 0.8


def statement_of(diagnosis: Diagnosis, k: int) -> str:
    """Return the k-th finding: what has what, how much, since when, where, and what it is worth."""
    named, detail = diagnosis.findings.named[k], diagnosis.details[k]
    effect = named.hypothesis.effect
    doubt = _FAINT if detail.faint else ""
    doubt += _DOUBT if diagnosis.findings.is_doubtful(named) else ""
    where = f" It shows where {region_words(detail.region)}." if detail.region is not None else ""
    return (
        f"{_subject(effect, named.hypothesis.elements)} {_difference(effect)}:"
        f" {_sizes(diagnosis, named)}.{_since(named, detail.onset)}{_elsewhere(diagnosis, named)}"
        f" {_worth(diagnosis, named, detail.worth)}{where}{doubt}"
    )


def _subject(effect: Effect, elements: Sequence[str]) -> str:
    """Return whose fault it is, and that it has something."""
    many = len(elements) > 1
    verb = "have" if many else "has"
    if effect.acts_on is Elements.CELLS:
        return "All load cells have"
    kind = kind_of(effect)
    listed = " and ".join(", ".join(elements).rsplit(", ", 1))
    if kind is Kind.BODY:
        return f"The {listed.replace('_', ' ')} {verb}"
    if kind is Kind.MARKERS:
        return f"The motion capture of {listed.replace('_', ' ')} has"
    words = {Kind.WINCH: "winches"}.get(kind, f"{kind.value}s") if many else kind.value
    return f"{words.capitalize()} {listed} {verb}"


def _difference(effect: Effect) -> str:
    if effect.physics.alter is not None:
        return f"another {effect.words} than the test-bed file says"
    return f"{effect.words} that the model does not have"


def _sizes(diagnosis: Diagnosis, named: Named) -> str:
    """Return the parameters of every element, once where all have the same."""
    members = members_of(diagnosis.weights, named.hypothesis)
    told = {c.element: _size(diagnosis, c) for c in members}
    if len(set(told.values())) == 1:
        return next(iter(told.values()))
    return "; ".join(f"{element} {size}" for element, size in told.items())


def _size(diagnosis: Diagnosis, candidate: Candidate) -> str:
    """Return the parameters of one element, of those searched on a grid only where all are.

    Of several those that may as well be nothing are listed without a number.
    """
    effect, numbers = candidate.effect, numbers_of(diagnosis, candidate)
    known = [n for n in numbers if n.low < n.high] or numbers
    if all(n.is_open for n in known):
        told = ", ".join(f"{_name(effect, n)} {amount_words(n.value, n.unit)}" for n in known)
        return f"{told}, too few data for an interval"
    sure = [n for n in known if not _may_be_absent(effect, n)] or known
    told = ", ".join(
        f"{_name(effect, n)} {amount_words(n.value, n.unit, (n.low, n.high))}" for n in sure
    )
    rest = ", ".join(n.name for n in known if n not in sure)
    return f"{told}, {rest} not surely" if rest else told


def _may_be_absent(effect: Effect, number: Number) -> bool:
    """Return whether a parameter's interval holds the value at which it does nothing."""
    (absent,) = (p.absent for p in effect.parameters if p.name == number.name)
    return absent is not None and number.low <= absent <= number.high


def _name(effect: Effect, number: Number) -> str:
    """Return a parameter's name; of one that is added to the file's number, that it is."""
    (absent,) = (p.absent for p in effect.parameters if p.name == number.name)
    added = effect.physics.alter is not None and absent == 0.0
    return f"{number.name.replace('_', ' ')}{' off by' if added else ''}"


def _since(named: Named, onset: Onset | None) -> str:
    """Return when it began, where a beginning was looked for."""
    if onset is not None:
        return f" It begins at {onset.time:.1f} s ({onset.low:.1f} to {onset.high:.1f} s)."
    block = named.hypothesis.onset
    if block:
        return f" It begins with block {block} of the recordings."
    # A number of the file is wrong all the time: no beginning is looked for.
    return (
        "" if named.hypothesis.effect.physics.alter is not None else " It is there from the start."
    )


def _elsewhere(diagnosis: Diagnosis, named: Named) -> str:
    """Return that no other element has it, where at least as much of it would have been told."""
    effect = named.hypothesis.effect
    if effect.block not in (Block.WINCH, Block.CABLE) or len(effect.linear) != 1:
        return ""
    others = set(diagnosis.searched[0].machine.cable_names) - set(named.hypothesis.elements)
    limits = {
        each.element: each.least
        for each in diagnosis.limits
        if each.effect == effect.id and each.possible
    }
    if not others or not others <= set(limits) or others & _suspected(diagnosis, effect):
        return ""
    (parameter,) = effect.linear
    absent = parameter.absent or 0.0
    members = members_of(diagnosis.weights, named.hypothesis)
    numbers = [n for c in members for n in numbers_of(diagnosis, c) if n.name == parameter.name]
    least = max(limits[name] for name in others)
    if least > min(abs(n.value - absent) for n in numbers):
        return ""
    told = amount_words(least, parameter.unit)
    return f" No other {effect.block.value} has it: {told} would have shown."


def _suspected(diagnosis: Diagnosis, effect: Effect) -> set[str]:
    """Return the elements on which an effect was found, or explains what was found as well."""
    hypotheses = [
        each
        for named in diagnosis.findings.named
        for each in (named.hypothesis, *(rival.hypothesis for rival in named.alternatives))
    ]
    return {name for each in hypotheses if each.effect.id == effect.id for name in each.elements}


def _worth(diagnosis: Diagnosis, named: Named, worth: Worth | None) -> str:
    """Return what it does to held-out data, in its own residual and simulated."""
    best = max(_concerned(diagnosis, named), key=lambda fit: fit.before / max(fit.after, 1e-300))
    noise = "at the noise floor"
    if best.after > _AT_NOISE * best.noise:
        noise = f"where noise is {_share(best, best.noise)}"
    away = ""
    if best.steady is not None and best.steady < _AWAY * best.after:
        away = f" ({_share(best, best.steady)} apart from where the shaft turns round)"
    before, after = _share(best, best.before), _share(best, best.after)
    moves = "falls" if best.after < best.before else "rises"
    course = f"stays at {after}" if before == after else f"{moves} from {before} to {after}"
    together = sum(best in _concerned(diagnosis, each) for each in diagnosis.findings.named) > 1
    return (
        f"With {'all that was found' if together else 'it'} the held-out error of"
        f" {channel_of(best)} {course} of what was measured{away}, {noise};"
        f" {_simulated_worth(worth)}."
    )


def _share(fit: HeldOut, value: float) -> str:
    percent = 100.0 * value / max(fit.measured, 1e-300)
    return f"{percent:.2g} %" if percent < 100.0 else f"{percent:.0f} %"


def _simulated_worth(worth: Worth | None) -> str:
    if worth is None:
        return "what was recorded does not allow to simulate it"
    if worth.with_it >= worth.without:
        return "simulations of the held-out data do not improve with it"
    unit, both = worth.output.unit, (worth.without, worth.with_it)
    before, after = (amount_words(each, unit) for each in both)
    return f"simulated, the error of {worth.output.name} falls from {before} to {after}"


def region_words(region: Region) -> str:
    """Return where a finding shows."""
    signal, unit = region.driver.rstrip("]").split(" [")
    return (
        f"{signal} is {region.low:.3g} to {region.high:.3g} {unit}: {100 * region.held:.0f} % of"
        f" what it takes from the squared residual lies in these {100 * region.share:.0f} % of the"
        " data"
    )


def _concerned(diagnosis: Diagnosis, named: Named) -> Sequence[HeldOut]:
    """Return the residuals of a finding's own elements that it changes, else all that it may."""
    effect, elements = named.hypothesis.effect, named.hypothesis.elements
    places = {
        regression.channel
        for regression in (effect.signature.regression, *effect.signature.partners)
    }
    fits = [f for f in diagnosis.fit if f.place.element in (*elements, "bar")]
    fits = [f for f in fits if f.place.channel in places] or fits or list(diagnosis.fit)
    own = [f for f in fits if f.place.element in elements and f.after < f.before]
    return own or fits
