"""Run a scenario while browsers on this computer watch it: `cspm run --view`."""

from __future__ import annotations

import threading
from collections.abc import Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass
from itertools import count
from pathlib import Path

from rich.console import Console

from cspm.commands.run_command import (
    RunnerOptions,
    bundle_from,
    check_patience_option,
    tell_result,
)
from cspm.commands.view_command import open_browser
from cspm.view.knobs import effects_on, knobs_of, turned
from cspm.view.live_run import LiveRun, Restart
from cspm.view.live_server import LiveServer
from cspm.view.view_server import LOOPBACK, listening
from cspm_msgs_py.errors import InputError
from cspm_msgs_py.interruption import interruptible
from cspm_msgs_py.new_folder import refuse_existing
from cspm_run.bundle import Bundle
from cspm_run.output.console import make_console, say
from cspm_run.recorded_run import INPROCESS, run
from cspm_run.stage_warm_up import compile_beside


@dataclass(frozen=True)
class WatchRequest:
    """Options of the command.

    Attributes:
        scenario: file.
        overrides: replaced values, `KEY=VALUE`.
        folder: a new folder for the recording; a run that begins again gets one with a number.
        json: file for the printed results of the last run; None writes none.
        options: what makes the steps.
        machine: a test-bed file instead of the scenario's.
        effects: physics planted in the machine.
        port: to listen on; None takes the first free one from 8080.
        browser: whether to open a browser.
    """

    scenario: Path
    overrides: Sequence[str]
    folder: Path
    json: Path | None
    options: RunnerOptions
    machine: Path | None
    effects: Sequence[str]
    port: int | None
    browser: bool


def run_view_command(request: WatchRequest) -> bool:
    """Run a scenario, show it as it happens, and again whenever a knob is turned.

    Returns:
        Whether the last run went to its end.

    Raises:
        InputError: scenario, test-bed, folder or port cannot be used.
        CspmError: a node failed.
    """
    console = make_console()
    options = request.options
    check_patience_option(options.patience, options.mode)
    described = _described(request, request.effects)
    compile_beside(described)
    options.check(described)
    refuse_existing(request.folder)
    own = options.mode == INPROCESS
    knobs = knobs_of(described.scenario, request.effects, paced=own) if own else []
    live = LiveRun(knobs, can_pause=own)
    machine = described.testbed.testbed
    server = listening(LOOPBACK, request.port, lambda *at: LiveServer(live, machine, *at))
    threading.Thread(target=server.serve_forever, name="view", daemon=True).start()
    try:
        say(console, f"view {server.url} (Ctrl-C ends)")
        if request.browser:
            open_browser(server.url)
        return _watched(console, request, live)
    finally:
        server.shutdown()
        server.server_close()


def _described(request: WatchRequest, effects: Sequence[str]) -> Bundle:
    return bundle_from(
        request.scenario, request.overrides, request.machine, request.options.plant, effects
    )


def _watched(console: Console, request: WatchRequest, live: LiveRun) -> bool:
    """Run until Ctrl-C, and begin again at each change."""
    runner, finished = request.options.runner(console) or run, False
    # Between two runs too, where nothing else hears a signal.
    with interruptible() as stopped, suppress(KeyboardInterrupt):
        for folder in _folders(request.folder):
            if stopped():
                break
            bundle = turned(_described(request, effects_on(live.knobs)), live.knobs)
            live.begin(folder)
            try:
                result = runner(bundle, folder, live.hold)
            except Restart:
                say(console, f"{folder}: ended early, the run begins again")
                continue
            live.end()
            finished = not result.interrupted and result.failure is None
            tell_result(console, bundle, result, request.json)
            if result.failure:
                say(console, result.failure)
            if result.interrupted:
                break
            say(console, f"recording {folder}; the view stays until Ctrl-C")
            live.wait(stopped)
    return finished


def _folders(first: Path) -> Iterator[Path]:
    """Yield the folders of the runs: as asked for, then with numbers.

    Raises:
        InputError: one with a number is there.
    """
    yield first
    for number in count(2):
        folder = first.with_name(f"{first.name}_{number}")
        refuse_existing(folder)
        yield folder


def check_watchable(scenarios: int, *, record: bool, beside: bool) -> None:
    """Refuse what cannot be watched.

    Raises:
        InputError: several runs at once, or nothing is recorded.
    """
    if scenarios > 1 or beside:
        raise InputError("--view: with several runs, allowed: one scenario, no --controllers")
    if not record:
        raise InputError("--view --no-record: allowed: one of both, since recordings are shown")
