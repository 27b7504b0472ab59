"""The statement of one finding, in sentences for the report."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from cspm_ident.channel_words import channel_words
from cspm_ident.diagnosis.diagnosis import Diagnosis
from cspm_ident.diagnosis.finding import Finding, Improvement, Onset, Region
from cspm_ident.diagnosis.parameter import Coefficients, Parameter
from cspm_ident.diagnosis.reporting.machine_part import Kind, kind_of
from cspm_ident.diagnosis.reporting.quantity import amount_words, percent_words
from cspm_ident.diagnosis.reporting.statement import channel_of
from cspm_ident.diagnosis.residuals.file_effects import is_less
from cspm_ident.diagnosis.validation.concerned import concerned
from cspm_ident.diagnosis.validation.holdout_residuals import HeldOut
from cspm_sim.effects import Block, Channel, Effect, Elements

# Of a wave: how often it comes back per turn. It is reported though it was searched on a grid.
_ORDER = "order"
_KINDS = {Block.WINCH: "winches", Block.CABLE: "cables"}
_FAINT = " What was not searched moves so little that it shows little of it."


def statement_of(diagnosis: Diagnosis, finding: Finding) -> str:
    """Return a finding's elements, effect, size, onset, region and improvement, in sentences."""
    effect, region = finding.hypothesis.effect, finding.region
    doubt = _FAINT if finding.is_faint else ""
    where = f" It shows where {region_words(region)}." if region is not None else ""
    return (
        f"{_subject(effect, finding.elements)} {_difference(finding)}:"
        f" {_sizes(finding)}.{_since(finding)}{_elsewhere(diagnosis, finding)}"
        f" {_improvement(diagnosis, finding)}{where}{doubt}"
    )


def consequence_words(consequence: Mapping[str, Any] | None) -> str:
    """Return what a finding costs, from `consequence` of `diagnosis.json`; empty if not known."""
    if consequence is None:
        return ""
    with_it, without = (
        f"{amount_words(each['position_m'], 'm')} and {amount_words(each['angle_rad'], 'rad')}"
        for each in (consequence["with"], consequence["without"])
    )
    return f" The tracking error is {with_it} RMS with it, {without} without it."


def considered_words(finding: Finding) -> str:
    """Return a finding that is not named in words, with its numbers where it has any."""
    numbers = f": {_sizes(finding)}" if finding.coefficients else ""
    return f"{finding.hypothesis.words}{numbers}"


def calibrated_words(finding: Finding) -> str:
    """Return what a survey had to be corrected by, within its accuracy."""
    largest = max(finding.parameters, key=lambda each: abs(each.value))
    size = amount_words(abs(largest.value), largest.unit)
    words, elements = finding.hypothesis.effect.words, ", ".join(finding.elements)
    return f"{words} of {elements}, by up to {size} ({largest.name} of {largest.element})"


_CELLS = (Elements.CELLS.value,)


def _subject(effect: Effect, elements: Sequence[str]) -> str:
    """Return the faulty elements as the subject of a sentence, with its verb."""
    words, kind = subject_words(effect, elements), kind_of(effect)
    many = len(elements) > 1 and kind is not Kind.MARKERS
    verb = "have" if many or tuple(elements) == _CELLS else "has"
    return f"{words[:1].upper()}{words[1:]} {verb}"


def subject_words(effect: Effect, elements: Sequence[str]) -> str:
    """Return the parts that an effect on elements concerns, such as `winches sway 1 and sway 2`."""
    if tuple(elements) == _CELLS:
        return "all load cells"
    kind, many = kind_of(effect), len(elements) > 1
    listed = " and ".join(", ".join(elements).rsplit(", ", 1)).replace("_", " ")
    if kind is Kind.BODY:
        return f"the {listed}"
    if kind is Kind.MARKERS:
        return f"the motion capture of {listed}"
    words = {Kind.WINCH: "winches"}.get(kind, f"{kind.value}s") if many else kind.value
    return f"{words} {listed}"


def _difference(finding: Finding) -> str:
    effect = finding.hypothesis.effect
    if effect.physics.alter is not None:
        return f"another {effect.words} than the test-bed file says"
    if finding.is_less:
        return f"less {effect.words} than the test-bed file says"
    return f"{effect.words} that the model does not have"


def _sizes(finding: Finding) -> str:
    """Return the parameters of every element, once where they are equal."""
    reported = {own.candidate.element: _size(finding, own) for own in finding.coefficients}
    if len(set(reported.values())) == 1:
        return next(iter(reported.values()))
    return "; ".join(f"{element.replace('_', ' ')} {size}" for element, size in reported.items())


def _size(finding: Finding, own: Coefficients) -> str:
    """Return the parameters of one element; those searched on a grid only if there are no others.

    Parameters whose interval contains the value without the effect are listed without a number.
    """
    effect, numbers = own.candidate.effect, finding.parameters_on(own)
    known = [n for n in numbers if n.low < n.high] or numbers
    if all(n.is_open for n in known):
        reported = ", ".join(f"{_name(effect, n)} {amount_words(n.value, n.unit)}" for n in known)
        return f"{reported}, too few data for an interval"
    orders = [n for n in numbers if n.name == _ORDER and n not in known]
    sure = [*orders, *([n for n in known if not _may_be_absent(effect, n)] or known)]
    reported = ", ".join(
        f"{_name(effect, n)} {amount_words(n.value, n.unit, (n.low, n.high))}" for n in sure
    )
    rest = ", ".join(n.name for n in known if n not in sure)
    return f"{reported}, {rest} not significantly" if rest else reported


