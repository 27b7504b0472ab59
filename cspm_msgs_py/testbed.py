"""The test-bed file: one machine's geometry, parameters, sensors and known effects.

SI units, radians, z down. Exit points are in winch_frame_ned (in world_ned where the test-bed has
no winch frame), attachment points in bar_ned (in world_ned where it has no bar). Winch quantities
are at the motor shaft unless the name says drum.
"""

from __future__ import annotations

import hashlib
from dataclasses import dataclass, field
from functools import lru_cache
from pathlib import Path
from typing import Annotated, Literal

import numpy as np
from pydantic import (
    Discriminator,
    Field,
    NonNegativeFloat,
    PositiveFloat,
    Tag,
    field_validator,
    model_validator,
)
from typing_extensions import Self

from cspm_msgs_py.model_fault import MAPPING, NUMBER
from cspm_msgs_py.provenance import Provenance, unwrap_provenance
from cspm_msgs_py.sensor_spec import Sensor, check_sensor_topics
from cspm_msgs_py.testbed_keys.effect_table import EMPIRICAL, EffectTable
from cspm_msgs_py.testbed_keys.plausible import (
    Diameter,
    DrumRadius,
    Extent,
    Mass,
    Modulus,
    Point,
    RotorInertia,
    Tension,
    Torque,
)
from cspm_msgs_py.testbed_keys.pulley import Parts, Pulley
from cspm_msgs_py.testbed_keys.route import Route, check_route, first_on_bar
from cspm_msgs_py.testbed_keys.winch_load import WinchLoad
from cspm_msgs_py.topics import Topic, contract_topics
from cspm_msgs_py.yaml_file import StrictModel, parse_yaml, read_text, validate

Extents = tuple[Extent, Extent, Extent]
SafetyFactor = Annotated[float, Field(ge=1.0)]
Name = Annotated[str, Field(pattern=r"^[A-Za-z][A-Za-z0-9_]*$")]


class Inertia(StrictModel):
    """Inertia tensor about the centre of mass in bar axes [kg·m²]."""

    ixx: PositiveFloat
    iyy: PositiveFloat
    izz: PositiveFloat
    ixy: float = 0.0
    ixz: float = 0.0
    iyz: float = 0.0

    @model_validator(mode="after")
    def _physical(self) -> Self:
        principal = np.linalg.eigvalsh(self.matrix)
        if principal[0] <= 0 or principal[2] > (principal[0] + principal[1]) * (1 + 1e-9):
            raise ValueError(
                f"principal moments {principal[0]:.4g}, {principal[1]:.4g}, {principal[2]:.4g},"
                " allowed: positive and none larger than the sum of the other two"
            )
        return self

    @property
    def matrix(self) -> np.ndarray:
        """The tensor as a symmetric matrix, shape (3, 3)."""
        return np.array(
            [
                [self.ixx, self.ixy, self.ixz],
                [self.ixy, self.iyy, self.iyz],
                [self.ixz, self.iyz, self.izz],
            ]
        )


class Bar(StrictModel):
    """The suspended rigid body; `com` is its centre of mass in bar_ned [m]."""

    mass: Mass
    inertia: Inertia
    com: Point = (0.0, 0.0, 0.0)
    dimensions: Extents


class WinchFrame(StrictModel):
    """The moving frame that carries the winches; its presence says that it can move."""

    dimensions: Extents | None = None


class ExponentialStiffness(StrictModel):
    """Tangent stiffness k = min(a/l^b·(e^{ct} − e^{dt}), E·A/l), thesis (3-7) and (3-10).

    l is the elastic length [m], t the tension [N]. Below `floor_tension` the stiffness stays at its
    value there, without which a slack cable could never become taut again.
    """

    law: Literal["exponential"] = "exponential"
    a: PositiveFloat
    b: NonNegativeFloat
    c: float
    d: float
    youngs_modulus: Modulus
    diameter: Diameter
    floor_tension: PositiveFloat

    @model_validator(mode="after")
    def _stiffening(self) -> Self:
        if not self.c > self.d or self.c < 0 or self.d > 0:
            raise ValueError(f"c = {self.c:g}, d = {self.d:g}, allowed: d ≤ 0 ≤ c and d < c")
        return self

    @property
    def axial_rigidity(self) -> float:
        """E·A [N]."""
        return float(self.youngs_modulus * np.pi / 4.0 * self.diameter**2)


