"""What a winch without a modelled cable carries: a hanging mass, or an unbalance of its drum."""

from __future__ import annotations

from pydantic import NonNegativeFloat, PositiveFloat, model_validator
from typing_extensions import Self

from cspm_msgs_py.yaml_file import StrictModel


class WinchLoad(StrictModel):
    """The load of a winch or joint without cable; positive winding lifts it.

    Attributes:
        mass: hangs from the drum's rim on an inelastic cable [kg].
        moment: largest torque of gravity about the drum's axis [N·m]: weight times distance.
        angle: of the drum, as its encoder counts, at which that torque is largest against winding
            [rad].
    """

    mass: PositiveFloat | None = None
    moment: NonNegativeFloat | None = None
    angle: float = 0.0

    @model_validator(mode="after")
    def _some(self) -> Self:
        if self.mass is None and self.moment is None:
            raise ValueError("neither mass nor moment, allowed: one of them or both")
        if self.moment is None and self.angle:
            raise ValueError("angle without moment, allowed: with moment")
        return self
