"""The load of a winch as effects of the catalogue, which simulate and explain it."""

from __future__ import annotations

from collections.abc import Iterator
from math import cos, sin

from cspm_msgs_py.testbed import Cable, Testbed
from cspm_sim.effects import Effect, catalogue


def load_effects(cable: Cable, gravity: float) -> Iterator[tuple[Effect, dict[str, float]]]:
    """Yield effects with values that are a winch's load; none without a load.

    A mass m at the rim r of a drum behind gear ratio n resists with m·(g + q̈·r/n)·r/n at the motor
    shaft: a constant torque and an inertia. An unbalance resists with moment/n·cos(q/n − angle).

    Args:
        cable: the winch.
        gravity: [m/s²].
    """
    load, known = cable.load, catalogue()
    if load is None:
        return
    radius = cable.wound_radius
    if load.mass is not None:
        yield known["winch_torque_offset"], {"torque": -load.mass * gravity * radius}
        yield known["winch_inertia"], {"inertia": load.mass * radius**2}
    if load.moment is not None:
        moment = load.moment / cable.gear_ratio
        yield (
            known["winch_unbalance"],
            {"cosine": moment * cos(load.angle), "sine": moment * sin(load.angle), "order": 1.0},
        )


def without_loads(testbed: Testbed) -> Testbed:
    """Return the test-bed without loads, where its effects and inertias have them already."""
    cables = tuple(cable.model_copy(update={"load": None}) for cable in testbed.cables)
    return testbed.model_copy(update={"cables": cables})
