"""How seldom a program looks for garbage: nearly all that it loads stays until it ends."""

from __future__ import annotations

import atexit
import gc

# New objects between two collections. Loading a run makes a million, of which hardly one is waste.
_OBJECTS = 100_000


def look_seldom() -> None:
    """Look for garbage seldom from now on in this process, and not at all once it ends.

    At its end Python would look twice through all that was ever loaded. Files and folders are
    closed by who opened them, or by `atexit`, and are not left to that.
    """
    _, *later = gc.get_threshold()
    gc.set_threshold(_OBJECTS, *later)
    atexit.register(gc.freeze)