def _may_be_absent(effect: Effect, number: Parameter) -> bool:
    """Return whether a parameter's interval contains its value without the effect."""
    (absent,) = (p.absent for p in effect.parameters if p.name == number.name)
    return absent is not None and number.low <= absent <= number.high


def _name(effect: Effect, number: Parameter) -> str:
    """Return a parameter's name, marked where it is an offset from the file's value."""
    (absent,) = (p.absent for p in effect.parameters if p.name == number.name)
    less = is_less(effect.id, {number.name: number.value})
    added = absent == 0.0 and (less or effect.physics.alter is not None)
    return f"{number.name.replace('_', ' ')}{' off by' if added else ''}"


def _since(finding: Finding) -> str:
    """Return the onset in words; empty for a parameter of the file without onset."""
    onset: Onset | None = finding.onset
    if onset is not None:
        return f" It begins at {onset.time:.1f} s ({onset.low:.1f} to {onset.high:.1f} s)."
    block = finding.hypothesis.onset
    if block:
        return f" It begins with block {block} of the recordings."
    # A parameter of the file is wrong all the time, so no onset is searched.
    number_of_file = finding.hypothesis.effect.physics.alter is not None
    return "" if number_of_file else " Present throughout."


def _elsewhere(diagnosis: Diagnosis, finding: Finding) -> str:
    """Return that no other element has the effect, where the same size was detectable on all."""
    effect = finding.hypothesis.effect
    if effect.block not in _KINDS or len(effect.linear) != 1:
        return ""
    others = set(diagnosis.searched[0].machine.cable_names) - set(finding.elements)
    limits = {
        each.element: each.least
        for each in diagnosis.limits
        if each.effect == effect.id and each.possible
    }
    if not others or not others <= set(limits) or others & _suspected(diagnosis, effect):
        return ""
    (parameter,) = effect.linear
    absent = parameter.absent or 0.0
    numbers = [n for n in finding.parameters if n.name == parameter.name]
    least = max(limits[name] for name in others)
    if least > min(abs(n.value - absent) for n in numbers):
        return ""
    reported = amount_words(least, parameter.unit)
    return f" Other {_KINDS[effect.block]}: none above the detection limit of {reported}."


def _suspected(diagnosis: Diagnosis, effect: Effect) -> set[str]:
    """Return the elements on which an effect is a finding or an alternative of one."""
    hypotheses = [
        each
        for finding in diagnosis.reported
        for each in (finding.hypothesis, *(rival.hypothesis for rival in finding.alternatives))
    ]
    return {name for each in hypotheses if each.effect.id == effect.id for name in each.elements}


def _improvement(diagnosis: Diagnosis, finding: Finding) -> str:
    """Return the change of the held-out error, in the finding's own residual and simulated."""
    best = clearest_fit(diagnosis, finding)
    limits = diagnosis.thresholds
    at_noise = best.tabled is None and best.is_at_noise(limits)
    noise = "That is the noise floor." if at_noise else f"Noise is {_share(best, best.noise)}."
    if best.steady is not None and best.steady < (1.0 - limits.minor_share) * best.after:
        turns = "the shaft reverses" if best.place.channel is Channel.SHAFT else "the cable snaps"
        away = f"Apart from where {turns} it is {_share(best, best.steady)}."
        noise = f"{away} {noise}"
    before, after = _share(best, best.before), _share(best, best.after)
    moves = "falls" if best.after < best.before else "rises"
    course = f"stays at {after}" if before == after else f"{moves} from {before} to {after}"
    together = sum(best in concerned(diagnosis.fit, each) for each in diagnosis.reported) > 1
    return (
        f"With {'all that was found' if together else 'it'} the held-out error of the"
        f" {channel_words(channel_of(best))} {course} of what was measured. {noise}"
        f" {_simulated(finding.improvement)}"
    )


def clearest_fit(diagnosis: Diagnosis, finding: Finding) -> HeldOut:
    """Return the held-out errors of the residual in which a finding helps most."""
    return max(
        concerned(diagnosis.fit, finding), key=lambda fit: fit.before / max(fit.after, 1e-300)
    )


def _share(fit: HeldOut, value: float) -> str:
    return percent_words(value, fit.measured)


def _simulated(improvement: Improvement | None) -> str:
    if improvement is None:
        return "What was recorded does not allow to simulate it."
    if improvement.with_it >= improvement.without:
        return "Simulations of the held-out data do not improve with it."
    both = improvement.without, improvement.with_it
    before, after = (amount_words(each, improvement.unit) for each in both)
    words = channel_words(improvement.channel)
    return f"Simulated, the error of the {words} falls from {before} to {after}."


def region_words(region: Region) -> str:
    """Return the region in which a finding shows, in words."""
    signal, unit = region.driver.rstrip("]").split(" [")
    return (
        f"{signal} is {region.low:.3g} to {region.high:.3g} {unit}: {100 * region.held:.0f} % of"
        f" what it takes from the squared residual lies in these {100 * region.share:.0f} % of the"
        " data"
    )
