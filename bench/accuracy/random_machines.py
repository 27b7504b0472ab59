"""Whether machines drawn at random run and are analysed on their files alone.

`python -m bench.accuracy.random_machines [COUNT] [--first-seed N] [--processes N]`
runs each machine for 4 s with the gains that are designed for it, and analyses design, linear
model, manipulability and workspace. Wild is a run that errs by more than 3 % of the machine's size
or 0.1 rad, or diverges. What matters is that none is wild without a warning.
"""

from __future__ import annotations

import argparse
import tempfile
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import as_completed
from pathlib import Path
from typing import Any, NamedTuple

from rich.console import Console
from rich.table import Table

import cspm
from bench.accuracy.drawn_machine import DrawnMachine, drawn_machine
from cspm.campaign.cluster import worker_pool

COUNT = 200
# Of the machine's size, and in rad.
WILD_SHARE, WILD_ANGLE = 0.03, 0.1
COARSE = 8
WELL, WARNED, WILD, REFUSED, BROKEN = "well", "warned of", "wild, unwarned", "refused", "broken"


class Outcome(NamedTuple):
    """What came of a machine.

    Attributes:
        seed: of the machine.
        verdict: one of `WELL`, `WARNED`, `WILD`, `REFUSED` and `BROKEN`.
        said: the warnings, the refusal, or what was raised.
        analyses: by name, what an analysis raised; those that gave a result are not there.
    """

    seed: int
    verdict: str
    said: tuple[str, ...]
    analyses: Mapping[str, str]


def outcome(seed: int) -> Outcome:
    """Return what comes of the machine of a seed."""
    drawn = drawn_machine(seed)
    with tempfile.TemporaryDirectory() as folder:
        path = drawn.save(Path(folder))
        verdict, said = _run(drawn, path)
        return Outcome(seed, verdict, said, _analysed(path))


def _run(drawn: DrawnMachine, path: Path) -> tuple[str, tuple[str, ...]]:
    try:
        run = cspm.simulate(path)
    except cspm.CspmError as error:
        return REFUSED, (str(error),)
    except Exception as error:
        return BROKEN, (repr(error),)
    said = (*run.summary["warnings"], *([run.failure] if run.failure else []))
    if said:
        return WARNED, said
    return (WILD if is_wild(run.summary, drawn.size) else WELL), (_largest(run.summary),)


def is_wild(summary: Mapping[str, Any], size: float) -> bool:
    """Return whether a run erred by more than is usual, from its summary and a size [m]."""
    return any(
        summary["errors"][dof]["max"]
        > (WILD_SHARE * size if dof in ("surge", "sway", "heave") else WILD_ANGLE)
        for dof in summary["controlled"]
    )


def _largest(summary: Mapping[str, Any]) -> str:
    worst = max(summary["controlled"], key=lambda dof: float(summary["errors"][dof]["max"]))
    return f"{worst} {summary['errors'][worst]['max']:.3g}"


def _analysed(path: Path) -> dict[str, str]:
    """Return by analysis what it raised."""
    analyses: dict[str, Callable[[], Any]] = {
        "design": lambda: cspm.analyze_design(path).data(),
        "linear": lambda: cspm.analyze_linear(path).data(),
        "manipulability": lambda: cspm.analyze_manipulability(path).data(),
        "workspace": lambda: cspm.analyze_workspace(path, coarse=COARSE).data(),
    }
    raised = {}
    for name, analyse in analyses.items():
        try:
            analyse()
        except Exception as error:
            kind = "" if isinstance(error, cspm.CspmError) else f"{type(error).__name__}: "
            raised[name] = f"{kind}{error}"
    return raised


def table_of(found: Sequence[Outcome]) -> Table:
    """Return how many machines there are of each verdict, and how many analyses raised."""
    table, counts = Table("", "machines"), Counter(each.verdict for each in found)
    for verdict in (WELL, WARNED, WILD, REFUSED, BROKEN):
        table.add_row(verdict, str(counts[verdict]))
    for name, count in sorted(Counter(n for each in found for n in each.analyses).items()):
        table.add_row(f"analysis refused: {name}", str(count))
    return table


def main() -> None:
    """Draw, run and analyse, and print what came of it."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("count", type=int, nargs="?", default=COUNT, help="machines")
    parser.add_argument("--processes", type=int, default=1, help="machines at a time")
    parser.add_argument("--first-seed", type=int, default=1, help="others give other machines")
    options = parser.parse_args()
    console, found = Console(), []
    seeds = range(options.first_seed, options.first_seed + options.count)
    with worker_pool(options.processes) as pool:
        for each in as_completed([pool.submit(outcome, seed) for seed in seeds]):
            found.append(each.result())
            last = found[-1]
            console.print(f"{last.seed}: {last.verdict}: {'; '.join(last.said)}", soft_wrap=True)
            for name, line in last.analyses.items():
                console.print(f"{last.seed}: analyze {name}: {line}", soft_wrap=True)
    console.print(table_of(found))


if __name__ == "__main__":
    main()
