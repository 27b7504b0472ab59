"""The parts of a test-bed that a finding may be about."""

from __future__ import annotations

from collections.abc import Sequence
from enum import Enum
from typing import NamedTuple

from cspm_ident.diagnosis.residuals.regressors import Place
from cspm_ident.signals.measurement import TENSION, WINCHES
from cspm_sim.effects import Block, Channel, Effect, Elements


class Kind(Enum):
    """Kind of a part, with its name in reports."""

    WINCH = "winch"
    CABLE = "cable"
    LOAD_CELL = "load cell"
    BODY = "body"
    MARKERS = "motion capture of"


class Part(NamedTuple):
    """One part of a test-bed.

    Attributes:
        kind: its kind.
        element: name of its cable, or of the body.
    """

    kind: Kind
    element: str

    @property
    def words(self) -> str:
        """Name of the part in reports."""
        body = self.element.replace("_", " ")
        return body if self.kind is Kind.BODY else f"{self.kind.value} {body}"


_BLOCKS = {Block.WINCH: Kind.WINCH, Block.CABLE: Kind.CABLE}
_CHANNELS = {
    Channel.DRIVE: Kind.WINCH,
    Channel.SHAFT: Kind.WINCH,
    Channel.TENSION: Kind.CABLE,
}
_SENSORS = {WINCHES: Kind.WINCH, TENSION: Kind.LOAD_CELL}


def parts_of(effect: Effect, element: str, cables: Sequence[str]) -> list[Part]:
    """Return the parts that an effect on an element concerns, in a machine with given cables."""
    if element == Elements.CELLS.value:
        return [Part(Kind.LOAD_CELL, name) for name in cables]
    return [Part(kind_of(effect), element)]


def kind_of(effect: Effect) -> Kind:
    """Return the kind of part that an effect concerns."""
    if effect.physics.sense is not None:
        return _SENSORS.get(effect.physics.sense.topics[0], Kind.MARKERS)
    return _BLOCKS.get(effect.block, Kind.BODY)


def part_behind(place: Place) -> Part:
    """Return the part whose equation a residual belongs to."""
    return Part(_CHANNELS.get(place.channel, Kind.BODY), place.element)
