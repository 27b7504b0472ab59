"""Playing a bag, to the graph or through nodes: what is requested, and what comes of it."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from cspm_msgs_py.bag import BagStream, open_bag
from cspm_msgs_py.errors import InputError
from cspm_ros.replay.bag_selection import Selection
from cspm_ros.replay.player import UNLIMITED, Player
from cspm_ros.replay.reproduction import Reproduction
from cspm_ros.runtime.ros_install import find_ros

if TYPE_CHECKING:
    from cspm_ros.replay.replay_run import Replayed

ALL = "all"


@dataclass(frozen=True)
class ReplayRequest:
    """What is to be played, and how.

    Attributes:
        bag: path of what to play.
        selection: which part of it.
        rate: bag time per wall time; None for 1, or for unlimited with nodes in step.
        paused: whether to begin paused.
        through: nodes to feed in step; `all` means those that the recording has.
        overrides: values that replace the recorded scenario's for those nodes, `key.path=value`.
        out: a new folder to record the output of those nodes in.
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
                given = "out" if self.out is not None else "changed values"
                raise InputError(f"{given} without through: allowed: with it")
        elif chosen.topics or chosen.left_out or chosen.start_s or chosen.remap:
            raise InputError(
                "through with chosen or renamed topics or a start: allowed: without, since the"
                " nodes need all that they had, from the beginning"
            )


@dataclass(frozen=True)
class Replay:
    """What a replay amounted to.

    Attributes:
        bag: path of what was played.
        messages: number of the bag's messages that were taken up.
        duration: bag time played [s].
        interrupted: whether Ctrl-C or SIGTERM ended it early.
        unplayable: topics that could not be played, and why.
        reproductions: by topic, how nodes in step reproduced what was recorded.
    """

    bag: Path
    messages: int
    duration: float
    interrupted: bool
    unplayable: dict[str, str]
    reproductions: dict[str, Reproduction]

    @property
    def identical(self) -> bool:
        """Whether everything that nodes sent is what was recorded, bit for bit."""
        return all(each.identical for each in self.reproductions.values())

    @property
    def ok(self) -> bool:
        """Whether all was played, and what nodes sent is identical."""
        return self.identical and not self.interrupted

    def data(self) -> dict[str, Any]:
        """Return everything as plain data: what `cspm replay --json` writes."""
        played = {
            "bag": str(self.bag),
            "messages": self.messages,
            "played_s": self.duration,
            "interrupted": self.interrupted,
            "unplayable": self.unplayable,
        }
        if not self.reproductions:
            return played
        commands = {name: _compared(each) for name, each in self.reproductions.items()}
        return played | {"identical": self.identical, "reproduced": commands}


@contextmanager
def opened(request: ReplayRequest) -> Iterator[BagStream]:
    """Give the bag of a request, once its options are checked and ROS is found.

    Raises:
        InputError: options that exclude each other, no such bag, or no ROS.
    """
    request.check()
    with open_bag(request.bag, own_types=True) as bag:
        find_ros("replay")
        yield bag


def played(
    bag: BagStream,
    request: ReplayRequest,
    look: Callable[[Player], None],
    notify: Callable[[str], None] = lambda _: None,
) -> Replay:
    """Play an opened bag as requested.

    Args:
        bag: from `opened`.
        request: of the same bag.
        look: called some 20 times a second with the player, which it may steer.
        notify: gets a line about each topic that cannot be played.

    Raises:
        InputError: the bag does not have what is to be played, or is damaged.
        CspmError: the replay through nodes stalled.
    """
    # Loading ROS comes after looking for it.
    from cspm_ros.replay.replay_run import replay

    if request.through:
        found = _through(request, look)
    else:
        rate, selection = 1.0 if request.rate is None else request.rate, request.selection
        found = replay(bag, selection, rate, look, paused=request.paused, notify=notify)
    return Replay(
        request.bag,
        found.messages,
        found.played_s,
        found.interrupted,
        found.unplayable,
        found.reproductions,
    )


def _through(request: ReplayRequest, look: Callable[[Player], None]) -> Replayed:
    from cspm_ros.replay.replay_run import nodes_of, replay_through

    return replay_through(
        request.bag,
        nodes_of(request.bag) if ALL in request.through else request.through,
        UNLIMITED if request.rate is None else request.rate,
        look,
        paused=request.paused,
        duration_s=request.selection.duration_s,
        overrides=request.overrides,
        folder=request.out,
    )


def _compared(found: Reproduction) -> dict[str, Any]:
    return {
        "messages": found.compared,
        "different": found.different,
        "first_difference": dataclasses.asdict(found.first) if found.first else None,
        "largest_difference": found.largest._asdict() if found.largest.field else None,
    }
