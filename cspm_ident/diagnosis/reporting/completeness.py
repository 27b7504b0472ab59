"""How much of what was missing the findings explain, and what is left, on held-out data."""

from __future__ import annotations

from typing import Any

from cspm_ident.diagnosis.diagnosis import Diagnosis
from cspm_ident.diagnosis.reporting.statement import channel_of, unit_of
from cspm_ident.diagnosis.validation.holdout_residuals import HeldOut
from cspm_ident.diagnosis.validation.remainder import Remainder


def explained_share(diagnosis: Diagnosis) -> float | None:
    """Return the share of the missing squares that the findings explain; None if none is missing.

    Missing is what the described machine leaves beyond the noise of a residual. Squares are in
    units of that noise, so that residuals of different units add up. The share is negative where
    the findings raise the residuals.
    """
    known = [fit for fit in diagnosis.fit if fit.noise > 0.0]
    missing = sum(_beyond(fit, fit.before) for fit in known)
    left = sum(_beyond(fit, fit.final) for fit in known)
    return 1.0 - left / missing if missing > 0.0 else None


def _beyond(fit: HeldOut, level: float) -> float:
    return max(0.0, (level / fit.noise) ** 2 - 1.0)


def left_entries(diagnosis: Diagnosis) -> list[dict[str, Any]]:
    """Return what is left beyond the noise, as `left` of `diagnosis.json`."""
    units = {fit.place: unit_of(fit) for fit in diagnosis.fit}
    return [
        {
            "place": channel_of(each),
            "component": each.component or None,
            "unit": units[each.place],
            "rms": each.rms,
            "noise": each.noise,
            "function_of": each.driver if each.is_function else None,
            "from_s": each.stretch.start,
            "to_s": each.stretch.end,
        }
        for each in diagnosis.beyond_noise
    ]


def completeness_sentence(diagnosis: Diagnosis) -> str:
    """Return how much the reported findings explain, and of what the rest is a function."""
    share = explained_share(diagnosis)
    if share is None or not diagnosis.reported or share <= 0.0:
        return ""
    subject = "All findings together explain" if len(diagnosis.reported) > 1 else "It explains"
    percent = 100.0 * min(share, 1.0)
    rest = _rest(diagnosis.beyond_noise)
    left = f"; {_percent(100.0 - percent)} is unmodelled{rest}" if percent < 99.95 else ""
    return f"{subject} {_percent(percent)} of what was missing on held-out data{left}."


def _percent(value: float) -> str:
    return f"{value:.0f} %" if 1.0 <= value <= 99.0 else f"{value:.1f} %"


def _rest(beyond: tuple[Remainder, ...]) -> str:
    """Return of what most of the rest is a function, in words; empty where of nothing known."""
    function = next((each for each in beyond if each.is_function and each.driver), None)
    return "" if function is None else f", in part a function of {function.driver.split(' [')[0]}"
