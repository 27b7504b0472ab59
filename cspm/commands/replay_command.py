"""The command `cspm replay`: a bag to the graph, steered by keys, or through nodes and compared."""

from __future__ import annotations

import time
from pathlib import Path
from typing import Any

from rich.console import Console
from rich.markup import escape
from rich.progress import BarColumn, Progress, TextColumn

from cspm.replaying import Replay, ReplayRequest, opened, played
from cspm_msgs_py.bag import BagStream
from cspm_ros.replay.player import UNLIMITED, Player, neighbour_rate
from cspm_ros.replay.terminal_keys import RIGHT, TerminalKeys
from cspm_run.output.console import make_console, say
from cspm_run.output.json_file import write_json

KEYS = "space: pause · s or →: one instant · + −: rate · q: end"


def replay_command(request: ReplayRequest, json: Path | None = None) -> bool:
    """Play a bag; return whether it was played to its end and, through nodes, reproduced.

    Raises:
        InputError: the bag, or an option, cannot be used.
        CspmError: the replay through nodes stalled.
    """
    console = make_console()
    with opened(request) as bag, Display(console, request, bag) as display:
        found = played(bag, request, display.look, lambda text: say(console, text))
    _print(console, found)
    if json is not None:
        write_json(json, found.data())
    return found.ok


def _print(console: Console, found: Replay) -> None:
    for each in found.reproductions.values():
        say(console, str(each))
    how = "interrupted after" if found.interrupted else "played"
    say(console, f"{how} {found.duration:.3f} s, {found.messages} messages")


class Display:
    """Context that shows a player's progress and passes keys on to it."""

    def __init__(self, console: Console, request: ReplayRequest, bag: BagStream) -> None:
        self._console = console
        self._span_ns = request.selection.span_ns(bag)
        self._keys = TerminalKeys()
        self._bar = Progress(
            TextColumn("{task.description}"),
            BarColumn(),
            TextColumn("{task.completed:.3f} of {task.total:.3f} s, {task.fields[state]}"),
            console=console,
            transient=True,
            disable=not console.is_terminal,
        )
        length = (self._span_ns[1] - self._span_ns[0]) * 1e-9
        self._task = self._bar.add_task(escape(request.bag.name), total=length, state="waiting")

    def look(self, player: Player) -> None:
        """Obey the keys pressed, and show the player's state."""
        for key in self._keys.read():
            obey(key, player, time.monotonic())
        played = (player.position_ns - self._span_ns[0]) * 1e-9
        self._bar.update(self._task, completed=played, state=state_of(player))

    def __enter__(self) -> Display:
        self._keys.__enter__()
        if self._keys.usable and self._console.is_terminal:
            say(self._console, KEYS)
        self._bar.__enter__()
        return self

    def __exit__(self, *error: Any) -> None:  # noqa: ANN401 - what contexts get
        self._bar.__exit__(*error)
        self._keys.__exit__(*error)


def state_of(player: Player) -> str:
    """Return a player's rate as text, or `paused`."""
    if player.paused:
        return "paused"
    return "as fast as possible" if player.rate == UNLIMITED else f"× {player.rate:g}"


def obey(key: str, player: Player, now_s: float) -> None:
    """Execute the command of a key; ignore other keys."""
    if key == " ":
        (player.resume if player.paused else player.pause)(now_s)
    elif key in ("s", RIGHT):
        player.step(now_s)
    elif key in ("+", "-", "−"):
        player.set_rate(neighbour_rate(player.rate, faster=key == "+"), now_s)
    elif key == "q":
        player.end()
