"""Names that somebody may have meant."""

from __future__ import annotations

from collections.abc import Iterable


def allowed_names(given: str, known: Iterable[str], last: str = "") -> str:
    """Return the end of an error's line: what is allowed, and after it the names that are near.

    Args:
        given: what was given and is not known.
        known: all names, in the order in which they are listed.
        last: what is allowed beside them, such as `a file`.
    """
    # Only errors need it.
    from difflib import get_close_matches

    names = list(known)
    *others, last_near = get_close_matches(given, names) or [""]
    near = f"{', '.join(others)} or {last_near}" if others else last_near
    meant = f"; did you mean {near}?" if near else ""
    return f"allowed: {', '.join(names)}{f' or {last}' if last else ''}{meant}"