class LinearStiffness(StrictModel):
    """Constant axial rigidity: t = E·A·ε/l, with elongation ε and elastic length l.

    The cable's damper acts in full above `floor_tension` and fades below it.
    """

    law: Literal["linear"] = "linear"
    youngs_modulus: Modulus
    diameter: Diameter
    floor_tension: PositiveFloat

    @property
    def axial_rigidity(self) -> float:
        """E·A [N]."""
        return float(self.youngs_modulus * np.pi / 4.0 * self.diameter**2)


class AxialDamping(StrictModel):
    """Damping along the cable, factor·(constant − slope·l) [N·s/m], thesis (3-13)."""

    law: Literal["linear_in_length"] = "linear_in_length"
    constant: NonNegativeFloat
    slope: float = 0.0
    factor: NonNegativeFloat = 1.0


class Cable(StrictModel):
    """One winch with its drum, gear and cable. A winch without cable has no `exit`, or a `load`.

    A `locked` winch is held by its brake: its motor angle is constant, measured or not. Of `parts`
    between two blocks each carries the tension. A `route` takes the place of exit, attachment,
    pulley and parts: exit and attachment are then its first stop and its first one on the bar.
    `breaking_force` [N] is its maker's; `safety_factor` takes the place of the machine's.
    """

    name: Name
    exit: Point | None = None
    attachment: Point | None = None
    pulley: Pulley | None = None
    parts: Parts = 1
    route: Route | None = None
    offset_length: NonNegativeFloat = 0.0
    stiffness: (
        Annotated[ExponentialStiffness | LinearStiffness, Field(discriminator="law")] | None
    ) = None
    damping: AxialDamping | None = None
    drum_radius: DrumRadius
    gear_ratio: PositiveFloat = 1.0
    rotor_inertia: RotorInertia
    torque_limit: Torque
    tension_limits: tuple[NonNegativeFloat, Tension] | None = None
    breaking_force: PositiveFloat | None = None
    safety_factor: SafetyFactor | None = None
    load: WinchLoad | None = None
    locked: bool = False

    @field_validator("tension_limits")
    @classmethod
    def _ordered(cls, limits: tuple[float, float] | None) -> tuple[float, float] | None:
        if limits and not limits[0] < limits[1]:
            raise ValueError(f"[{limits[0]:g}, {limits[1]:g}], allowed: t_min < t_max")
        return limits

    @model_validator(mode="after")
    def _routed(self) -> Self:
        if self.route is None:
            return self
        check_route(self.route, self.name)
        if self.pulley or self.parts > 1:
            key = "pulley" if self.pulley else "parts"
            raise ValueError(f"{key}: of {self.name}, which has a route, allowed: its stops say it")
        ends = {"exit": self.route[0].at, "attachment": self.route[first_on_bar(self.route)].at}
        for key, place in ends.items():
            if getattr(self, key) not in (None, place):
                raise ValueError(f"{key}: of {self.name}, which has a route, allowed: none")
            object.__setattr__(self, key, place)
        return self

    @model_validator(mode="after")
    def _whole_cable(self) -> Self:
        parts = ("exit", "attachment", "stiffness", "damping", "tension_limits")
        missing = [part for part in parts if getattr(self, part) is None]
        if missing and len(missing) < len(parts):
            raise ValueError(
                f"cable {self.name}: without {', '.join(missing)}, allowed: all of"
                f" {', '.join(parts)}, or none for a winch without cable"
            )
        if self.load is not None and not missing:
            raise ValueError(
                f"load: of {self.name}, whose cable carries what its attachment does, allowed: of a"
                " winch without cable"
            )
        if missing and self.breaking_force is not None:
            raise ValueError(
                f"breaking_force: {self.breaking_force:g} N of {self.name}, a winch without cable,"
                " allowed: none"
            )
        if missing and (self.pulley or self.parts > 1):
            key = "pulley" if self.pulley else "parts"
            raise ValueError(f"{key}: of {self.name}, a winch without cable, allowed: none")
        return self

    @property
    def has_cable(self) -> bool:
        """Whether a cable runs from this winch."""
        return self.exit is not None

    @property
    def wound_radius(self) -> float:
        """Cable that a radian of the motor winds [m]."""
        return self.drum_radius / self.gear_ratio

    @property
    def is_straight(self) -> bool:
        """Whether the cable is one straight line from exit to attachment."""
        if self.route is not None:
            return len(self.route) == 2 and self.route[0].radius is None
        return self.pulley is None and self.parts == 1


def _kind_of_parameters(parameters: object) -> str:
    tabled = isinstance(parameters, EffectTable) or (
        isinstance(parameters, dict) and "knots" in parameters
    )
    return MAPPING if tabled else NUMBER


