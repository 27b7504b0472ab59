"""The report page of a diagnosis: verdict, location, evidence, confidence and next experiments."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from html import escape
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from cspm_ident.diagnosis.diagnosis import Diagnosis
from cspm_ident.diagnosis.finding import Finding
from cspm_ident.diagnosis.regression.hypothesis import Hypothesis
from cspm_ident.diagnosis.reporting.empirical_statement import stage_errors, stage_names
from cspm_ident.diagnosis.reporting.evidence_figure import caption_of, driver_figure, overlay_figure
from cspm_ident.diagnosis.reporting.finding_statement import calibrated_words, considered_words
from cspm_ident.diagnosis.reporting.headline import headline
from cspm_ident.diagnosis.reporting.machine_drawing import drawing
from cspm_ident.diagnosis.reporting.machine_part import Part, part_behind, parts_of
from cspm_ident.diagnosis.reporting.page_checks import (
    controllers_table,
    data_table,
    energy_table,
    saturation_table,
)
from cspm_ident.diagnosis.reporting.statement import (
    channel_of,
    drive_of,
    extrapolation_statement,
    tension_statement,
    unit_of,
)
from cspm_ident.diagnosis.reporting.summary_sheet import STYLE, summary_sheet
from cspm_ident.diagnosis.reporting.verdict import SENTENCES, Verdict, named_in, verdict_of
from cspm_ident.diagnosis.validation.residual_curves import Curve
from cspm_ident.diagnosis_file import IMPROVED
from cspm_ident.offline_page import figure_html, table_html, write_offline_page
from cspm_ident.signals.samples import Samples
from cspm_sim.effects import catalogue

Array = NDArray[np.float64]

# Most curves per finding: for an effect on all eight cables, some are enough.
_MOST_CURVES = 3
# Least explained share of the squared residual for a curve to illustrate a finding.
_GAINED = 0.2
_STYLE = """<style>
.verdict {border-color: #b3003c}
.consistent {border-color: #1b7f3b}
nav a {display: inline-block; margin: 0.2em 1em 0.2em 0; padding: 0.3em 0}
</style>"""
_SECTIONS = {
    "data": "The data first",
    "saturation": "Drives at their torque limit",
    "evidence": "Evidence on held-out data",
    "parameters": "Parameters",
    "hypotheses": "Hypotheses",
    "fit": "Every residual",
    "simulated": "Simulated again",
    "energy": "Where energy goes",
    "controllers": "Controllers stepped again",
    "limits": "Detection limits",
    "silent": "Not testable here",
    "next": "What to do next",
    "sources": "Recordings and files",
}


def write_diagnosis_page(path: Path, found: Diagnosis, data: dict[str, Any]) -> None:
    """Write one HTML file that needs no network.

    Args:
        path: of the file.
        found: the diagnosis.
        data: contents of its `diagnosis.json`.

    Raises:
        OSError: the file cannot be written.
    """
    verdict = verdict_of(found)
    names = ", ".join(m.path.name for m in found.searched)
    about = f"<p>Diagnosis of {escape(names)}: {verdict.value}</p>"
    bodies = {
        "data": data_table(data),
        "saturation": saturation_table(found),
        "evidence": _evidence(found),
        "parameters": _parameters(data),
        "hypotheses": _hypotheses(found, data),
        "fit": _fit(found),
        "simulated": _simulated(found, data),
        "energy": energy_table(found),
        "controllers": controllers_table(data),
        "limits": _limits(found),
        "silent": _silent(data),
        "next": _next(found, data),
        "sources": _sources(data),
    }
    shown = {name: body for name, body in bodies.items() if body}
    links = "".join(f"<a href='#{name}'>{escape(_SECTIONS[name])}</a>" for name in shown)
    sections = (
        f"<section id={name}><h2>{escape(_SECTIONS[name])}</h2>{body}</section>"
        for name, body in shown.items()
    )
    where = f"<section id=where>{_where(found)}</section>"
    _, curves, _ = next(iter(_subjects(found)), ("", (), ""))
    sheet = summary_sheet(
        found, data, _verdict(verdict, data), where, curves, lambda: _steps(found, data)[0]
    )
    details = f"<div class=details><nav aria-label=sections>{links}</nav>{''.join(sections)}</div>"
    write_offline_page(path, headline(found), [STYLE, _STYLE, about, sheet, details])


def _verdict(verdict: Verdict, data: dict[str, Any]) -> str:
    sentences = [SENTENCES[verdict]]
    for finding in data["findings"]:
        sentences.append(finding["statement"])
        sentences += [f"As well explained by {_rival(each)}." for each in finding["alternatives"]]
    sentences += [entry["statement"] for entry in data["empirical"]]
    kind = " consistent" if verdict is Verdict.CONSISTENT else ""
    text = "<br>".join(escape(sentence) for sentence in sentences)
    return f'<p class="verdict{kind}">{text}</p>'


def _rival(alternative: dict[str, Any]) -> str:
    """Return an alternative in plain words, with its probability."""
    beside = alternative["beside"]
    with_it = f", beside another {catalogue()[beside].words} than the file's" if beside else ""
    where = ", ".join(alternative["elements"])
    effect = catalogue()[alternative["effect"]]
    words = f"another {effect.words}" if effect.physics.alter is not None else effect.words
    return f"{words} ({alternative['effect']} on {where}{with_it})"


def _where(found: Diagnosis) -> str:
    first = found.searched[0]
    parts = list(dict.fromkeys(_parts(found)))
    picture = drawing(
        first.machine, _mean_pose(first.bar_pose), _mean_pose(first.frame_pose), parts
    )
    named = ", ".join(part.words for part in parts) or "no part"
    drawn = tension_statement(found)
    note = "" if drawn is None else f"<p>{escape(drawn)}</p>"
    return f"<p>Marked: {escape(named)}.</p>{note}{picture}"


def _parts(found: Diagnosis) -> Iterable[Part]:
    cables = found.searched[0].machine.cable_names
    for finding in found.reported:
        for element in finding.elements:
            yield from parts_of(finding.hypothesis.effect, element, cables)
    for each in found.unexplained:
        yield part_behind(each.driver.place)
    for line in found.lines:
        yield part_behind(line.place)
    if not found.reported:
        for left in found.undescribed:
            yield part_behind(left.place)


def _mean_pose(samples: Samples | None) -> Array | None:
    return None if samples is None else np.asarray(samples.values.mean(axis=0))


def _evidence(found: Diagnosis) -> str:
    """Return the figures of each finding, or of the largest residual if there is no finding."""
    texts = []
    for heading, curves, driver in _subjects(found):
        texts.append(f"<h3>{escape(heading)}</h3>")
        for curve in curves:
            signal = driver or curve.main_signal
            texts.append(f"<p>{escape(caption_of(curve, signal))}</p>")
            if signal:
                texts.append(figure_html(driver_figure(curve, signal)))
            texts.append(figure_html(overlay_figure(curve)))
    return "".join(texts)


def _subjects(found: Diagnosis) -> Iterable[tuple[str, Sequence[Curve], str]]:
    """Yield headings, curves and their signal; an empty signal is the one that explains most."""
    for finding in found.reported:
        own = [c for c in found.curves if _touches(finding.hypothesis, c)]
        own.sort(key=lambda curve: -curve.gained)
        shown = [c for k, c in enumerate(own[:_MOST_CURVES]) if k == 0 or c.gained > _GAINED]
        yield finding.hypothesis.words, shown, ""
    for driver, *_ in found.unexplained:
        own = [c for c in found.curves if c.place == driver.place and driver.signal in c.signals]
        yield (
            f"unknown, a function of {driver.signal} of {driver.place.element}",
            own[:1],
            driver.signal,
        )
    if found.reported or found.unexplained:
        return
    for left in found.undescribed[:_MOST_CURVES]:
        own = [c for c in found.curves if (c.place, c.component) == (left.place, left.component)]
        yield f"unknown, in {channel_of(left)}", own[:1], left.driver
    if not found.undescribed and found.curves:
        largest = max(found.curves, key=_size)
        yield "nothing found; the residual that is largest against what was measured", [largest], ""


def _touches(hypothesis: Hypothesis, curve: Curve) -> bool:
    return any(
        c.effect_id == hypothesis.effect.id and c.element in hypothesis.elements
        for c in curve.touched
    )


def _size(curve: Curve) -> float:
    return float(np.std(curve.before) / max(np.std(curve.measured), 1e-300))


def _parameters(data: dict[str, Any]) -> str:
    rows = []
    for finding in data["findings"]:
        for each in finding["parameters"]:
            ends = each["ci95"]
            interval = f"{ends[0]:.4g} to {ends[1]:.4g}" if ends else "none"
            value = f"{each['value']:.4g}"
            rows.append(
                (finding["effect"], each["element"], each["name"], value, interval, each["unit"])
            )
    heads = ("effect", "element", "parameter", "value", "95 % interval", "unit")
    return table_html(heads, rows, "parameters") if rows else ""


def _hypotheses(found: Diagnosis, data: dict[str, Any]) -> str:
    rows: list[tuple[str, ...]] = []
    for finding, entry in zip(found.reported, named_in(data), strict=True):
        rows += _ranked(finding, entry)
    for finding in found.considered:
        size = _in_errors(finding.gain.total, finding.gain.error)
        rows.append((considered_words(finding), "not named", "", size, finding.reason_not_kept))
    for finding in found.calibrated:
        size = _in_errors(finding.gain.total, finding.gain.error)
        rows.append(
            (calibrated_words(finding), "calibrated", "", size, f"{100 * finding.share:.0f} %")
        )
    for driver, gain, share, _ in found.unexplained:
        name = f"a function of {driver.signal}, {driver.place.element}"
        size = _in_errors(gain.total, gain.error)
        rows.append((name, "unknown", "", size, f"{100 * share:.0f} %"))
    for line in found.lines:
        name = f"periodic, {line.frequency:.2f} Hz, {line.place.element}"
        rows.append((name, "unknown", "", f"by chance {line.chance:.1g}", ""))
    if not rows:
        return f"<p>None of {found.tested} was accepted.</p>"
    heads = ("hypothesis", "verdict", "probability", "gain in standard errors", "residual taken")
    trusted = found.thresholds.trusted_probability
    count = (
        f"<p>{found.tested} hypotheses were tested. A probability compares rival"
        f" explanations, times {trusted:g}: the share of findings without a rival that"
        " were right in blind recordings.</p>"
    )
    return count + table_html(heads, rows, "hypotheses and their evidence")


def _ranked(finding: Finding, entry: dict[str, Any]) -> Iterable[tuple[str, ...]]:
    """Yield a finding's row and those of its alternatives, the best first."""
    verdict = "tied" if finding.alternatives else "found"
    size = _in_errors(finding.gain.total, finding.gain.error)
    likely, taken = f"{entry['probability']:.2f}", f"{100 * finding.share:.0f} %"
    yield finding.hypothesis.words, verdict, likely, size, taken
    rivals = zip(finding.alternatives, entry["alternatives"], strict=True)
    for rival, reported in sorted(rivals, key=lambda each: each[0].behind):
        behind = f"{rival.behind:.1f} behind"
        yield (
            rival.words,
            "explains it as well",
            f"{reported['probability']:.2f}",
            behind,
            "",
        )


def _in_errors(total: float, error: float) -> str:
    return f"{total / error:.1f}" if error > 0.0 else "∞"


def _fit(found: Diagnosis) -> str:
    judged = "recordings held out" if found.held_out else "the last part, which was not searched"
    heads = ("residual", *stage_names(found), "black box", "noise", "unit")
    rows = []
    for fit in found.fit:
        numbers = (*stage_errors(found, fit), fit.ceiling, fit.noise)
        rows.append((channel_of(fit), *(f"{n:.3g}" for n in numbers), unit_of(fit)))
    text = (
        f"<p>Root mean square on {judged}. <i>Re-tuned</i> is the file with its own numbers fitted"
        " and nothing added; <i>black box</i> is free functions of every signal instead of"
        " physics; <i>noise</i> is the white part of the residual.</p>"
    )
    if found.tables:
        text += (
            "<p><i>Named</i> is the model with the effects that were found; <i>after</i> has tables"
            " of values as well, which describe the rest and explain nothing.</p>"
        )
    text += "".join(f"<p>{escape(extrapolation_statement(e))}</p>" for e in found.extrapolated)
    return text + table_html(heads, rows, "root mean square of every residual")


def _simulated(found: Diagnosis, data: dict[str, Any]) -> str:
    """Return errors of hold-out simulations, and of the closed loop where it was simulated."""
    if not found.simulated:
        return ""
    heads = ("quantity", "input", *stage_names(found), "noise", "unit")
    rows = []
    for fit in found.simulated:
        numbers = (*stage_errors(found, fit), fit.floor)
        reported = (f"{n:.3g}" for n in numbers)
        rows.append((fit.output.name, drive_of(fit), *reported, fit.output.unit))
    text = (
        "<p>Root mean square errors of held-out data, each part simulated from measured signals:"
        " winches and bar in windows of half a second, cables and bar from motor angles"
        " throughout.</p>"
    )
    whole = text + table_html(heads, rows, "root mean square errors of simulations")
    loop = [
        (each["name"], f"{each['before']:.3g}", f"{each['after']:.3g}", each["unit"])
        for each in data.get("closed_loop", ())
    ]
    if not loop:
        return whole
    columns = ("quantity", "before", "after", "unit")
    text = "<p>The recorded scenario run again in closed loop: difference to the recording.</p>"
    return whole + text + table_html(columns, loop, "root mean square differences in closed loop")


def _limits(found: Diagnosis) -> str:
    """Return the detection limits of effects, as the range over their elements."""
    sizes: dict[tuple[str, str, str], list[float]] = {}
    for limit in found.limits:
        if limit.possible:
            key = limit.effect, limit.parameter, limit.unit
            sizes.setdefault(key, []).append(limit.least)
    rows = [
        (effect, parameter, f"{min(least):.2g}", f"{max(least):.2g}", unit)
        for (effect, parameter, unit), least in sizes.items()
    ]
    heads = ("effect", "parameter", "on the clearest element", "on the least clear", "unit")
    text = "<p>A larger effect than this, beside what was found, would be reported.</p>"
    return text + table_html(heads, rows, "limits of detection") if rows else ""


def _silent(data: dict[str, Any]) -> str:
    rows = []
    known = catalogue()
    for each in data["not_excited"]:
        where = ", ".join(each["elements"]) or "everywhere"
        rows.append(
            (each["effect"], where, known[each["effect"]].description.separating_experiment)
        )
    heads = ("effect", "on", "what would show it")
    return table_html(heads, rows, "effects that these recordings cannot show") if rows else ""


def _next(found: Diagnosis, data: dict[str, Any]) -> str:
    return f"<ul>{''.join(f'<li>{step}</li>' for step in _steps(found, data))}</ul>"


def _steps(found: Diagnosis, data: dict[str, Any]) -> list[str]:
    """Return what to do next, the first thing first, as HTML."""
    steps = []
    for finding in data["findings"]:
        for rival in finding["alternatives"]:
            pair = f"To distinguish {finding['effect']} from {rival['effect']}"
            advice = catalogue()[finding["effect"]].description.separating_experiment
            steps.append(_experiment(pair, rival["separating_experiment"], advice))
    if data["model"]:
        steps.append(
            f"<code>cspm run SCENARIO --testbed {IMPROVED}</code> simulates the machine with what"
            " was found."
        )
    shown: dict[str, list[str]] = {}
    for each in data["not_excited"]:
        if each.get("separating_experiment"):
            shown.setdefault(each["separating_experiment"], []).append(each["effect"])
    for name, effects in shown.items():
        steps.append(_experiment(f"To make {', '.join(effects)} testable", name, ""))
    if found.unexplained:
        steps.append("Describe what was found as unknown as an effect of your own.")
    if not steps:
        steps.append("Nothing has to be done. What was not testable needs other recordings.")
    return steps


def _experiment(purpose: str, file: str | None, advice: str) -> str:
    """Return one line of HTML: which scenario to run, or what to do where there is none."""
    if file is None:
        reason = "no recorded-safe motion would separate these better"
        return escape(f"{purpose}: {advice} ({reason}).")
    said = escape(f"{purpose}, record ")
    return f"{said}<a href='{escape(file)}'><code>cspm run {escape(file)}</code></a>."


def _sources(data: dict[str, Any]) -> str:
    rows = [(r["path"], _role(r), r["sha256"]) for r in data["recordings"]]
    rows.append((data["testbed"]["path"], "test-bed", data["testbed"]["sha256"]))
    return table_html(("file", "role", "SHA-256"), rows, "recordings and files")


def _role(recording: dict[str, Any]) -> str:
    cut = "" if recording["complete"] else ", not closed by its writer"
    return f"{recording['role'].replace('_', ' ')}{cut}"
