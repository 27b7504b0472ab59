"""Test-beds as a script handles them: loaded by name, changed in one call."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TypeAlias

from cspm_model.scene.urdf import urdf
from cspm_msgs_py import edited
from cspm_msgs_py.errors import InputError
from cspm_msgs_py.testbed import EffectEntry, TestbedFile
from cspm_msgs_py.testbed import Testbed as Description
from cspm_msgs_py.testbed import load_testbed as load_file
from cspm_run.library import find_testbed
from cspm_sim.effect_entries import altered_testbed, read_actions
from cspm_sim.parameters import plant_parameters


@dataclass(frozen=True)
class Testbed:
    """A machine: its geometry, parameters, sensors and known effects.

    Changes give a new one; this one stays. Its text is the YAML file of
    `docs/reference/testbed-file.md`, and its
    hash that of the text, so that a recording always carries the machine that was simulated.

    Examples:
        >>> import cspm
        >>> testbed = cspm.load_testbed("thesis").with_parameter("bar.mass", 5.2)
        >>> testbed.description.bar.mass
        5.2
        >>> testbed.cables[:2]
        ('hoist_1', 'hoist_2')

    Attributes:
        file: text, description and provenance.
    """

    file: TestbedFile

    def __repr__(self) -> str:
        """Return name, cables and effects; the text has every number."""
        effects = ", ".join(entry.effect for entry in self.effects) or "none"
        cables = f"{len(self.cables)} cable{'s' * (len(self.cables) != 1)}"
        return f"Testbed({self.name!r}, {cables}, effects: {effects})"

    def __post_init__(self) -> None:
        try:
            altered_testbed(self.description, read_actions(self.description))
        except InputError as err:
            raise InputError(f"{self.file.source}: {err}") from None

    @property
    def name(self) -> str:
        """The name that the file gives."""
        return self.description.name

    @property
    def cables(self) -> tuple[str, ...]:
        """Names of the cables, which are those of their winches, in file order."""
        return self.description.cable_names

    @property
    def description(self) -> Description:
        """Every number of the file as attributes, such as `description.bar.mass` [kg]."""
        return self.file.testbed

    @property
    def effects(self) -> tuple[EffectEntry, ...]:
        """The entries of `effects`: physics beyond the thesis's model, each with elements."""
        return self.description.effects

    @property
    def text(self) -> str:
        """The file's text."""
        return self.file.text

    @property
    def sha256(self) -> str:
        """SHA-256 of the text, hexadecimal."""
        return self.file.sha256

    def with_parameter(self, key: str, value: object) -> Testbed:
        """Return the test-bed with another value of one parameter.

        Args:
            key: its path in the file: `bar.mass`, `cables.sway_3.rotor_inertia`,
                `cables[0].exit`, `sensors./bar/pose.delay`.
            value: the new one in SI: a number, a text, or lists and mappings of these.

        Raises:
            InputError: no such parameter, or a value that it cannot have.

        Examples:
            >>> import cspm
            >>> light = cspm.load_testbed("thesis").with_parameter("bar.mass", 3.0)
        """
        return Testbed(edited.with_value(self.file, key, value))

    def with_effect(self, effect: str, *elements: str, **parameters: float) -> Testbed:
        """Return the test-bed with a further effect.

        Args:
            effect: its id, one of `cspm.effects()`.
            elements: names of the cables or bodies that have it; none for all that can.
            parameters: of the effect, in SI, by name.

        Raises:
            InputError: no such effect, element or parameter, or a value out of its bounds.

        Examples:
            >>> import cspm
            >>> thesis = cspm.load_testbed("thesis")
            >>> worn = thesis.with_effect("winch_coulomb_friction", "sway_3", torque=0.03)
            >>> worn.effects[-1].parameters
            {'torque': 0.03}
        """
        entry = EffectEntry(effect=effect, elements=elements, parameters=_numbers(parameters))
        return Testbed(edited.with_effects(self.file, [entry]))

    def without_effect(self, effect: str) -> Testbed:
        """Return the test-bed without an effect, on whatever elements it is.

        Raises:
            InputError: the test-bed has no such effect.
        """
        return Testbed(edited.without_effect(self.file, effect))

    def urdf(self) -> str:
        """Return the machine as an URDF document, with the tag of ros2_control: `cspm urdf`.

        Examples:
            >>> import cspm
            >>> cspm.load_testbed("thesis").urdf().splitlines()[1]
            '<robot name="thesis">'
        """
        return urdf(self.description)

    def save(self, path: str | Path) -> Path:
        """Write the file; return its path.

        Raises:
            InputError: there is a file already, or it cannot be written.
        """
        place = Path(path)
        if place.exists():
            raise InputError(f"{place}: already exists, allowed: a new file")
        try:
            place.write_text(self.text, encoding="utf-8")
        except OSError as err:
            raise InputError(f"{place}: cannot be written ({err.strerror})") from None
        return place


AnyTestbed: TypeAlias = Testbed | TestbedFile | str | Path


def load_testbed(name: str | Path) -> Testbed:
    """Return a test-bed by its name in the library or by its file's path.

    Args:
        name: such as `thesis`, or the path of a YAML file; see `docs/reference/testbed-file.md`.

    Raises:
        InputError: no such test-bed, or a file with a fault: which key, what is allowed.

    Examples:
        >>> import cspm
        >>> cspm.load_testbed("thesis").description.bar.mass
        4.06
    """
    return Testbed(load_file(find_testbed(str(name))))


def as_file(testbed: AnyTestbed) -> TestbedFile:
    """Return the file of what a caller may give as a test-bed.

    Raises:
        InputError: see `load_testbed`.
    """
    if isinstance(testbed, TestbedFile):
        return testbed
    return testbed.file if isinstance(testbed, Testbed) else load_testbed(testbed).file


def check_plant(file: TestbedFile) -> None:
    """Refuse a test-bed that no plant can be built of: only the model sees some faults.

    Raises:
        InputError: naming the file and the fault.
    """
    try:
        plant_parameters(file.testbed)
    except InputError as err:
        raise InputError(f"{file.source}: {err}") from None


def _numbers(parameters: dict[str, float]) -> dict[str, float]:
    found = {}
    for name, value in parameters.items():
        try:
            found[name] = float(value)
        except (TypeError, ValueError):
            raise InputError(f"{name} = {value!r}, allowed: a number") from None
    return found
