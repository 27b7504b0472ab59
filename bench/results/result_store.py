"""What was measured for results/steep-sea.md, kept until what decides it changes."""

from __future__ import annotations

import ast
import hashlib
import inspect
import json
import os
import re
from collections.abc import Callable
from dataclasses import dataclass
from datetime import date
from functools import cache
from pathlib import Path
from typing import Any, NamedTuple

from bench.results.tracking import SCENARIOS, Case
from cspm_run.library import find_scenario

ROOT = Path(__file__).resolve().parents[2]
# What all measurements are made with, beside the module that measures: rooms, and files of those
# that hold much else.
MADE_WITH = (
    "cspm_control",
    "cspm_model",
    "cspm_sim",
    *(f"cspm_run/{name}.py" for name in ("assembly", "bundle", "loop", "plants")),
    *(
        f"cspm_msgs_py/{name}.py"
        for name in ("dofs", "motion_spec", "safety_spec", "scenario", "schedule", "testbed")
    ),
    "bench/results/feasibility.py",
    "bench/results/tracking.py",
)
NOT_MADE_WITH = ("cspm_control/analysis", "cspm_sim/effects/document.py")


@dataclass(frozen=True)
class Measurement:
    """Something to measure.

    Attributes:
        name: no other's.
        by: a function of a module, from `arguments` and what the needed ones found to plain data.
        arguments: of it.
        needs: measurements that come before, whose findings follow the arguments.
        alone: whether it measures time, which other work would falsify.
    """

    name: str
    by: Callable[..., Any]
    arguments: tuple[Any, ...] = ()
    needs: tuple[Measurement, ...] = ()
    alone: bool = False

    def fingerprint(self) -> str:
        """Return a hash of all that decides what is found, but for libraries and machine."""
        measuring = Path(inspect.getfile(self.by)).read_text(encoding="utf-8")
        parts = [code_hash(), spoken(measuring), self.by.__qualname__, repr(self.arguments)]
        for case in self.arguments:
            if isinstance(case, Case):
                parts.append(find_scenario(case.scenario).read_text(encoding="utf-8"))
        parts += [path.read_text(encoding="utf-8") for path in _testbeds()]
        parts += [each.fingerprint() for each in self.needs]
        return hashlib.sha256("\0".join(parts).encode()).hexdigest()


class Kept(NamedTuple):
    """What was found on a day within so many seconds of one processor [s]."""

    found: Any
    day: str
    processor_s: float


class Store:
    """A folder with a file per measurement."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder

    def find(self, measurement: Measurement) -> Kept | None:
        """Return what is kept of it; None where nothing is, or what is was made otherwise."""
        try:
            data = json.loads(self._place(measurement).read_text(encoding="utf-8"))
        except FileNotFoundError:
            return None
        if data["fingerprint"] != measurement.fingerprint():
            return None
        return Kept(data["found"], data["day"], data["processor_s"])

    def keep(self, measurement: Measurement, found: Any, processor_s: float) -> Kept:
        """Keep what was found; a file is there as a whole or not at all."""
        kept = Kept(found, date.today().isoformat(), processor_s)
        data = {
            "name": measurement.name,
            "fingerprint": measurement.fingerprint(),
            **kept._asdict(),
        }
        self._folder.mkdir(parents=True, exist_ok=True)
        place = self._place(measurement)
        unfinished = place.with_suffix(".part")
        unfinished.write_text(json.dumps(data), encoding="utf-8")
        os.replace(unfinished, place)
        return kept

    def _place(self, measurement: Measurement) -> Path:
        signed = measurement.name.replace("+", "plus ").replace("−", "minus ")
        return self._folder / (re.sub(r"\W+", "_", signed) + ".json")


@cache
def code_hash() -> str:
    """Return a hash of what the code says that measurements are made with."""
    digest = hashlib.sha256()
    for path in _code():
        digest.update(str(path.relative_to(ROOT)).encode())
        digest.update(spoken(path.read_text(encoding="utf-8")).encode())
    return digest.hexdigest()


def spoken(source: str) -> str:
    """Return what Python code does, without comments, docstrings and layout."""
    tree = ast.parse(source)
    for node in ast.walk(tree):
        body = getattr(node, "body", None)
        if isinstance(body, list):
            node.body = [each for each in body if not _is_text(each)]  # type: ignore[attr-defined]
    return ast.dump(tree)


def _is_text(node: ast.AST) -> bool:
    is_constant = isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant)
    return is_constant and isinstance(node.value.value, str)  # type: ignore[attr-defined]


@cache
def _code() -> tuple[Path, ...]:
    found: set[Path] = set()
    for name in MADE_WITH:
        path = ROOT / name
        found |= {path} if path.is_file() else set(path.rglob("*.py"))
    for name in NOT_MADE_WITH:
        found = {path for path in found if not path.is_relative_to(ROOT / name)}
    return tuple(sorted(found))


@cache
def _testbeds() -> tuple[Path, ...]:
    return tuple(sorted((SCENARIOS / "testbeds").glob("*.yaml")))
