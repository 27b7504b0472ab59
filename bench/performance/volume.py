"""How much is measured."""

from __future__ import annotations

from typing import NamedTuple


class Volume(NamedTuple):
    """Repetitions and simulated times [s] of each measurement."""

    plant: int
    loops: int
    loop_duration: float
    share_duration: float
    graphs: int
    graph_duration: float
    realtime_duration: float
    first_runs: int
    later_runs: int
    silent_duration: float
    recorded_duration: float

    @property
    def parts(self) -> int:
        """How many parts report that they are done."""
        loops = 3 * self.loops + 2 * self.graphs + 2
        return 2 * self.plant + loops + self.first_runs + self.later_runs + 2


USUAL = Volume(200, 5, 20.0, 20.0, 3, 10.0, 30.0, 2, 5, 3600.0, 600.0)
QUICK = Volume(50, 2, 5.0, 2.0, 1, 3.0, 5.0, 1, 2, 120.0, 60.0)


def full(volume: Volume) -> Volume:
    """Return the same with an hour recorded, and ten minutes in real time."""
    return volume._replace(recorded_duration=3600.0, realtime_duration=600.0)
