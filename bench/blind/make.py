"""Make the recordings of a blind benchmark, and its truth apart from them."""

from __future__ import annotations

import json
import os
import shutil
from collections.abc import Iterator, Mapping, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, wait
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from bench.blind.blank_runs import Amounts, Tell, run_blank
from bench.blind.concealed_run import believed, machine_of, record_concealed
from bench.blind.item import Item, amounts_of, draw_items, truth_of
from bench.blind.jobs import jobs_of
from bench.blind.reality.alterations import surveyed
from bench.blind.reality.phenomena import PHENOMENA
from bench.blind.reality.reality import conceal
from bench.blind.reality.sensors import QUALITIES, REAL
from bench.blind.strata import STRATA
from bench.blind.truth import RECORDINGS, SCHEMA, SPLITS, truth_sha256
from cspm.campaign.cluster import worker_pool
from cspm_msgs_py.errors import DivergenceError, InputError

SHORTEST, LONGEST = 15.0, 200.0  # [s]
LARGEST_SURVEY = 0.01  # beyond it the controllers lose the bar [m]
# Of a number of the file, more is not taken over by an effect: it stays positive.
MOST_ABSORBED = 0.8
_PUBLISHED = ("seed", "count", "split", "duration", "sensors", "survey")
_ONE_DATE = 1_000_000_000  # of all files, so that it shows no order [s]


@dataclass(frozen=True)
class Request:
    """A benchmark as it was requested.

    Attributes:
        folder: for the recordings.
        truth: the file of the truth.
        seed: of everything that is drawn; with it the truth can be drawn again.
        count: of recordings.
        split: one of `SPLITS`, which have nothing in common.
        strata: names, of which the recordings are.
        duration: of each recording [s].
        sensors: one of `QUALITIES`.
        survey: standard deviation of the places of exits and attachments in half of the recordings
            [m].
    """

    folder: Path
    truth: Path
    seed: int
    count: int
    split: str
    strata: tuple[str, ...]
    duration: float
    sensors: str = REAL
    survey: float = 0.0

    def published(self) -> dict[str, Any]:
        """Return what the truth file keeps of it."""
        published = {key: getattr(self, key) for key in _PUBLISHED}
        return {**published, "strata": list(self.strata)}


def make(
    request: Request, tell: Tell = lambda text, done, total: None, jobs: int | None = None
) -> str:
    """Make what is not there yet, and return the truth file's SHA-256.

    Args:
        request: what to make.
        tell: called with what is being done, how much of it is done, and how much there is.
        jobs: recordings at a time; None: as many as there are processors.

    Raises:
        InputError: the truth lies among the recordings, or is that of another benchmark; no jobs.
    """
    processes = jobs_of(jobs)
    _check(request)
    if not request.truth.exists():
        _write_truth(request, tell)
    truth = json.loads(request.truth.read_text(encoding="utf-8"))
    if truth.get("asked") != request.published():
        raise InputError(
            f"{request.truth}: of another benchmark ({truth.get('asked')}), allowed: the same"
            " options, to go on with it, or a new file"
        )
    digest = truth_sha256(request.truth)
    tell(f"truth {request.truth}, SHA-256 {digest}", 0, request.count)
    items = _items(request)
    if [item.name for item in items] != [each["name"] for each in truth["items"]]:
        raise InputError(
            f"{request.truth}: drawn by another version of cspm, allowed: to be gone on with by"
            " that, or a new file"
        )
    amounts = [each["amounts"] for each in truth["items"]]
    tell("recording", 0, request.count)
    for done in _recorded(request, items, amounts, processes):
        tell(f"recording, {done} made", done, request.count)
    shutil.rmtree(request.folder / ".part", ignore_errors=True)
    tell("recordings made", request.count, request.count)
    return digest


def _recorded(
    request: Request, items: Sequence[Item], amounts: Sequence[Amounts], jobs: int
) -> Iterator[int]:
    """Record what is not there, and yield how much is made."""
    missing = [k for k, item in enumerate(items) if not _place(request, item).exists()]
    there = len(items) - len(missing)
    if min(jobs, len(missing)) < 2:
        for done, k in enumerate(missing, start=1):
            _record(request, items[k], amounts[k])
            yield there + done
        return
    running: set[Future[None]] = set()
    # MuJoCo's control callback is one per process, so that each has a run at a time.
    with worker_pool(jobs) as pool:
        while missing or running:
            # What waits in a pool cannot be called off when the user ends the command.
            while missing and len(running) < jobs:
                k = missing.pop(0)
                running.add(pool.submit(_record, request, items[k], amounts[k]))
            ended, running = wait(running, return_when=FIRST_COMPLETED)
            for task in ended:
                task.result()
                there += 1
                yield there


