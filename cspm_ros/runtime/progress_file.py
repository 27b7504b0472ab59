"""How far a plant's process is, in a file that others may read at any time."""

from __future__ import annotations

import json
from dataclasses import asdict, dataclass
from pathlib import Path


@dataclass
class Report:
    """The state of a run.

    Attributes:
        simulated: time simulated [s].
        elapsed: wall time that took [s], without start-up.
        waiting: what has to come before the run goes on, if it has stopped.
        failure: what ended it, in one line, if anything did.
        ended: whether no step follows; others may leave before the leader then.
        finished: whether moreover everybody has all of it.
    """

    simulated: float = 0.0
    elapsed: float = 0.0
    waiting: str = ""
    failure: str | None = None
    ended: bool = False
    finished: bool = False

    def write(self, path: Path) -> None:
        """Replace the file in one go, so that a reader never sees half of it."""
        draft = path.with_suffix(".draft")
        draft.write_text(json.dumps(asdict(self)), encoding="utf-8")
        draft.replace(path)


def read_report(path: Path) -> Report:
    """Return the state last written, or that of a run that has not begun."""
    try:
        return Report(**json.loads(path.read_text(encoding="utf-8")))
    except FileNotFoundError:
        return Report()
