"""How old the state may be that a torque answers, in a run in real time."""

from __future__ import annotations

_REMEDY = "lower rates with gains for them, or nodes with -p priority:=50"


def too_busy(what: str, age_ns: int, allowed_ns: int, remedy: str = _REMEDY) -> str | None:
    """Return in one line that the machine is too busy; None where the age is allowed.

    Args:
        what: that is so old.
        age_ns: of the state [ns].
        allowed_ns: at most [ns].
        remedy: what helps.
    """
    if age_ns <= allowed_ns:
        return None
    return (
        f"machine too busy: {what} {age_ns * 1e-6:.1f} ms ago, allowed:"
        f" {allowed_ns * 1e-6:.3g} ms (safety.lateness): {remedy}"
    )
