"""Measuring what is not kept yet, on as many processors as are given."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import as_completed
from typing import Any, NamedTuple

from bench.results.result_store import Measurement, Store
from cspm.campaign.cluster import worker_pool


class Done(NamedTuple):
    """A measurement, what it found, and the processor time that it took [s]."""

    measurement: Measurement
    found: Any
    processor_s: float


class _Task(NamedTuple):
    measurement: Measurement
    needed: tuple[Any, ...]


def work_off(
    store: Store, wanted: Iterable[Measurement], workers: int, tell: Callable[[str], None]
) -> None:
    """Measure what the store does not keep, and what that needs, and keep each at once.

    What measures time goes first and alone; what needs others goes last.
    """
    missing = {}
    for each in wanted:
        for one in (*each.needs, each):
            if store.find(one) is None:
                missing[one.name] = one
    rounds: list[list[Measurement]] = [[], [], []]
    for each in missing.values():
        rounds[0 if each.alone else 2 if each.needs else 1].append(each)
    count = 0
    for number, measurements in enumerate(rounds):
        tasks = [_Task(each, _needed(store, each)) for each in measurements]
        for done in _measured(tasks, 1 if number == 0 else workers):
            store.keep(done.measurement, done.found, done.processor_s)
            count += 1
            tell(
                f"{count} of {len(missing)}: {done.measurement.name}, {done.processor_s:.0f} s of"
                " the processor"
            )


def _needed(store: Store, measurement: Measurement) -> tuple[Any, ...]:
    kept = [store.find(each) for each in measurement.needs]
    return tuple(each.found for each in kept if each is not None)


def _measured(tasks: list[_Task], workers: int) -> Iterator[Done]:
    if workers == 1 or len(tasks) < 2:
        yield from map(_measure, tasks)
        return
    with worker_pool(min(workers, len(tasks))) as pool:
        for done in as_completed([pool.submit(_measure, task) for task in tasks]):
            yield done.result()


def _measure(task: _Task) -> Done:
    begun = time.process_time()
    found = task.measurement.by(*task.measurement.arguments, *task.needed)
    return Done(task.measurement, found, time.process_time() - begun)
