"""What the commands of the blind benchmark do, behind the command line."""

from __future__ import annotations

import json as json_format
import os
import platform
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from datetime import date
from importlib.metadata import version
from pathlib import Path
from typing import Any

from rich.console import Console
from rich.markup import escape
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

from bench.blind.diagnose_all import run
from bench.blind.scoring.comparison import comparison
from bench.blind.scoring.method import ABLATED, CSPM, PEERS
from bench.blind.scoring.page import scorecard_page
from bench.blind.scoring.scorecard import scorecard
from bench.blind.scorings import enter_scoring
from bench.blind.stored_results import read_results, tried
from bench.blind.truth import SEALED, read_truth, truth_sha256
from cspm_msgs_py.errors import InputError
from cspm_run.output.console import make_console, say
from cspm_run.output.json_file import write_json
from cspm_run.plants import require_mujoco


def make_command(
    folder: Path,
    truth: Path,
    seed: int,
    count: int,
    split: str,
    strata: tuple[str, ...],
    duration: float,
    sensors: str,
    survey: float,
    jobs: int | None,
) -> None:
    """Make a benchmark; see `make`.

    Raises:
        InputError: MuJoCo, which makes the recordings, is not installed.
    """
    require_mujoco("blind make")
    from bench.blind.make import Request, make
    from bench.blind.strata import STRATA

    console = make_console()
    ways = strata or tuple(STRATA)
    options = Request(
        folder, truth, seed, count, split, ways, duration, sensors, survey=1e-3 * survey
    )
    with progress_bar(console) as show:
        make(options, show, jobs)


def run_command(folder: Path, methods: Sequence[str], jobs: int | None) -> None:
    """Diagnose a benchmark's recordings; see `run`."""
    console = make_console()
    with progress_bar(console) as show:
        failed = run(folder, show, methods, jobs)
    for name, reason in failed.items():
        say(console, f"{name}: {reason}")


def score_command(
    folder: Path, truth: Path, sha256: str | None, page: Path | None, json: Path | None
) -> None:
    """Open the truth, check that it is the sealed one, and score.

    Raises:
        InputError: no truth, another than that of the hash, or a sealed one that was opened before.
    """
    console = make_console()
    content = read_truth(truth)
    found = truth_sha256(truth)
    if sha256 is not None and sha256.lower() != found:
        raise InputError(f"{truth}: SHA-256 {found}, allowed: that of --sha256, {sha256}")
    names = [item["name"] for item in content["items"]]
    results = {
        method: read_results(folder, names, method)
        for method in (CSPM, *tried(folder, (*PEERS, *ABLATED)))
    }
    if content["asked"]["split"] == SEALED:
        enter_scoring(truth, found, results, date.today())
    card = scorecard(content, results[CSPM]) | {
        "peers": _compared(content, results, PEERS),
        "ablations": _compared(content, results, ABLATED),
    }
    machine = (
        f"{date.today()} on {os.cpu_count()} processors ({platform.machine()}), cspm"
        f" {version('cspm')}"
    )
    say(console, scorecard_page(card, found, machine))
    if page is not None:
        from bench.blind.scoring.figure import draw_scorecard

        picture = page.with_suffix(".png")
        draw_scorecard(picture, card)
        page.write_text(scorecard_page(card, found, machine, picture.name), encoding="utf-8")
    if json is not None:
        write_json(json, json_format.loads(json_format.dumps(card)) | {"truth_sha256": found})


def _compared(
    truth: Mapping[str, Any],
    results: Mapping[str, Mapping[str, Mapping[str, Any]]],
    methods: Sequence[str],
) -> list[dict[str, Any]]:
    """Return the rows of the diagnosis and of those methods that were tried, none of it alone."""
    those = {name: results[name] for name in (CSPM, *methods) if name in results}
    return comparison(truth, those) if len(those) > 1 else []


@contextmanager
def progress_bar(console: Console) -> Iterator[Callable[[str, int, int], None]]:
    """Give what shows progress with the time left; where nobody looks, one line per change."""
    with Progress(
        TextColumn("{task.description}"),
        BarColumn(),
        MofNCompleteColumn(),
        TimeRemainingColumn(),
        console=console,
        disable=not console.is_terminal,
    ) as bar:
        task = bar.add_task("", total=None)

        def show(text: str, done: int, total: int) -> None:
            bar.update(task, description=escape(text), completed=done, total=total)
            if not console.is_terminal or "SHA-256" in text:
                say(console, f"{done} of {total}: {text}")

        yield show
