"""Whether machines drawn at random run and are analysed on their files alone.

`python -m bench.accuracy.random_machines [COUNT] [--first-seed N] [--processes N] [--page FILE]`
runs each machine for 4 s by `cspm run`, with the gains that are designed for it, and analyses
design, linear model, manipulability and workspace. A run is unsteady that errs by more than 3 % of
the machine's size or 0.1 rad, that shakes, grows, has slack cables or a wrench unmet. One that is
so without a warning runs again for two turns without sensors' noise: what grows or shakes then is
unstable, and that matters; the others shake by noise or follow badly, and are stable.
`--whole N` takes the first N machines the whole way: `bench.accuracy.whole_way`.
"""

from __future__ import annotations

import argparse
import tempfile
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import Executor, as_completed
from pathlib import Path
from typing import Any, NamedTuple

from rich.console import Console

import cspm
from bench.accuracy.drawn_machine import DrawnMachine, drawn_machine
from bench.accuracy.judged_run import judged_run
from bench.accuracy.quiet_twin import instabilities
from bench.accuracy.whole_way import HEADS, whole_way
from bench.markdown import markdown_table
from cspm.campaign.cluster import worker_pool

COUNT, WHOLE = 200, 6
COARSE = 8
PAGE = Path("results/random-machines.md")
WELL, WARNED, ROUGH, WILD = "well", "warned of", "rough, yet stable", "unstable, unwarned"
REFUSED, BROKEN = "refused", "broken"
# What the page says of it.
ROUGH_MEANS = (
    "Rough is a run that shakes by more than 10 % of the mean tension, or errs by more than 3 % of"
    " the machine's size or 0.1 rad, without a warning. It is stable if without sensors' noise"
    " nothing shakes or grows in two turns."
)
VERDICTS = (WELL, WARNED, ROUGH, WILD, REFUSED, BROKEN)


class Outcome(NamedTuple):
    """What came of a machine.

    Attributes:
        seed: of the machine.
        verdict: one of `VERDICTS`.
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
        run = judged_run(path, path.with_suffix(".recording"), drawn.size)
        if run.unsteady and not run.said:
            found = instabilities(drawn, path.parent / "quiet")
            return (WILD, (*run.unsteady, *found)) if found else (ROUGH, run.unsteady)
    except cspm.CspmError as error:
        return REFUSED, (str(error),)
    except Exception as error:
        return BROKEN, (repr(error),)
    if run.said:
        return WARNED, (*run.said, *run.unsteady)
    return WELL, (run.largest,)


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


def table_of(found: Sequence[Outcome]) -> str:
    """Return in Markdown how many machines there are of each verdict, and of analyses refused."""
    counts = Counter(each.verdict for each in found)
    rows = [(verdict, str(counts[verdict])) for verdict in VERDICTS]
    refused = Counter(name for each in found for name in each.analyses)
    rows += [(f"analysis refused: {name}", str(count)) for name, count in sorted(refused.items())]
    return markdown_table(("", "machines"), rows)


def page_of(found: Sequence[Outcome], whole: Sequence[Sequence[str]], seeds: range) -> str:
    """Return the page: counts, each machine that is not well, and those taken the whole way."""
    others = [each for each in sorted(found) if each.verdict != WELL or each.analyses]
    rows = [
        (
            str(each.seed),
            each.verdict,
            "; ".join((*each.said, *map(": ".join, each.analyses.items()))),
        )
        for each in others
    ]
    return (
        "\n\n".join(
            [
                "# Machines drawn at random",
                f"Made by `python -m bench.accuracy.random_machines {len(seeds)}"
                f" --first-seed {seeds.start} --whole {len(whole)}`: 3 to 9 cables, gears, pulleys,"
                " 1 to 4 parts, 0.1 to 500 kg, each 4 s of a circle on its file alone.",
                ROUGH_MEANS,
                table_of(found),
                "## Machines taken the whole way",
                "Run, viewed offline, and diagnosed from a recording of 24 s of the machine with"
                " more Coulomb friction in one winch than its file says.",
                markdown_table(HEADS, whole),
                "## Those that are not well",
                markdown_table(("seed", "verdict", "said, and seen"), rows),
            ]
        )
        + "\n"
    )


def main() -> None:
    """Draw, run and analyse, print what came of it, and write the page."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("count", type=int, nargs="?", default=COUNT, help="machines")
    parser.add_argument("--processes", type=int, default=1, help="machines at a time")
    parser.add_argument("--first-seed", type=int, default=1, help="others give other machines")
    parser.add_argument("--whole", type=int, default=WHOLE, help="machines taken the whole way")
    parser.add_argument("--page", type=Path, help=f"to write, such as {PAGE}")
    options = parser.parse_args()
    console = Console()
    seeds = range(options.first_seed, options.first_seed + options.count)
    with worker_pool(options.processes) as pool:
        found = _collected(pool, seeds, console)
        whole = [row for row in pool.map(whole_way, seeds[: options.whole])]
    console.print(table_of(found), markup=False, soft_wrap=True)
    console.print(markdown_table(HEADS, whole), markup=False, soft_wrap=True)
    if options.page:
        options.page.write_text(page_of(found, whole, seeds), encoding="utf-8")


def _collected(pool: Executor, seeds: range, console: Console) -> list[Outcome]:
    """Return what came of each machine, each printed when it is done."""
    found = []
    for each in as_completed([pool.submit(outcome, seed) for seed in seeds]):
        last = each.result()
        found.append(last)
        lines = [f"{last.verdict}: {'; '.join(last.said)}"]
        lines += [f"analyze {name}: {line}" for name, line in last.analyses.items()]
        for line in lines:
            console.print(f"{last.seed}: {line}", markup=False, soft_wrap=True)
    return found


if __name__ == "__main__":
    main()
