"""A table of values that describes what no effect of the catalogue explains."""

from __future__ import annotations

from typing import Annotated, Literal

import numpy as np
from pydantic import Field, model_validator
from typing_extensions import Self

from cspm_msgs_py.dofs import DOFS
from cspm_msgs_py.yaml_file import StrictModel

# Id of the effect whose parameters are a table.
EMPIRICAL = "empirical"
WINCH_TORQUE, CABLE_TENSION, BAR_WRENCH = "winch_torque", "cable_tension", "bar_wrench"
Place = Literal["winch_torque", "cable_tension", "bar_wrench"]
Axis = Literal["surge", "sway", "heave", "roll", "pitch", "yaw"]

# Unit of each driver, by the place that it drives.
DRIVERS: dict[str, dict[str, str]] = {
    WINCH_TORQUE: {"speed": "rad/s", "angle": "rad", "tension": "N"},
    CABLE_TENSION: {"tension": "N", "rate of elongation": "m/s", "motor angle": "rad"},
    BAR_WRENCH: {dof: "m" if i < 3 else "rad" for i, dof in enumerate(DOFS)}
    | {f"{dof} speed": "m/s" if i < 3 else "rad/s" for i, dof in enumerate(DOFS)},
}


class EffectTable(StrictModel):
    """A function of one measured signal, or of two, as values at knots.

    Between knots it is linear, in two drivers bilinear; beyond the ends it holds the end's value.

    Attributes:
        place: what it adds to: the torque that resists a winch's motion [N·m], a cable's tension
            [N], or one axis of the wrench on the bar [N, N·m].
        axis: of the wrench, in world_ned; None at other places.
        driver: the signal; its unit is that of `DRIVERS`.
        knots: of the driver, ascending, shape (k,).
        second_driver: a further signal; None where there is one only.
        second_knots: of the second driver, ascending, shape (m,); empty where there is none.
        values: at the knots, shape (k,); with two drivers row by row of the first, (k·m,).
        unit: of the values.
        note: what is known of it, such as a formula that runs alike.
    """

    place: Place
    axis: Axis | None = None
    driver: str
    knots: Annotated[tuple[float, ...], Field(min_length=2, max_length=200)]
    second_driver: str | None = None
    second_knots: tuple[float, ...] = ()
    values: Annotated[tuple[float, ...], Field(min_length=2, max_length=10_000)]
    unit: str | None = None
    note: str = ""

    @model_validator(mode="after")
    def _consistent(self) -> Self:
        self._check_axis()
        self._check_driver("driver", self.driver)
        self._check_knots("knots", self.knots)
        if self.second_driver is not None:
            self._check_driver("second_driver", self.second_driver)
            self._check_knots("second_knots", self.second_knots)
        if bool(self.second_knots) != (self.second_driver is not None):
            raise ValueError(
                f"second_knots: {len(self.second_knots)} of them, allowed: two or more with a"
                " second_driver, none without"
            )
        count = len(self.knots) * max(1, len(self.second_knots))
        if len(self.values) != count:
            raise ValueError(f"values: {len(self.values)} of them, allowed: {count}, one per knot")
        if self.unit is not None and self.unit != self.value_unit:
            raise ValueError(f"unit: '{self.unit}', allowed: {self.value_unit} or none")
        return self

    def _check_axis(self) -> None:
        on_bar = self.place == BAR_WRENCH
        if on_bar and self.axis is None:
            raise ValueError(f"axis: missing, allowed: {', '.join(DOFS)}")
        if not on_bar and self.axis is not None:
            raise ValueError(f"axis: '{self.axis}', allowed: none, as {self.place} has no axes")

    def _check_driver(self, key: str, name: str) -> None:
        if name not in DRIVERS[self.place]:
            allowed = ", ".join(DRIVERS[self.place])
            raise ValueError(f"{key}: '{name}', allowed at {self.place}: {allowed}")

    @staticmethod
    def _check_knots(key: str, knots: tuple[float, ...]) -> None:
        if len(knots) < 2 or not np.all(np.diff(knots) > 0.0):
            raise ValueError(f"{key}: {list(knots)[:4]} …, allowed: two or more, ascending")

    @property
    def value_unit(self) -> str:
        """Unit of the values, which follows from the place."""
        turns = self.axis in DOFS[3:] or self.place == WINCH_TORQUE
        return "N·m" if turns else "N"

    @property
    def drivers(self) -> tuple[str, ...]:
        """The one or two signals."""
        return (self.driver,) if self.second_driver is None else (self.driver, self.second_driver)

    @property
    def key(self) -> str:
        """Place, axis, drivers and knots, which tell tables apart."""
        where = self.place if self.axis is None else f"{self.place} {self.axis}"
        at = (*self.knots, *self.second_knots)
        return f"{where} by {' and '.join(self.drivers)} at {at}"
