"""Simulating many variants at once."""

from __future__ import annotations

import os
from collections import deque
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping
from concurrent.futures import Future, ThreadPoolExecutor
from typing import Any

from cspm.progress import Progress, silent
from cspm.reference import with_reference
from cspm.scenario import as_scenario, with_changes
from cspm.simulation import Run, bundle_of, simulate_in_memory, warn_of
from cspm.testbed import as_file
from cspm_msgs_py.errors import InputError
from cspm_msgs_py.new_folder import ScratchFolder
from cspm_msgs_py.recording.run_record import SIM
from cspm_run.plants import check_plant_name

Variant = Mapping[str, Any]

SETTINGS = ("scenario", "testbed", "duration", "seed", "controllers", "reference", "plant")
# Runs underway or waiting for the caller, for each worker: none idles, and few are kept.
AHEAD = 2


def simulate_many(
    variants: Iterable[Variant],
    *,
    signals: Collection[str] | None = None,
    workers: int | None = None,
    progress: Progress = silent,
) -> Iterator[Run]:
    """Simulate variants side by side, and yield their runs in order.

    Each run is the one that `simulate` gives for the same settings, bit for bit, whatever else
    runs beside it. Compiled steps of several runs go on at once, a thread each; what is in Python,
    such as controllers of one's own, takes turns.

    Args:
        variants: settings of a run each: `scenario`, and what else `simulate` takes among
            `testbed`, `duration`, `seed`, `controllers`, `reference` and `plant`. They may be made
            as they are taken: few are ahead of the run that is yielded.
        signals: topics that runs keep; None: all. Without any a run keeps its `summary` alone and
            takes half the time.
        workers: how many runs go on at once; absent: one per processor.
        progress: called now and then with the share that is done and what is being done; the
            share is 0 where `variants` has no length.

    Raises:
        InputError: as `simulate`, naming the variant by its place, or a setting that none has.
        CspmError: as `simulate`.

    Warns:
        RuntimeWarning, UserWarning: as `simulate`.

    Examples:
        >>> import cspm
        >>> seeds = [{"scenario": "calm", "duration": 0.2, "seed": seed} for seed in (1, 2)]
        >>> [run.summary["seed"] for run in cspm.simulate_many(seeds, signals=())]
        [1, 2]
    """
    count = workers or os.cpu_count() or 1
    if count < 1:
        raise InputError(f"workers: {count}, allowed: 1 or more")
    total = len(variants) if isinstance(variants, Collection) else 0
    kept = None if signals is None else tuple(signals)
    return _runs(variants, kept, count, lambda done: _show(progress, done, total))


def _runs(
    variants: Iterable[Variant],
    kept: tuple[str, ...] | None,
    workers: int,
    done: Callable[[int], None],
) -> Iterator[Run]:
    waiting: deque[Future[Run]] = deque()
    with ThreadPoolExecutor(workers, thread_name_prefix="simulation") as pool:
        try:
            for place, variant in enumerate(variants):
                waiting.append(pool.submit(_simulated, place, variant, kept))
                if len(waiting) > AHEAD * workers:
                    yield _finished(waiting.popleft())
                    done(place + 1 - len(waiting))
            while waiting:
                yield _finished(waiting.popleft())
        finally:
            for future in waiting:
                future.cancel()


def _finished(future: Future[Run]) -> Run:
    run = future.result()
    warn_of(run, stacklevel=4)
    return run


def _show(progress: Progress, done: int, total: int) -> None:
    progress(done / total if total else 0.0, "simulating")


def _simulated(place: int, variant: Variant, kept: tuple[str, ...] | None) -> Run:
    try:
        return _run_of(variant, kept)
    except InputError as err:
        raise InputError(f"variant {place}: {err}") from None


def _run_of(variant: Variant, kept: tuple[str, ...] | None) -> Run:
    unknown = [name for name in variant if name not in SETTINGS]
    if unknown or "scenario" not in variant:
        what = f"{', '.join(unknown)}: no setting" if unknown else "scenario: missing"
        raise InputError(f"{what}, allowed: scenario, and of {', '.join(SETTINGS[1:])}")
    plant = variant.get("plant", SIM)
    check_plant_name(plant, "plant")
    duration, seed = variant.get("duration"), variant.get("seed")
    chosen = with_changes(as_scenario(variant["scenario"]), duration=duration, seed=seed)
    reference, testbed = variant.get("reference"), variant.get("testbed")
    with ScratchFolder("reference") as folder:
        if reference is not None:
            chosen = with_reference(chosen, reference, folder)
        bundle = bundle_of(chosen, None if testbed is None else as_file(testbed), plant)
    return simulate_in_memory(bundle, variant.get("controllers") or {}, lambda _: None, kept)
