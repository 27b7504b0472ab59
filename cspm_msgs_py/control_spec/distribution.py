"""The key `control.tension_distribution:` of a scenario: how a wrench becomes tensions."""

from __future__ import annotations

from typing import Literal

from pydantic import NonNegativeFloat, PositiveFloat, model_validator
from typing_extensions import Self

from cspm_msgs_py.dofs import Dof
from cspm_msgs_py.yaml_file import StrictModel

WrenchWeights = tuple[
    PositiveFloat, PositiveFloat, PositiveFloat, PositiveFloat, PositiveFloat, PositiveFloat
]
DistributionMethod = Literal[
    "pseudo_inverse",
    "removal",
    "closed_form",
    "improved_closed_form",
    "qp",
    "analytic_centre",
    "prescribed",
]


class LostCable(StrictModel):
    """When a cable counts as lost, and is left out from then on.

    One in which less than `below` [N] was measured for `duration` [s] without a break is lost:
    never less than the lower tension limit, 2 N on the thesis's machine, is wanted of it. No whole
    cable of a sea whose bar can be held is below 0.5 N for longer than 1 ms, nor below 1 N for
    longer than 2 ms (`docs/reference/scenario-file.md`); the load cells' noise is 0.02 N.
    """

    below: PositiveFloat = 0.5
    duration: PositiveFloat = 0.05


class TensionDistribution(StrictModel):
    """How a wanted wrench becomes tensions.

    `lower_limit` [N] takes the place of the test-bed's lower tension limits. `preferred_tension`
    [N] is what the method `qp` stays near. `wrench_weights` say what a missed N or N·m counts, per
    DOF, where the methods `qp` and `analytic_centre` look for the nearest wrench. `null_space` [N]
    is the λ of thesis (5-7), which the method `prescribed` adds to the tensions of least squares.
    With `lost_cable` cables that carry nothing are left out, and their winches released. `axes` are
    the forces and moments that the tensions meet, by DOF; absent, all that the cables give along
    the reference.
    """

    method: DistributionMethod = "analytic_centre"
    lower_limit: NonNegativeFloat | None = None
    preferred_tension: PositiveFloat = 5.0
    wrench_weights: WrenchWeights = (1.0, 1.0, 1.0, 6.0, 6.0, 6.0)
    null_space: tuple[float, ...] | None = None
    lost_cable: LostCable | None = None
    axes: tuple[Dof, ...] | None = None

    @model_validator(mode="after")
    def _prescribed(self) -> Self:
        if self.method == "prescribed" and self.null_space is None:
            raise ValueError("null_space: missing, allowed with method prescribed: a list of N")
        if self.method != "prescribed" and self.null_space is not None:
            raise ValueError(
                f"null_space: {list(self.null_space)} with method {self.method}, allowed: with"
                " method prescribed"
            )
        if self.method == "prescribed" and self.lost_cable is not None:
            raise ValueError(
                "lost_cable: with method prescribed, whose null_space is of all cables, allowed:"
                " with another method"
            )
        return self