class EffectEntry(StrictModel):
    """One entry of `effects`: physics beyond the thesis's model, on the named elements."""

    effect: Name
    elements: tuple[str, ...] = ()
    parameters: Annotated[
        Annotated[dict[str, float], Tag(NUMBER)] | Annotated[EffectTable, Tag(MAPPING)],
        Discriminator(_kind_of_parameters),
    ]

    @model_validator(mode="after")
    def _tabled(self) -> Self:
        if (self.effect == EMPIRICAL) != (self.table is not None):
            allowed = "a table of knots and values with effect empirical, numbers with any other"
            raise ValueError(f"parameters: {self.effect} has another kind, allowed: {allowed}")
        return self

    @property
    def numbers(self) -> dict[str, float]:
        """The parameters that are numbers; none where they are a table."""
        return self.parameters if isinstance(self.parameters, dict) else {}

    @property
    def table(self) -> EffectTable | None:
        """The table of an empirical effect, else None."""
        return self.parameters if isinstance(self.parameters, EffectTable) else None


class Testbed(StrictModel):
    """A whole machine. Build it with `load_testbed` or `parse_testbed`.

    `safety_factor` is how many times the highest tension the breaking force of a cable must be.
    """

    name: Name
    gravity: NonNegativeFloat = 9.81
    bar: Bar | None = None
    winch_frame: WinchFrame | None = None
    cables: Annotated[tuple[Cable, ...], Field(min_length=1)]
    sensors: dict[str, Sensor] = Field(default_factory=dict)
    effects: tuple[EffectEntry, ...] = ()
    safety_factor: SafetyFactor = 3.0

    @model_validator(mode="after")
    def _consistent(self) -> Self:
        self._check_names()
        for i, cable in enumerate(self.cables):
            # In different frames equal coordinates are different points, except without a frame.
            fixed = self.bar is None and self.winch_frame is None
            same = cable.has_cable and cable.exit == cable.attachment
            if same and (fixed or self.bar is not None):
                raise ValueError(
                    f"cables[{i}].attachment: {list(cable.attachment or ())} equals the exit of"
                    f" {cable.name}, allowed: a point other than the exit"
                )
            if self.bar is not None and not cable.has_cable:
                raise ValueError(
                    f"cables[{i}].exit: missing for {cable.name}, allowed: a point, since a"
                    " test-bed with a bar has a cable on each winch"
                )
        check_sensor_topics(self.sensors, self.topics)
        return self

    def _check_names(self) -> None:
        names = self.cable_names
        for i, name in enumerate(names):
            if name in names[:i]:
                raise ValueError(
                    f"cables[{i}].name: '{name}' occurs twice, allowed: each name once"
                )

    @property
    def cable_names(self) -> tuple[str, ...]:
        """The cables' names in file order."""
        return tuple(cable.name for cable in self.cables)

    @property
    def topics(self) -> dict[str, Topic]:
        """The contract's topics for this machine, by name."""
        return contract_topics(
            self.cable_names,
            has_bar=self.bar is not None,
            has_winch_frame=self.winch_frame is not None,
        )


@dataclass(frozen=True)
class TestbedFile:
    """A test-bed with the text that it follows from.

    Only text and source are given, so that the description, the provenance and the hash can never
    be those of another machine. A changed machine is a changed text; see `cspm_msgs_py.edited`.

    Attributes:
        text: the file's text, as recorded with every run.
        source: names the file in errors.
        testbed: the checked description.
        provenance: where each number comes from, by key path (`bar.mass`).

    Raises:
        InputError: naming source, key, value and what is allowed.
    """

    text: str
    source: str = field(default="test-bed", compare=False)
    testbed: Testbed = field(init=False, compare=False)
    provenance: dict[str, Provenance] = field(init=False, compare=False)

    def __post_init__(self) -> None:
        content, provenance = unwrap_provenance(parse_yaml(self.text, self.source), self.source)
        object.__setattr__(self, "testbed", validate(Testbed, content, self.source))
        object.__setattr__(self, "provenance", provenance)

    @property
    def sha256(self) -> str:
        """SHA-256 of the text, hexadecimal."""
        return hashlib.sha256(self.text.encode()).hexdigest()


def load_testbed(path: Path) -> TestbedFile:
    """Read and check a test-bed file.

    Raises:
        InputError: naming file, key, value and what is allowed.
    """
    return parse_testbed(read_text(path), str(path))


# A study reads the same machine again with every recording, and YAML is slow to read.
@lru_cache(maxsize=16)
def parse_testbed(text: str, source: str) -> TestbedFile:
    """Check a test-bed's YAML text; `source` names it in errors.

    Raises:
        InputError: naming source, key, value and what is allowed.
    """
    return TestbedFile(text, source)
