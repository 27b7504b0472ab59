"""How late the sensors are that a machine is identified from, as far as that is no damping."""

from __future__ import annotations

from math import hypot

from cspm_ident.signals.delays import RESOLUTION_S, Delay, find_delays, winds
from cspm_ident.signals.measurement import BAR, FRAME
from cspm_ident.signals.timeline import Timeline
from cspm_msgs_py.testbed import Testbed
from cspm_sim.parameters import plant_parameters


def delays_to_remove(timeline: Timeline, machine: Testbed) -> dict[str, float]:
    """Return by how much the stamps of motion capture are late, by topic [s].

    What smoothing and noise can make up is left in.

    Where winches wind, each pose is held against them. Where they stand still, a delay of both
    poses looks just as another damping of the cables, which is what is to be found; then only the
    bar's delay against the frame's counts, in which the damping has no part.

    Args:
        timeline: the recording's signals, no delay taken out.
        machine: as it was described.
    """
    found = {delay.topic: delay for delay in find_delays(timeline, machine) if delay.known}
    if not found:
        return {}
    if winds(timeline, plant_parameters(machine)):
        return {topic: delay.seconds for topic, delay in found.items() if delay.matters}
    if BAR not in found or FRAME not in found:
        return {}
    late = found[BAR].seconds - found[FRAME].seconds
    # Each has its own uncertainty, and its own resolution.
    limits = [max(RESOLUTION_S, _half_width(found[topic])) for topic in (BAR, FRAME)]
    return {BAR: late} if abs(late) > hypot(*limits) else {}


def _half_width(delay: Delay) -> float:
    return 0.5 * (delay.interval[1] - delay.interval[0])
