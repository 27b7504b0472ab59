"""Numbers of a test-bed within what machines have, so that a forgotten prefix is refused.

The bounds are wide: from a robot on a table to one over a valley (FAST, 300 m, 1 MN). They are not
what is usual. Where a number is beyond them, the unit that was probably meant is proposed.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Any

from pydantic import GetCoreSchemaHandler, GetJsonSchemaHandler, PositiveFloat
from pydantic_core import core_schema


@dataclass(frozen=True)
class Within:
    """A check of a number's magnitude, and what it adds to the key's JSON Schema.

    Attributes:
        unit: of the number.
        low: the least magnitude; 0 for numbers of either sign.
        high: the largest magnitude.
        meant: the unit that is often written instead.
        factor: how many of `unit` one `meant` is.
    """

    unit: str
    low: float
    high: float
    meant: str = ""
    factor: float = 1.0

    def check(self, value: float) -> float:
        """Return the number; 0 counts as plausible where the key allows it.

        Raises:
            ValueError: its magnitude is beyond the bounds.
        """
        if value == 0.0 or self.low <= abs(value) <= self.high:
            return value
        unit, meant = self.unit, self.meant
        line = f"{value:g} {unit}, allowed: {self.low:g} to {self.high:g} {unit}"
        if meant and self.low <= abs(value) * self.factor <= self.high:
            line += f"; {value:g} {meant} is {value * self.factor:.4g} {unit}"
        raise ValueError(line)

    def __get_pydantic_core_schema__(
        self,
        source: Any,  # noqa: ANN401 - as pydantic has it
        handler: GetCoreSchemaHandler,
    ) -> core_schema.CoreSchema:
        return core_schema.no_info_after_validator_function(self.check, handler(source))

    def __get_pydantic_json_schema__(
        self, schema: core_schema.CoreSchema, handler: GetJsonSchemaHandler
    ) -> dict[str, Any]:
        least = self.low if self.low > 0.0 else -self.high
        return {
            **handler(schema),
            "minimum": least,
            "maximum": self.high,
            "description": f"[{self.unit}]",
        }


# From rubber to carbon fibre.
Modulus = Annotated[PositiveFloat, Within("Pa", 1e5, 2e12, "GPa", 1e9)]
Diameter = Annotated[PositiveFloat, Within("m", 1e-5, 0.3, "mm", 1e-3)]
DrumRadius = Annotated[PositiveFloat, Within("m", 1e-4, 5.0, "mm", 1e-3)]
Coordinate = Annotated[float, Within("m", 0.0, 600.0, "mm", 1e-3)]
Point = tuple[Coordinate, Coordinate, Coordinate]
Extent = Annotated[PositiveFloat, Within("m", 1e-5, 600.0, "mm", 1e-3)]
Mass = Annotated[PositiveFloat, Within("kg", 1e-5, 1e7, "g", 1e-3)]
RotorInertia = Annotated[PositiveFloat, Within("kg·m²", 1e-10, 1e4, "kg·cm²", 1e-4)]
Torque = Annotated[PositiveFloat, Within("N·m", 1e-6, 1e7, "mN·m", 1e-3)]
Tension = Annotated[PositiveFloat, Within("N", 1e-4, 1e8, "kN", 1e3)]
