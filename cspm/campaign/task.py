"""One run of a campaign, as a worker makes it."""

from __future__ import annotations

import faulthandler
import hashlib
import os
import platform
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass

from cspm.campaign.campaign_folder import Row
from cspm.campaign.code_version import code_version
from cspm.campaign.inputs import unpacked
from cspm.campaign.measures import (
    Metric,
    diagnosis_columns,
    load_metric,
    own_columns,
    run_columns,
)
from cspm.campaign.variants import Variant
from cspm.changed_machine import changed_machine, of_testbed
from cspm.diagnosis import diagnose
from cspm.progress import silent
from cspm.scenario import Scenario
from cspm.simulation import Run, bundle_of, simulate_in_memory
from cspm_msgs_py.errors import CspmError, InputError
from cspm_msgs_py.new_folder import ScratchFolder
from cspm_msgs_py.scenario import load_scenario
from cspm_msgs_py.testbed import TestbedFile, load_testbed
from cspm_run.bundle import SCENARIO, Bundle

DONE, FAILED, REFUSED = "done", "failed", "refused"
STATUS, FAILURE = "status", "failure"


@dataclass(frozen=True)
class Task:
    """What a worker needs for one run; plain data, by value.

    Attributes:
        variant: the run, its files named as the user has them.
        packed: see `Inputs`.
        places: where these files are in it.
        plant: whose equations.
        metrics: the user's own functions.
        diagnose: whether the run is diagnosed by its base machine.
        time_limit_s: after which the worker gives itself up [s].
        code: what `code_version` is to be.
    """

    variant: Variant
    packed: bytes
    places: dict[str, str]
    plant: str
    metrics: tuple[str, ...]
    diagnose: bool
    time_limit_s: float
    code: str


class CodeError(CspmError):
    """A worker runs other code than the campaign."""


def run_task(task: Task) -> Row:
    """Return the columns of a run.

    What the user's values or functions do wrong is in the row: it would be so again.

    Raises:
        CodeError: this process runs other code.
    """
    if code_version() != task.code:
        raise CodeError(f"{platform.node()}: {code_version()}, allowed: {task.code}")
    begun, processor = time.perf_counter(), time.process_time()
    with _limited(task.time_limit_s):
        row = _row(task)
    return row | {
        "elapsed_s": time.perf_counter() - begun,
        "processor_s": time.process_time() - processor,
        "computer": platform.node(),
    }


def bundle_for(task: Task) -> tuple[Bundle, TestbedFile]:
    """Return what a task runs, and its machine before any change.

    Raises:
        InputError: a value that is not allowed.
    """
    with _named_by_origin(task):
        scenario, machine, changed = _described(task)
        return bundle_of(scenario, changed, task.plant), machine


def check_values(task: Task) -> None:
    """Check that scenario and test-bed can have a task's values.

    Raises:
        InputError: a value that is not allowed.
    """
    with _named_by_origin(task):
        _described(task)


def _described(task: Task) -> tuple[Scenario, TestbedFile, TestbedFile]:
    """Return a task's scenario, its machine, and the machine with all changes."""
    folder = unpacked(task.packed).path

    def here(text: str) -> str:
        for path, place in task.places.items():
            text = text.replace(path, str(folder / place))
        return text

    variant = task.variant
    of_scenario, of_machine = of_testbed([here(each) for each in variant.overrides])
    path = folder / task.places[variant.scenario]
    scenario = Scenario(path, load_scenario(path, of_scenario))
    machine = scenario.testbed_file
    if variant.testbed is not None:
        machine = load_testbed(folder / task.places[variant.testbed])
    return scenario, machine, changed_machine(machine, of_machine, variant.effects)


def _row(task: Task) -> Row:
    row: Row = {STATUS: DONE, FAILURE: None}
    try:
        bundle, machine = bundle_for(task)
        row |= _about(bundle)
        metrics = {name: _metric(name, task) for name in task.metrics}
        keep_all = bool(metrics) or task.diagnose
        run = simulate_in_memory(bundle, {}, lambda _: None, None if keep_all else ())
        row |= run_columns(run)
        if run.failure is not None:
            return row | {STATUS: FAILED, FAILURE: run.failure}
        row |= own_columns(run, metrics)
        row |= _diagnosed(run, machine) if task.diagnose else {}
    except CspmError as err:
        row |= {STATUS: REFUSED, FAILURE: str(err)}
    return row


def _about(bundle: Bundle) -> Row:
    text = bundle.attachments()[SCENARIO]
    return {
        "scenario": bundle.scenario.name,
        "testbed": bundle.testbed.testbed.name,
        "seed": bundle.scenario.seed,
        "duration_s": bundle.scenario.duration,
        "scenario_sha256": hashlib.sha256(text).hexdigest(),
        "testbed_sha256": bundle.testbed.sha256,
    }


def _metric(name: str, task: Task) -> Metric:
    file = name.rpartition(":")[0]
    place = task.places.get(file)
    return load_metric(name, unpacked(task.packed).path / place if place else None)


def _diagnosed(run: Run, machine: TestbedFile) -> Row:
    with ScratchFolder("campaign") as place:
        recording = run.save(place / "run")
        found = diagnose(recording, testbed=machine, closed_loop=False, progress=silent)
        return diagnosis_columns(found)


@contextmanager
def _named_by_origin(task: Task) -> Iterator[None]:
    """Name the user's files in errors, not their copies."""
    folder = unpacked(task.packed).path
    try:
        yield
    except InputError as err:
        text = str(err)
        for path, place in task.places.items():
            text = text.replace(str(folder / place), path)
        raise InputError(text) from None


@contextmanager
def _limited(time_limit_s: float) -> Iterator[None]:
    """End this process after so long: a thread of C's does, whatever Python is busy with."""
    with open(os.devnull, "w") as nowhere:
        faulthandler.dump_traceback_later(time_limit_s, exit=True, file=nowhere)
        try:
            yield
        finally:
            faulthandler.cancel_dump_traceback_later()
