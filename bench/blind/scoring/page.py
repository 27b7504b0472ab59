"""The scorecard as a page."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from bench.blind.scoring.brier import brier_of
from bench.blind.scoring.share import share_of, share_words
from bench.blind.scoring.target import Judged, findings_judged, numbers_judged
from bench.markdown import markdown_table

_VERDICTS = ("consistent", "parameter", "effect", "tie", "unknown", "not_excited", "failed")
_STANDING = {
    "dev": "This is the development split, on which the diagnosis is being worked at: it proves"
    " nothing about other machines, and the diagnosis is under development.",
    "tune": "This is the split on which thresholds are tuned.",
    "sealed": "This is the sealed split.",
}

Data = Mapping[str, Any]


def scorecard_page(card: Data, sha256: str, machine: str, figure: str | None = None) -> str:
    """Return the scorecard as Markdown.

    Args:
        card: the scorecard, with the rows of `peers` and `ablations` beside it (`comparison`).
        sha256: of the truth file.
        machine: what scored it, and when.
        figure: its picture, from where the page lies, if there is one.
    """
    parts = [
        "# Blind results",
        _about(card, sha256, machine),
        *([] if figure is None else [f"![The scorecard in pictures]({figure})"]),
        "## Against the targets",
        "Known effects and numbers at 2 detection limits and more; intervals of 95 % after Clopper"
        " and Pearson.",
        _targets(card),
        *_methods("## Peers", _PEERS, card["peers"]),
        *_methods("## Without one safeguard", _ABLATIONS, card["ablations"]),
        "## By amount",
        markdown_table(
            ("detection limits", "cases", "detected", "among the ties", "named"),
            (
                (
                    f"{row['multiple']:g}",
                    str(row["detected"][1]),
                    *(share_words(row[key]) for key in ("detected", "tied", "named")),
                )
                for row in card["by_multiple"]
            ),
        ),
        "## By stratum",
        _strata(card["by_stratum"]),
        "## Verdicts",
        markdown_table(
            ("concealed", *_VERDICTS),
            (
                (kind, *(str(row.get(verdict, 0)) for verdict in _VERDICTS))
                for kind, row in card["confusion"].items()
            ),
        ),
        "## What was named first",
        markdown_table(
            ("concealed", "named first", "cases"),
            ((row["concealed"], row["named_first"], str(row["cases"])) for row in card["effects"]),
        ),
        "## Parameters, fit, probabilities, time",
        _numbers(card),
        markdown_table(
            ("effect", "estimates", "median relative error", "intervals that hold the truth"),
            (
                (
                    row["effect"],
                    str(row["estimates"]),
                    f"{100 * row['median_signed_error']:+.1f} %",
                    share_words(row["covered"]),
                )
                for row in card["parameters"]["by_effect"]
            ),
        ),
        _calibration(card["calibration"]),
        _onsets(card["onsets"], card["shares"]["driver"]),
        "## Every recording",
        _recordings(card["outcomes"]),
    ]
    return "\n\n".join(parts) + "\n"


def _about(card: Data, sha256: str, machine: str) -> str:
    request = card["asked"]
    # Whoever knows the seed can draw what is still to be scored.
    open_yet = request["split"] == "sealed" and card["scored"] < card["drawn"]
    silent = {"strata", "seed"} if open_yet else {"strata"}
    options = ", ".join(f"{key} {value}" for key, value in request.items() if key not in silent)
    return (
        f"{card['scored']} of {card['drawn']} recordings; drawn with {options}; truth file SHA-256"
        f" `{sha256}`."
        f" Scored {machine}."
        f" {_STANDING[request['split']]} How it is made and what the words mean:"
        " [blind benchmark](../docs/explanation/blind-benchmark.md)."
        " Written by `python -m bench.blind score DIR --page FILE`."
    )


def _targets(card: Data) -> str:
    shares = card["shares"]
    upper = f"{100 * shares['false_alarm_upper']:.0f} %"
    rows = [
        *_words(findings_judged(card)),
        ("one-sided upper bound of alarms", upper, "≤ 6 %"),
        ("mean size of the ties", _number(shares["mean_tie_size"]), "≤ 1.5"),
        ("beginning right, of what was named", share_words(card["onsets"]["right"]), ""),
        ("operating region right, where one was given", _region(shares), ""),
        *_words(numbers_judged(card)),
    ]
    return markdown_table(("", "found", "target"), rows)


def _words(judged: Sequence[Judged]) -> Iterator[tuple[str, str, str]]:
    for label, found, target in judged:
        yield label, share_words(found), target


def _methods(title: str, words: str, rows: Sequence[Data]) -> list[str]:
    if not rows:
        return []
    found = markdown_table(
        ("method", *_FOUND.values(), "ties", "alarm bound", "wrong findings"),
        (
            (
                row["method"],
                *(_short(row[key]) for key in _FOUND),
                _number(row["mean_tie_size"]),
                f"{100 * row['false_alarm_upper']:.0f} %",
                f"{row['wrong_per_recording']:.1f}",
            )
            for row in rows
        ),
    )
    heads = ("parameter error", *_WORTH.values(), "held-out", "CPU s")
    measured = markdown_table(("method", *heads), map(_worth, rows))
    about = f"{words} {rows[0]['scored']} recordings, the same for all. {_COLUMNS}"
    return [title, about, found, measured]


def _worth(row: Data) -> tuple[str, ...]:
    error = row["parameter_error"]
    return (
        row["method"],
        "—" if error is None else f"{100 * error:.1f} %",
        *(_short(row[key]) for key in _WORTH),
        "—" if row["after"] is None else " → ".join(_number(row[key]) for key in _STAGES),
        _number(row["seconds"]),
    )


_FOUND = {
    "detected": "anything",
    "block": "block",
    "element": "element",
    "region": "region",
    "first": "named first",
    "tied": "among the ties",
    "nothing_wrong_beside": "named, nothing wrong beside",
    "false_alarm": "alarm",
    "parameter_called_effect": "number as effect",
    "unknown_recognised": "unknown",
    "false_unknown": "false unknown",
    "failed": "failed",
}
_STAGES = ("before", "retuned", "after")
_WORTH = {
    "covered": "intervals",
    "near_floor": "within 1.5 × floor",
    "below_retuned": "below re-tuned",
}
_PEERS = (
    "Others' ways on the same residuals, see"
    " [blind benchmark](../docs/explanation/blind-benchmark.md#peers); `retuned` is what a"
    " laboratory does today."
)
_ABLATIONS = (
    "What each safeguard adds, see"
    " [blind benchmark](../docs/explanation/blind-benchmark.md#without-one-safeguard)."
)
_COLUMNS = (
    "Hits and cases are those of the targets; the bound is the one-sided one of alarms; wrong"
    " findings are per recording; the parameter error is the median of relative ones; held-out is"
    " the worst residual in units of a healthy machine's, before, re-tuned and after, median of"
    " known effects and numbers at 2 limits and more, named or not."
)


def _onsets(found: Data, driver: Sequence[float]) -> str:
    error = found["median_error_s"]
    return (
        "Of what was named and began late, an onset was given for"
        f" {share_words(found['reported'])}, with a median error of"
        f" {'—' if error is None else f'{error:.1f} s'}, and its interval held the truth for"
        f" {share_words(found['held'])}; of effects present throughout, one was given for"
        f" {share_words(found['false'])}. Of the unknown that was recognised, the signal that it"
        f" depends on was right, on its elements, for {share_words(driver)}."
    )


def _strata(rows: Sequence[Data]) -> str:
    keys = ("cases", "detected", "block", "element", "tied", "named")
    heads = ("stratum", *keys, "region", "wrong findings", "failed")
    return markdown_table(
        heads,
        (
            (
                row["stratum"],
                *(str(row[key]) for key in keys),
                _short(row["region"]),
                *(str(row[key]) for key in ("wrong", "failed")),
            )
            for row in rows
        ),
    )


def _region(shares: Data) -> str:
    reported, named, *_ = shares["region_reported"]
    return f"{share_words(shares['region'])}; none given for {named - reported}"


def _numbers(card: Data) -> str:
    parameters, fit, seconds = card["parameters"], card["fit"], card["seconds"]
    error = parameters["median_error"]
    return (
        f"{parameters['estimates']} parameters were estimated, with a median relative error of"
        f" {'—' if error is None else f'{100 * error:.1f} %'};"
        f" {share_words(parameters['within_a_tenth'])} within a tenth. Held-out error of the worst"
        f" residual in units of a healthy machine's, median of {fit['cases']} named:"
        f" {_number(fit['before'])} before, {_number(fit['retuned'])} re-tuned,"
        f" {_number(fit['after'])} after. Processor time of a diagnosis:"
        f" {_number(seconds['median'])} s median, {_number(seconds['max'])} s at most."
    )


def _calibration(rows: Sequence[Data]) -> str:
    reported = (
        (f"{row['from']:g} to {row['to']:g}", _number(row["said"]), share_words(row["right"]))
        for row in rows
    )
    table = markdown_table(("reported probability", "mean", "effect right"), reported)
    found = brier_of([(row["said"] or 0.0, share_of(*row["right"][:2])) for row in rows])
    if found is None:
        return table
    return (
        f"{table}\n\nBrier score by these bins: {found.score:.3f}. The share of all that are right,"
        f" reported of each, would score {found.constant:.3f}."
    )


def _recordings(outcomes: Sequence[Data]) -> str:
    heads = ("recording", "stratum", "concealed", "limits", "verdict", "found")
    rows = (
        (
            o["name"],
            o["stratum"],
            listed(o["truth"]),
            f"{o['multiple']:g}",
            o["verdict"],
            listed(o["found"]),
        )
        for o in sorted(outcomes, key=lambda o: (o["stratum"], o["name"]))
    )
    return markdown_table(heads, rows)


def listed(pairs: Sequence[tuple[str, Sequence[str]]]) -> str:
    """Return effects and their elements for a cell of a table, a line each."""
    reported = []
    for effect, elements in pairs:
        many = len(elements) > 3
        reported.append(f"{effect}: {f'{len(elements)} elements' if many else ', '.join(elements)}")
    return "<br>".join(reported)


def _short(found: Sequence[float]) -> str:
    hits, cases, *_ = found
    return f"{hits:g} of {cases:g}" if cases else "—"


def _number(value: float | None) -> str:
    return "—" if value is None else f"{value:.2g}"
