"""The command `cspm replay`: a bag to the graph, steered by keys, or through nodes and compared."""

from __future__ import annotations

import dataclasses
import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rich.console import Console
from rich.markup import escape
from rich.progress import BarColumn, Progress, TextColumn

from cspm_msgs_py.bag import BagStream, open_bag
from cspm_msgs_py.errors import InputError
from cspm_ros.replay.bag_selection import Selection
from cspm_ros.replay.player import UNLIMITED, Player, neighbour_rate
from cspm_ros.replay.terminal_keys import RIGHT, TerminalKeys
from cspm_ros.runtime.ros_install import find_ros
from cspm_run.console import say
from cspm_run.summary import write_json

if TYPE_CHECKING:
    from cspm_ros.replay.replay_run import Replayed

ALL = "all"
KEYS = "space: pause · s or →: one instant · + −: rate · q: end"


@dataclass(frozen=True)
class Replay:
    """Options of the command.

    Attributes:
        bag: what to play.
        selection: which part of it.
        rate: bag time per wall time; None for 1, or for unlimited with nodes in step.
        paused: whether to begin paused.
        through: nodes to feed in step; `all` means those that the recording has.
        overrides: values that replace the recorded scenario's for those nodes.
        out: where to record the output of those nodes.
    """

    bag: Path
    selection: Selection
    rate: float | None = None
    paused: bool = False
    through: Sequence[str] = ()
    overrides: Sequence[str] = ()
    out: Path | None = None

    def check(self) -> None:
        """Refuse options that exclude each other.

        Raises:
            InputError: they do.
        """
        chosen = self.selection
        if not self.through:
            if self.out is not None or self.overrides:
                given = "--out" if self.out is not None else "--set"
                raise InputError(f"{given} without --through: allowed: with it")
        elif chosen.topics or chosen.left_out or chosen.start_s or chosen.remap:
            raise InputError(
                "--through with --topics, --except, --start or --remap: allowed: without, since"
                " the nodes need all that they had, from the beginning"
            )


def replay_command(asked: Replay, json: Path | None = None) -> bool:
    """Play a bag; return whether it was played to its end and, through nodes, reproduced.

    Raises:
        InputError: the bag, or an option, cannot be used.
        CspmError: the replay through nodes stalled.
    """
    console = Console()
    asked.check()
    with open_bag(asked.bag) as bag:
        find_ros("replay")
        # Loading ROS comes after looking for it.
        from cspm_ros.replay.replay_run import replay

        with Display(console, asked, bag) as display:
            if asked.through:
                found = _replay_through(asked, display)
            else:
                rate = 1.0 if asked.rate is None else asked.rate
                found = replay(
                    bag,
                    asked.selection,
                    rate,
                    display.look,
                    paused=asked.paused,
                    tell=lambda text: say(console, text),
                )
    _tell(console, found)
    if json is not None:
        write_json(json, replay_data(asked.bag, found))
    return found.identical and not found.interrupted


def _replay_through(asked: Replay, display: Display) -> Replayed:
    from cspm_ros.replay.replay_run import nodes_of, replay_through

    nodes = nodes_of(asked.bag) if ALL in asked.through else asked.through
    return replay_through(
        asked.bag,
        nodes,
        UNLIMITED if asked.rate is None else asked.rate,
        display.look,
        paused=asked.paused,
        duration_s=asked.selection.duration_s,
        overrides=asked.overrides,
        folder=asked.out,
    )


def replay_data(bag: Path, found: Replayed) -> dict[str, Any]:
    """Return what the command prints, as plain data."""
    reported = {
        "bag": str(bag),
        "messages": found.messages,
        "played_s": found.played_s,
        "interrupted": found.interrupted,
        "unplayable": found.unplayable,
    }
    if not found.reproductions:
        return reported
    commands = {
        name: {
            "messages": each.compared,
            "different": each.different,
            "first_difference": dataclasses.asdict(each.first) if each.first else None,
            "largest_difference": each.largest._asdict() if each.largest.field else None,
        }
        for name, each in found.reproductions.items()
    }
    return reported | {"identical": found.identical, "reproduced": commands}


def _tell(console: Console, found: Replayed) -> None:
    for each in found.reproductions.values():
        say(console, str(each))
    how = "interrupted after" if found.interrupted else "played"
    say(console, f"{how} {found.played_s:.3f} s, {found.messages} messages")


class Display:
    """Context that shows a player's progress and passes keys on to it."""

    def __init__(self, console: Console, asked: Replay, bag: BagStream) -> None:
        self._console = console
        self._span_ns = asked.selection.span_ns(bag)
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
        self._task = self._bar.add_task(escape(asked.bag.name), total=length, state="waiting")

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
