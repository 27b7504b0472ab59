"""A campaign from its file to its folder."""

from __future__ import annotations

import json
import shlex
from collections.abc import Callable, Iterator, Sequence
from contextlib import AbstractContextManager
from dataclasses import dataclass
from itertools import islice
from pathlib import Path
from typing import Any

from distributed import Client

from cspm.campaign.campaign_file import CampaignFile, Kept, load_campaign
from cspm.campaign.campaign_folder import RECORDINGS, CampaignFolder, Row
from cspm.campaign.cluster import local_client, remote_client
from cspm.campaign.code_version import code_version
from cspm.campaign.inputs import Inputs, pack
from cspm.campaign.measures import load_metric
from cspm.campaign.task import DONE, FAILED, STATUS, Task, bundle_for, check_values
from cspm.campaign.variants import Variant, variants_of
from cspm.campaign.work import work
from cspm.progress import Progress, silent
from cspm.simulation import simulate_in_memory
from cspm_msgs_py.errors import InputError
from cspm_msgs_py.recording.run_record import SIM
from cspm_msgs_py.scenario import load_scenario
from cspm_msgs_py.yaml_file import read_text
from cspm_run.library import find_scenario, find_testbed, scenario_names, testbed_names

SCHEMA = "cspm.campaign/1"
# A run that takes longer hangs: starting, and the slowest plant and controllers there are [s].
_START_S, _PER_SECOND, _JUDGED = 120.0, 2.0, 10.0
# Distinct values that are checked before anything runs.
_MOST_CHECKS = 40
_DURATION = "duration="


@dataclass(frozen=True)
class Campaign:
    """What a campaign amounted to.

    Attributes:
        file: what was asked for.
        folder: where it is kept.
        variants: its runs.
        rows: columns of the runs that ended, in the order of their numbers.
        interrupted: whether it was ended early.
    """

    file: CampaignFile
    folder: Path
    variants: list[Variant]
    rows: list[Row]
    interrupted: bool = False

    @property
    def failures(self) -> list[Row]:
        """Rows of runs that did not go to their ends."""
        return [row for row in self.rows if row[STATUS] != DONE]

    def command_of(self, number: int) -> str:
        """Return the command that repeats a run."""
        return command_of(self.variants[number], self.file.plant)


def run_campaign(
    file: str | Path,
    out: str | Path,
    *,
    workers: int | None = None,
    scheduler: str | None = None,
    time_limit: float | None = None,
    progress: Progress = silent,
    tell: Callable[[str], None] = lambda _: None,
    stop: Callable[[], bool] = lambda: False,
) -> Campaign:
    """Make the runs of a campaign that its folder does not have yet.

    Each run is the one that `cspm run` makes with the same values, bit for bit.

    Args:
        file: the campaign's file; see `docs/how-to/run-a-campaign.md`.
        out: a folder, new or one that the same campaign began.
        workers: processes of a cluster on this computer; None: one per processor.
        scheduler: address of a dask scheduler instead.
        time_limit: after which a run counts as hung [s]; None: by its duration.
        progress: called now and then with the share that is done and what is being done.
        tell: takes a line about what is not as it should be.
        stop: looked at now and then; once true, the campaign ends, and can go on later.

    Raises:
        InputError: the file has a fault, the folder is another campaign's, or workers are unfit.
        CspmError: the scheduler was lost.
    """
    plan = plan_of(Path(file), time_limit)
    with CampaignFolder(Path(out), plan.description) as folder:
        missing = [each for each in plan.variants if each.number not in folder.rows]
        if missing:
            plan.check(missing)
            progress(0.0, "starting workers")
            with _client(workers, scheduler) as client:
                tell(f"dashboard {client.dashboard_link}")
                total = len(plan.variants)
                for number, row in work(client, map(plan.task, missing), stop, tell):
                    folder.keep(number, plan.variants[number].values | row)
                    progress(len(folder.rows) / total, f"run {len(folder.rows)} of {total}")
        rows = [folder.rows[number] for number in sorted(folder.rows)]
        done = Campaign(plan.file, folder.path, plan.variants, rows, stop())
        if len(rows) == len(plan.variants):
            _record(plan, done)
    return done


