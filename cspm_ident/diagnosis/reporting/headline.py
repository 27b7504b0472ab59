"""The one line that tells what a diagnosis found: title of its page and of the window."""

from __future__ import annotations

from cspm_ident.channel_words import channel_words
from cspm_ident.diagnosis.diagnosis import Diagnosis
from cspm_ident.diagnosis.finding import Finding
from cspm_ident.diagnosis.reporting.finding_statement import clearest_fit, subject_words
from cspm_ident.diagnosis.reporting.machine_part import part_behind
from cspm_ident.diagnosis.reporting.quantity import amount_words, percent_words
from cspm_ident.diagnosis.reporting.statement import channel_of
from cspm_ident.diagnosis.reporting.verdict import Verdict, verdict_of

# Numbers and elements in a title; the page has all.
_NUMBERS, _NAMED = 2, 2


def headline(diagnosis: Diagnosis) -> str:
    """Return what was found in a line, such as "Dry friction at winch sway 3: 30 ± 2 mN·m; …"."""
    if diagnosis.reported:
        first, *more = diagnosis.reported
        further = f" (and {len(more)} more)" if more else ""
        return f"{_named(diagnosis, first)}{further}"
    return _unnamed(diagnosis)


def _named(diagnosis: Diagnosis, finding: Finding) -> str:
    effect = finding.hypothesis.effect
    kind = "another " if effect.physics.alter is not None else "less " if finding.is_less else ""
    words = [f"{kind}{effect.words}"]
    words += [each.hypothesis.effect.words for each in finding.alternatives]
    what = " or ".join(dict.fromkeys(words))
    where, sizes = subject_words(effect, finding.elements), _amounts(finding)
    if len(finding.elements) > _NAMED:
        where = f"{len(finding.elements)} {where.partition(' ')[0]}"
    return f"{what[:1].upper()}{what[1:]} at {where}: {sizes}; {_error(diagnosis, finding)}"


def _amounts(finding: Finding) -> str:
    """Return the numbers of the clearest element, the others being like it."""
    own = finding.coefficients[0]
    numbers = [n for n in finding.parameters_on(own) if n.low < n.high]
    words = [amount_words(n.value, n.unit, (n.low, n.high)) for n in numbers[:_NUMBERS]]
    return ", ".join(words) or "size not known"


def _error(diagnosis: Diagnosis, finding: Finding) -> str:
    fit = clearest_fit(diagnosis, finding)
    before, after = (percent_words(each, fit.measured) for each in (fit.before, fit.after))
    return f"held-out error {before.removesuffix(' %')} → {after}"


def _unnamed(diagnosis: Diagnosis) -> str:
    """Return what is known where no effect is named."""
    names = ", ".join(each.path.name for each in diagnosis.searched)
    verdict = verdict_of(diagnosis)
    if verdict is Verdict.CONSISTENT:
        return f"{names}: the model agrees with the recording to its noise"
    if verdict is Verdict.NOT_EXCITED:
        return f"{names}: cannot tell, what was recorded moves too little"
    for driver, *_ in diagnosis.unexplained:
        signal = driver.signal.split(" [")[0]
        return f"Unmodelled function of {signal} at {part_behind(driver.place).words}"
    for line in diagnosis.lines:
        part = part_behind(line.place).words
        return f"Unmodelled oscillation of {line.frequency:.3g} Hz at {part}"
    for left in diagnosis.undescribed:
        words = channel_words(channel_of(left))
        return f"Unmodelled residual of the {words}"
    return f"{names}: something is unmodelled, and nothing names it"
