"""What is concealed in which recording, and the folder in which a method finds it."""

from __future__ import annotations

import csv
import zlib
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from bench.blind.scoring.outcome import EFFECT, PARAMETER, UNKNOWN
from bench.concealed.machine import Machine
from bench.concealed.spike import Signals, Spike, spike_of
from cspm_sim.effects import catalogue

Array = NDArray[np.float64]

AS_IT_IS, DELETION, SPIKE = "as it is", "deletion", "spike-in"
SIZES = (0.25, 0.5, 1.0, 2.0, 4.0)
QUICK_SIZES = (1.0, 4.0)


class Case(NamedTuple):
    """One thing that is concealed.

    Attributes:
        machine: whose recordings they are.
        kind: `AS_IT_IS`, `DELETION` or `SPIKE`.
        effect: its id; empty where nothing is concealed.
        size: of a spike, in RMS of what is unexplained.
    """

    machine: Machine
    kind: str
    effect: str = ""
    size: float = 0.0

    @property
    def name(self) -> str:
        """For folders and options."""
        size = (f"{self.size:g}",) if self.kind == SPIKE else ()
        words = (self.machine.name, self.kind, self.effect, *size)
        return "-".join(word.replace(" ", "_") for word in words if word)

    @property
    def sign(self) -> float:
        """1 or −1, the same for all sizes and every time."""
        seed = zlib.crc32(f"{self.machine.name} {self.effect}".encode())
        return float(np.random.default_rng(seed).choice([-1.0, 1.0]))


def cases_of(machine: Machine, sizes: Sequence[float]) -> list[Case]:
    """Return a machine's cases: as it is, every deletion, every spike of every size."""
    deletions = [Case(machine, DELETION, effect) for effect in machine.deletions]
    spikes = [Case(machine, SPIKE, effect, s) for effect in machine.spikes for s in sizes]
    return [Case(machine, AS_IT_IS), *deletions, *spikes]


def item_of(case: Case, place: Path) -> dict[str, Any] | None:
    """Return a case as a truth file of the blind benchmark has it.

    Returns None where no machine can have so much of the effect.
    """
    concealed = []
    if case.kind != AS_IT_IS:
        parameters, name, base = _amount(case, place)
        if not _is_possible(case, parameters):
            return None
        concealed = [_concealed(case, parameters, name, base)]
    return {
        "name": case.name,
        "scenario": case.machine.name,
        "stratum": case.kind,
        "absorbed_by": None,
        "concealed": concealed,
    }


def _is_possible(case: Case, parameters: Mapping[str, float]) -> bool:
    """Return whether a file may say that; of what the catalogue lacks nobody knows."""
    if case.effect not in catalogue():
        return True
    known = {p.name: p for p in catalogue()[case.effect].parameters}
    return all(known[n].allowed[0] <= v <= known[n].allowed[1] for n, v in parameters.items())


def _amount(case: Case, place: Path) -> tuple[dict[str, float], str, float]:
    """Return parameters, the one that is judged, and what that is without the effect."""
    if case.kind == DELETION:
        parameters = dict(case.machine.deletions[case.effect])
        return parameters, next(iter(parameters)), 0.0
    spike = _spike(case, place)
    return spike.parameters, spike.parameter, spike.base


def _concealed(
    case: Case, parameters: Mapping[str, float], name: str, base: float
) -> dict[str, Any]:
    effect, element = catalogue().get(case.effect), case.machine.element_of(case.effect)
    if effect is None:
        kind, block = UNKNOWN, "winch"
    else:
        kind = EFFECT if effect.physics.alter is None else PARAMETER
        block = effect.block.value
    return {
        "effect": None if effect is None else case.effect,
        "kind": kind,
        "phenomenon": case.effect,
        "block": block,
        "elements": [element],
        "multiple": case.size,
        "parameter": name,
        "base": base,
        "values": {element: parameters[name]},
        "parameters": dict(parameters),
    }


def conceal(case: Case, place: Path, work: Path) -> tuple[list[Path], list[Path]]:
    """Write what a method is given: altered tables, test-bed file, imported recordings.

    Args:
        case: what to conceal.
        place: the data set's folder.
        work: an empty folder.

    Returns:
        Recordings to search, and those held out.
    """
    machine, dataset = case.machine, case.machine.dataset
    tables = work / "tables"
    tables.mkdir()
    spike = _spike(case, place) if case.kind == SPIKE else None
    for file in (*dataset.search, *dataset.held_out):
        head, rows = _read(machine, place / file)
        if spike is not None:
            _apply(machine, spike, head, rows)
        _write(tables / file, head, rows)
    deleted = case.effect if case.kind == DELETION else None
    return dataset.imported(place, work, tables, machine.description(deleted))


def _spike(case: Case, place: Path) -> Spike:
    signals = signals_of(case.machine, place / case.machine.dataset.search[0])
    return spike_of(case.machine, case.effect, case.size, signals, case.sign)


def signals_of(machine: Machine, table: Path) -> Signals:
    """Return what a table of a machine measures, SI, by signal."""
    return _signals(machine, *_read(machine, table))


def _signals(machine: Machine, head: Sequence[str], rows: Array) -> Signals:
    found = {}
    for name, (column, unit, *zero) in machine.columns.items():
        found[name] = sum(zero) + unit * rows[:, head.index(column)]
    return found


def _apply(machine: Machine, spike: Spike, head: Sequence[str], rows: Array) -> None:
    """Change the columns of a table, in their own units."""
    for name, values in spike.change(_signals(machine, head, rows)).items():
        column, unit, *zero = machine.columns[name]
        rows[:, head.index(column)] = (values - sum(zero)) / unit


def _read(machine: Machine, path: Path) -> tuple[list[str], Array]:
    """Return the columns' names and the rows that are used; nothing is NaN."""
    with path.open(newline="", encoding="utf-8") as file:
        head, *rows = csv.reader(file)
    cells = [[float(cell) if cell else np.nan for cell in row] for row in rows[:: machine.every]]
    return head, np.array(cells)


def _write(path: Path, head: Sequence[str], rows: Array) -> None:
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(head)
        writer.writerows(["" if np.isnan(cell) else f"{cell:.9g}" for cell in row] for row in rows)
