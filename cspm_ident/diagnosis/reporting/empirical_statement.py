"""Tables of what is unexplained, in words and as entries of files."""

from __future__ import annotations

from typing import Any

import numpy as np

from cspm_ident.diagnosis.diagnosis import Diagnosis
from cspm_ident.diagnosis.reporting.formula_hint import sketch
from cspm_ident.diagnosis.residuals.regressors import Place
from cspm_ident.diagnosis.thresholds import Thresholds
from cspm_ident.diagnosis.validation.holdout_residuals import HeldOut
from cspm_ident.diagnosis.validation.holdout_simulation import SimulatedFit
from cspm_msgs_py.testbed import EffectEntry
from cspm_msgs_py.testbed_keys.effect_table import EffectTable

# Digits of knots and values in files; the tables' errors are larger by far.
_DIGITS = 9
_WHERE = {
    "winch_torque": "the torque of winch {}",
    "cable_tension": "the tension of cable {}",
    "bar_wrench": "the wrench on the {}",
}


def stage_names(diagnosis: Diagnosis) -> tuple[str, ...]:
    """Return the headings of held-out errors; the last is of all that the improved file has."""
    named = ("named",) if diagnosis.tables else ()
    return ("before", "re-tuned", *named, "after")


def stage_errors(diagnosis: Diagnosis, fit: HeldOut | SimulatedFit) -> tuple[float, ...]:
    """Return held-out errors in the headings' order."""
    named = (fit.after,) if diagnosis.tables else ()
    return (fit.before, fit.retuned, *named, fit.final)


def table_entries(diagnosis: Diagnosis) -> list[EffectEntry]:
    """Return the tables as entries of a test-bed file, with the formula that they run like."""
    found = []
    for candidate, values in diagnosis.tables.items():
        effect = candidate.effect
        assert effect.table is not None
        rounded = tuple(float(f"{value:.{_DIGITS}g}") for value in values)
        knots = tuple(float(f"{knot:.{_DIGITS}g}") for knot in effect.table.knots)
        seconds = tuple(float(f"{knot:.{_DIGITS}g}") for knot in effect.table.second_knots)
        update = {
            "values": rounded,
            "knots": knots,
            "second_knots": seconds,
            "unit": effect.table.value_unit,
        }
        table = effect.table.model_copy(update=update)
        if formula := _formula(table, diagnosis.thresholds):
            table = table.model_copy(update={"note": f"{table.note}; it runs like {formula}"})
        found.append(EffectEntry(effect=effect.id, elements=(candidate.element,), parameters=table))
    return found


def empirical_entries(diagnosis: Diagnosis) -> list[dict[str, Any]]:
    """Return the tables as `diagnosis.json` has them, with the held-out residual in its unit."""
    found = []
    for candidate, entry in zip(diagnosis.tables, table_entries(diagnosis), strict=True):
        place = Place(candidate.effect.signature.regression.channel, candidate.element)
        fit = next((each for each in diagnosis.fit if each.place == place), None)
        assert entry.table is not None
        found.append(
            {
                "effect": entry.effect,
                "elements": list(entry.elements),
                "table": entry.table.model_dump(mode="json", exclude_defaults=True),
                "statement": _statement(entry.elements[0], entry.table, fit),
            }
        )
    return found


def _statement(element: str, table: EffectTable, fit: HeldOut | None) -> str:
    """Return one sentence on what a table describes, and how well on held-out data."""
    where = _WHERE[table.place].format(element) + (f" in {table.axis}" if table.axis else "")
    size = max(table.values) - min(table.values)
    sentence = (
        f"A table of values describes {where} as a function of {' and '.join(table.drivers)},"
        f" over a range of {size:.3g} {table.value_unit}; it explains nothing"
    )
    if fit is None:
        return f"{sentence}."
    return (
        f"{sentence}. On held-out data the residual falls from"
        f" {fit.after / fit.noise:.3g} to {fit.final / fit.noise:.3g} times its noise."
    )


def _formula(table: EffectTable, thresholds: Thresholds) -> str | None:
    if table.second_driver is not None:
        return None
    return sketch(np.array(table.knots), np.array(table.values), table.driver, thresholds)