def _check(request: Request) -> None:
    for name in request.strata:
        if name not in STRATA:
            raise InputError(f"--strata {name}: allowed: {', '.join(STRATA)}")
    if request.split not in SPLITS:
        raise InputError(f"--split {request.split}: allowed: {', '.join(SPLITS)}")
    if request.count < 1:
        raise InputError(f"--count {request.count}: allowed: 1 or more")
    if request.sensors not in QUALITIES:
        raise InputError(f"--sensors {request.sensors}: allowed: {', '.join(QUALITIES)}")
    if not 0.0 <= request.survey <= LARGEST_SURVEY:
        most = 1e3 * LARGEST_SURVEY
        raise InputError(f"--survey {1e3 * request.survey:g}: allowed: 0 to {most:g} mm")
    if not SHORTEST <= request.duration <= LONGEST:
        raise InputError(f"--duration {request.duration:g}: allowed: {SHORTEST:g} to {LONGEST:g} s")
    if request.folder.resolve() in request.truth.resolve().parents:
        raise InputError(f"--truth {request.truth}: allowed: a file outside {request.folder}")


def _items(request: Request) -> list[Item]:
    seed = request.seed * len(SPLITS) + SPLITS.index(request.split)
    strata = [STRATA[name] for name in request.strata]
    return draw_items(strata, request.count, seed, request.duration, machine_of)


def _write_truth(request: Request, tell: Tell) -> None:
    """Fix the limits and the truth before anything is recorded."""
    items = _items(request)
    blank = run_blank(items, request.duration, tell)
    reported = []
    for item in items:
        machine = machine_of(item.scenario)
        amounts = amounts_of(item, blank.limits[item.scenario], len(machine.cables))
        amounts |= _absorbed(item, amounts, blank.shares)
        reported.append(
            {
                **truth_of(item, blank.likened(item, amounts), machine),
                "amounts": amounts,
                "survey_m": _survey(request, item),
            }
        )
    content = {
        "schema": SCHEMA,
        "asked": request.published(),
        "limits": blank.limits,
        "items": reported,
    }
    request.truth.parent.mkdir(parents=True, exist_ok=True)
    part = request.truth.with_suffix(".part")
    part.write_text(json.dumps(content, indent=1, ensure_ascii=False), encoding="utf-8")
    part.replace(request.truth)


def _absorbed(
    item: Item,
    amounts: Mapping[str, Sequence[float]],
    shares: Mapping[tuple[str, str, str], Sequence[float]],
) -> dict[str, list[float]]:
    """Return by how much the machine's number lies beside that of the file, fitted too much."""
    number = item.case.absorbed_by
    if number is None:
        return {}
    (name,) = amounts
    machine = machine_of(item.scenario)
    sizes = [
        c.drum_radius if number == "radius" else PHENOMENA[number].base for c in machine.cables
    ]
    found = []
    for amount, share, size in zip(
        amounts[name], shares[item.scenario, name, number], sizes, strict=True
    ):
        most = MOST_ABSORBED * size
        found.append(-min(most, max(-most, amount * share)))
    return {number: found}


def _place(request: Request, item: Item) -> Path:
    return request.folder / RECORDINGS / item.name


def _survey(request: Request, item: Item) -> float:
    """Return the survey's standard deviation in a recording [m]; every second seed has none."""
    return request.survey if item.seed % 2 else 0.0


def _record(request: Request, item: Item, amounts: Amounts) -> None:
    """Record an item; what diverges leaves an empty folder of that name."""
    folder = _place(request, item)
    part = request.folder / ".part" / item.name
    shutil.rmtree(part, ignore_errors=True)
    bundle = believed(item.scenario, request.duration, item.seed)
    generator = np.random.default_rng([item.seed, 11])
    machine = surveyed(bundle.testbed.testbed, _survey(request, item), generator)
    reality = conceal(machine, amounts, item.onset, item.seed, request.sensors)
    note = f"The operator suspects {item.note}.\n".ljust(80)
    folder.parent.mkdir(parents=True, exist_ok=True)
    try:
        record_concealed(
            bundle, reality, part, note=note, without=item.case.without, progress=lambda now: None
        )
    except DivergenceError:
        shutil.rmtree(part, ignore_errors=True)
        part.mkdir(parents=True)
    for path in (*part.iterdir(), part):
        os.utime(path, (_ONE_DATE, _ONE_DATE))
    part.rename(folder)
    os.utime(folder, (_ONE_DATE, _ONE_DATE))
