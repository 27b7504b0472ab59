"""Why an estimate is no result: impossible, not determined, or a model that explains nothing."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from math import isfinite
from typing import Any, NamedTuple

from cspm_ident.estimation.estimate import Estimate

# Of the signal's norm: from here on no model at all, which leaves the signal itself, is better.
WHOLE_SIGNAL = 100.0


class Objection(NamedTuple):
    """Why parameters are no result.

    Attributes:
        parameters: their names.
        reason: what is wrong, with the numbers.
        remedy: what may help.
    """

    parameters: tuple[str, ...]
    reason: str
    remedy: str

    @property
    def text(self) -> str:
        """Reason and remedy in one line."""
        return f"no result: {self.reason}; {self.remedy}"

    def data(self) -> dict[str, Any]:
        """Return it as plain data for JSON."""
        return {**self._asdict(), "parameters": list(self.parameters)}


def sign_objections(
    estimate: Estimate, positive: Collection[str], not_negative: Collection[str], remedy: str
) -> list[Objection]:
    """Return objections to values whose sign no machine has, or whose interval leaves it open.

    Where something that a machine always has is below 0, and no friction above it, a sign is wrong
    and nothing is a result.

    Args:
        estimate: with intervals; what is not excited or frozen is passed over.
        positive: names of what a machine has always: masses, inertias, stiffnesses. An interval
            that holds 0 does not determine them.
        not_negative: names of what may be absent, but never below 0: frictions, dampings.
        remedy: what to check where a sign is impossible.
    """
    found = []
    seen = [n for n in estimate.names if n in not_negative and estimate.interval(n)[0] > 0.0]
    for name, unit in zip(estimate.names, estimate.units, strict=True):
        low, high = estimate.interval(name)
        if not (isfinite(low) and isfinite(high)):
            continue
        text = f"{name} {low:.4g} … {high:.4g} {unit}"
        if name in positive and low <= 0.0 < high:
            reason = f"{text} holds 0, so that it is not determined"
            found.append(Objection((name,), reason, "excite it more, or record longer"))
        elif high <= 0.0 and name in positive and not seen:
            return [Objection(estimate.names, f"{text} is below 0, which no machine has", remedy)]
        elif high <= 0.0 and (name in positive or (name in not_negative and high < 0.0)):
            found.append(Objection((name,), f"{text} is below 0, which no machine has", remedy))
    return found


def error_objections(
    estimate: Estimate, errors: Sequence[tuple[str, float]], signal: str
) -> list[Objection]:
    """Return an objection to all values where they predict a signal worse than 0 would.

    Args:
        estimate: with which the signals were predicted.
        errors: names of recordings, each with its error as a share of the signal [%].
        signal: what was predicted.
    """
    return [
        Objection(
            estimate.names,
            f"the error in {name} is {error:.0f} % of the {signal} itself",
            "see what the data look says of this recording, and check signs and stamps",
        )
        for name, error in errors
        if not error < WHOLE_SIGNAL
    ]
