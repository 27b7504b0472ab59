"""Numbers of a test-bed within what machines have, so that a forgotten prefix is refused.

The bounds are wide: from a robot on a table to one over a valley (FAST, 300 m, 1 MN). They are not
what is usual. Where a number is beyond them, the unit that was probably meant is proposed.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Annotated

from pydantic import AfterValidator, PositiveFloat


def within(
    unit: str, low: float, high: float, meant: str = "", factor: float = 1.0
) -> Callable[[float], float]:
    """Return a check of a number's magnitude.

    Args:
        unit: of the number.
        low: the least magnitude; 0 counts as plausible where the key allows it.
        high: the largest magnitude.
        meant: the unit that is often written instead.
        factor: how many of `unit` one `meant` is.
    """

    def check(value: float) -> float:
        if value == 0.0 or low <= abs(value) <= high:
            return value
        line = f"{value:g} {unit}, allowed: {low:g} to {high:g} {unit}"
        if meant and low <= abs(value) * factor <= high:
            line += f"; {value:g} {meant} is {value * factor:.4g} {unit}"
        raise ValueError(line)

    return check


# From rubber to carbon fibre.
Modulus = Annotated[PositiveFloat, AfterValidator(within("Pa", 1e5, 2e12, "GPa", 1e9))]
Diameter = Annotated[PositiveFloat, AfterValidator(within("m", 1e-5, 0.3, "mm", 1e-3))]
DrumRadius = Annotated[PositiveFloat, AfterValidator(within("m", 1e-4, 5.0, "mm", 1e-3))]
Coordinate = Annotated[float, AfterValidator(within("m", 0.0, 600.0, "mm", 1e-3))]
Extent = Annotated[PositiveFloat, AfterValidator(within("m", 1e-5, 600.0, "mm", 1e-3))]
Mass = Annotated[PositiveFloat, AfterValidator(within("kg", 1e-5, 1e7, "g", 1e-3))]
RotorInertia = Annotated[PositiveFloat, AfterValidator(within("kg·m²", 1e-10, 1e4, "kg·cm²", 1e-4))]
Torque = Annotated[PositiveFloat, AfterValidator(within("N·m", 1e-6, 1e7, "mN·m", 1e-3))]
Tension = Annotated[PositiveFloat, AfterValidator(within("N", 1e-4, 1e8, "kN", 1e3))]
