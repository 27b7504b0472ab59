"""Handing a campaign's runs to workers, each again where its worker was lost."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable, Iterator
from itertools import islice

from distributed import Client, Future, KilledWorker, wait
from distributed.client import FuturesCancelledError

from cspm.campaign.campaign_folder import Row
from cspm.campaign.cluster import workers_of
from cspm.campaign.task import FAILURE, STATUS, CodeError, Task, run_task
from cspm_msgs_py.errors import CspmError, InputError

LOST = "lost"
TRIES = 3
# Runs that wait at the scheduler for each worker: none idles, and little is kept.
_AHEAD = 3
_LOOK_S = 1.0
# Longer than any hiccup of a scheduler that lives [s].
_SILENCE_S = 20.0
_GONE = "the scheduler is lost; the runs that ended are kept, and the same command goes on"


def work(
    client: Client, tasks: Iterable[Task], stop: Callable[[], bool], tell: Callable[[str], None]
) -> Iterator[tuple[int, Row]]:
    """Yield number and columns of each run as it ends.

    A run whose worker died, hung or ran out of memory is made again at the end, alone, so that no
    other is suspected; after three tries it is given up, with status `lost`.

    Args:
        client: of the engine.
        tasks: what to run.
        stop: looked at now and then; once true, no more is handed out, and runs underway are left.
        tell: takes a line about what is not as it should be.

    Raises:
        InputError: a worker runs other code.
        CspmError: the scheduler is lost.
    """
    suspects: list[Task] = []
    ahead = _AHEAD * max(1, len(workers_of(client)))
    for task, row in _round(client, tasks, ahead, stop, tell):
        if row is None:
            suspects.append(task)
        else:
            yield task.variant.number, row
    for task in suspects:
        yield from _alone(client, task, stop, tell)


def _alone(
    client: Client, task: Task, stop: Callable[[], bool], tell: Callable[[str], None]
) -> Iterator[tuple[int, Row]]:
    """Try a run again whose worker was lost once."""
    for tried in range(2, TRIES + 1):
        tell(f"run {task.variant.number}: its worker was lost, try {tried} of {TRIES}")
        for _, row in _round(client, [task], 1, stop, tell):
            if row is not None:
                yield task.variant.number, row
                return
        if stop():
            return
    tell(f"run {task.variant.number}: its worker was lost {TRIES} times, given up")
    reason = f"the worker was lost {TRIES} times: it died, ran out of memory or took too long"
    yield task.variant.number, {STATUS: LOST, FAILURE: reason}


def _round(
    client: Client,
    tasks: Iterable[Task],
    ahead: int,
    stop: Callable[[], bool],
    tell: Callable[[str], None],
) -> Iterator[tuple[Task, Row | None]]:
    """Yield tasks as they end, without columns where the worker was lost."""
    rest, watch = iter(tasks), _Watch(client, tell)
    underway: dict[Future, Task] = {}
    try:
        while not stop():
            for task in islice(rest, ahead - len(underway)):
                underway[_submit(client, task)] = task
            if not underway:
                return
            ended = _some_ended(underway)
            watch.look()
            for future in ended:
                yield underway.pop(future), _row_of(future)
    finally:
        if client.status == "running":
            client.cancel([*underway], force=True)


def _submit(client: Client, task: Task) -> Future:
    # A name of its own for each try: results are never those of another one.
    key = f"run-{task.variant.number}-{time.time_ns()}"
    return client.submit(run_task, task, key=key, pure=False)


def _some_ended(futures: Iterable[Future]) -> list[Future]:
    try:
        return [*wait([*futures], timeout=_LOOK_S, return_when="FIRST_COMPLETED").done]
    except TimeoutError:
        return []
    except FuturesCancelledError:
        raise CspmError(_GONE) from None


def _row_of(future: Future) -> Row | None:
    if future.status == "finished":
        row: Row = future.result()
        return row
    error = future.exception() if future.status == "error" else None
    if isinstance(error, KilledWorker) or future.status in ("lost", "cancelled"):
        return None
    if isinstance(error, CodeError):
        raise InputError(f"a worker that came later: {error}")
    return {STATUS: LOST, FAILURE: f"{type(error).__name__}: {error}"}


class _Watch:
    """Notices that a scheduler is gone, or has no worker."""

    def __init__(self, client: Client, tell: Callable[[str], None]) -> None:
        self._client, self._tell = client, tell
        self._looked = self._alive = self._manned = time.monotonic()
        self._told = False

    def look(self) -> None:
        """Tell of missing workers, unless that was looked at lately.

        Raises:
            CspmError: the scheduler has been gone for long.
        """
        now = time.monotonic()
        if now - self._looked < _LOOK_S:
            return
        self._looked = now
        if self._client.status == "running":
            self._alive = now
            if workers_of(self._client):
                self._manned, self._told = now, False
            elif now - self._manned > _SILENCE_S and not self._told:
                self._tell("the scheduler has no worker: waiting for one")
                self._told = True
        elif now - self._alive > _SILENCE_S:
            raise CspmError(_GONE)
