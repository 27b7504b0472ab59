"""A real machine, what is true of it, and what can be concealed in its recordings."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import yaml

from bench.real.dataset import Dataset, datasets
from cspm.open_data.source import MACHINES

HERE = Path(__file__).resolve().parent
INERTIA = "winch_inertia"


class Machine(NamedTuple):
    """A machine whose file has all that is known of it, and its recordings.

    Attributes:
        name: short, for the names of cases.
        file: test-bed file with all that is known, absolute or below `cspm/open_data/machines`.
        dataset: recordings, mapping, test-bed file; `truth` and `plausible` are what may be named
            where nothing is concealed.
        element: the cable that effects are on; of sensors' effects theirs.
        columns: by signal, the table's column, how many SI units one of its units is, and what it
            reads at zero, if that is not zero [SI].
        rate: of the rows [Hz].
        radius: of the drum over the gear ratio [m]; 0 where no tension is measured.
        unexplained: RMS of what the file leaves [N·m], of a locked winch's tension [N].
        deletions: effects that leave the file, each with the amount that is true.
        spikes: effects that are added to the recordings.
        every: of how many rows one is used.
        repeats: by parameter, what least squares give of each run.
    """

    name: str
    file: str
    dataset: Dataset
    element: str
    columns: Mapping[str, Sequence[Any]]
    rate: float
    unexplained: float
    deletions: Mapping[str, Mapping[str, float]]
    spikes: Sequence[str]
    radius: float = 0.0
    every: int = 1
    repeats: Mapping[str, Sequence[float]] = {}

    @property
    def known(self) -> set[str]:
        """Effects that may be named where nothing is concealed."""
        return {*self.dataset.truth, *self.dataset.plausible}

    @property
    def content(self) -> dict[str, Any]:
        """What the test-bed file has."""
        found: dict[str, Any] = yaml.safe_load((MACHINES / self.file).read_text("utf-8"))
        return found

    @property
    def terms(self) -> dict[str, dict[str, float]]:
        """Parameters of the effects that the file has."""
        entries = self.content.get("effects", ())
        return {entry["effect"]: entry["parameters"] for entry in entries}

    @property
    def inertia(self) -> float:
        """At the shaft [kg·m²]; 0 of a winch that is locked."""
        cable = self.content["cables"][0]
        given = cable["rotor_inertia"]
        value = given["value"] if isinstance(given, dict) else given
        return 0.0 if cable.get("locked") else float(value)

    def description(self, deleted: str | None) -> dict[str, Any]:
        """Return the contents of the test-bed file, without the term that leaves it.

        Of the inertia half stays, since nothing turns without any.

        Args:
            deleted: the effect that leaves it; None: none does.
        """
        content = self.content
        if deleted == INERTIA:
            content["cables"][0]["rotor_inertia"] = 0.5 * self.inertia
        for sensor in content["sensors"].values() if self.every > 1 else ():
            sensor["rate"] = round(self.rate)
        kept = [entry for entry in content.get("effects", ()) if entry["effect"] != deleted]
        return content | {"effects": kept}

    def element_of(self, effect: str) -> str:
        """Return what an effect is on."""
        if effect.startswith("bar_") or effect in ("pose_delay", "clock_skew"):
            return "bar"
        return "load_cells" if effect == "tension_delay" else self.element


def machines() -> list[Machine]:
    """Return the machines of `machines.yaml`."""
    known = {each.name: each for each in datasets()}
    content = yaml.safe_load((HERE / "machines.yaml").read_text("utf-8"))
    return [Machine(**{**each, "dataset": _dataset(each["dataset"], known)}) for each in content]


def _dataset(given: str | Mapping[str, Any], known: Mapping[str, Dataset]) -> Dataset:
    return known[given] if isinstance(given, str) else Dataset(**given)