@dataclass(frozen=True)
class Plan:
    """What a campaign's file asks for.

    Attributes:
        path: of the file.
        file: its content.
        variants: the runs.
        inputs: what they read.
        durations: of the scenarios, by file [s].
        time_limit_s: after which a run counts as hung [s]; None: by its duration.
    """

    path: Path
    file: CampaignFile
    variants: list[Variant]
    inputs: Inputs
    durations: dict[str, float]
    time_limit_s: float | None = None

    @property
    def description(self) -> dict[str, Any]:
        """What tells this campaign from another."""
        return {
            "schema": SCHEMA,
            "file": read_text(self.path),
            "inputs_sha256": self.inputs.sha256,
            "code": code_version(),
        }

    def task(self, variant: Variant) -> Task:
        """Return a run as a worker takes it."""
        file, limit = self.file, self.time_limit_s
        return Task(
            variant=variant,
            packed=self.inputs.packed,
            places=self.inputs.places,
            plant=file.plant,
            metrics=file.metrics,
            diagnose=file.diagnose,
            time_limit_s=self._limit(variant) if limit is None else limit,
            code=code_version(),
        )

    def _limit(self, variant: Variant) -> float:
        """Return how long a run may take [s]."""
        changed = [each for each in variant.overrides if each.startswith(_DURATION)]
        own = float(json.loads(changed[0].removeprefix(_DURATION))) if changed else None
        duration = self.durations[variant.scenario] if own is None else own
        judged = _JUDGED if self.file.diagnose or self.file.metrics else 1.0
        return judged * (_START_S + _PER_SECOND * duration)

    def check(self, variants: Sequence[Variant]) -> None:
        """Check the first run whole, and values that others have.

        Raises:
            InputError: naming the run and what is wrong with it.
        """
        for name in self.file.metrics:
            path = Path(name.rpartition(":")[0])
            load_metric(name, path if path.is_absolute() else None)
        try:
            bundle_for(self.task(variants[0]))
            for each in islice(_with_other_values(variants), _MOST_CHECKS):
                check_values(self.task(each))
        except InputError as err:
            raise InputError(f"{self.path}: {err}") from None


def plan_of(path: Path, time_limit: float | None = None) -> Plan:
    """Return the runs of a campaign's file.

    Raises:
        InputError: the file has a fault.
    """
    file = load_campaign(path)
    try:
        variants = variants_of(file)
    except InputError as err:
        raise InputError(f"{path}: {err}") from None
    _check_kept(path, file.recordings, len(variants))
    scenarios = dict.fromkeys(each.scenario for each in variants)
    durations = {each: load_scenario(Path(each)).duration for each in scenarios}
    return Plan(path, file, variants, pack(variants, file.metrics), durations, time_limit)


def command_of(variant: Variant, plant: str) -> str:
    """Return the command that makes a variant's run by itself."""
    words = ["cspm", "run", _short(variant.scenario, find_scenario, scenario_names())]
    if variant.testbed is not None:
        words += ["--testbed", _short(variant.testbed, find_testbed, testbed_names())]
    words += [] if plant == SIM else ["--plant", plant]
    for override in variant.overrides:
        words += ["--set", override]
    for effect in variant.effects:
        words += ["--effect", effect]
    return shlex.join(words)


def _client(workers: int | None, scheduler: str | None) -> AbstractContextManager[Client]:
    if scheduler is not None:
        return remote_client(scheduler)
    return local_client(workers)


def _short(path: str, find: Callable[[str], Path], names: Sequence[str]) -> str:
    """Return the library's name of a file that is in it."""
    stem = Path(path).stem
    return stem if stem in names and find(stem).resolve() == Path(path) else path


def _with_other_values(variants: Sequence[Variant]) -> Iterator[Variant]:
    """Return variants in which a value comes for the first time."""
    seen: set[tuple[str, str]] = set()
    for variant in variants:
        new = {(key, repr(value)) for key, value in variant.values.items()} - seen
        if new:
            seen |= new
            yield variant


def _check_kept(path: Path, kept: Kept, count: int) -> None:
    outside = [number for number in kept.runs if number >= count]
    if outside:
        raise InputError(f"{path}: recordings.runs: {outside[0]}, allowed: 0 to {count - 1}")


def _record(plan: Plan, done: Campaign) -> None:
    """Make recordings of the chosen runs: the same runs again, bit for bit."""
    for number in chosen(plan.file.recordings, done.rows):
        place = done.folder / RECORDINGS / f"run_{number}"
        if place.exists():
            continue
        bundle, _ = bundle_for(plan.task(plan.variants[number]))
        run = simulate_in_memory(bundle, {}, lambda _: None)
        run.save(place)
        run.draw(place / "run.png")


def chosen(kept: Kept, rows: Sequence[Row]) -> list[int]:
    """Return the numbers of the runs to record: those named, then the worst.

    Raises:
        InputError: there is no such column of numbers.
    """
    found = dict.fromkeys(kept.runs)
    if kept.worst and kept.of is not None:
        found |= dict.fromkeys(row["run"] for row in worst(rows, kept.of)[: kept.worst])
    refused = {row["run"] for row in rows if row[STATUS] not in (DONE, FAILED)}
    return [number for number in found if number not in refused]


def worst(rows: Sequence[Row], column: str) -> list[Row]:
    """Return the rows that have a number in a column, the largest first.

    Raises:
        InputError: no row has.
    """
    found = [row for row in rows if isinstance(row.get(column), (int, float))]
    if rows and not found:
        allowed = [name for name, value in rows[0].items() if isinstance(value, float)]
        raise InputError(f"recordings.of: {column}, allowed: {', '.join(allowed)}")
    return sorted(found, key=lambda row: -row[column])
