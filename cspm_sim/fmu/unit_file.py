"""Which unit of FMI 2 takes a plant's place, and what its variables are called."""

from __future__ import annotations

import hashlib
from functools import cached_property
from pathlib import Path

from pydantic import Field

from cspm_msgs_py.errors import InputError
from cspm_msgs_py.yaml_file import StrictModel, read_yaml, validate

ENDING, LISTS = ".fmu", (".yaml", ".yml")


class Variable(StrictModel):
    """A variable of a unit.

    Attributes:
        name: in the unit.
        scale: the plant's value over the unit's, such as −1 for an axis that points up.
    """

    name: str
    scale: float = 1.0


class UnitFile(StrictModel):
    """A unit, and the names that it has for a plant's variables.

    Attributes:
        fmu: path of the unit, from the file that names it.
        variables: by the plant's name; those that are not named have the plant's.
        parameters: numbers that the unit is given before it starts, by its own names.
    """

    fmu: Path
    variables: dict[str, Variable | str] = Field(default_factory=dict)
    parameters: dict[str, float] = Field(default_factory=dict)

    @cached_property
    def sha256(self) -> str:
        """SHA-256 of the unit, hexadecimal."""
        return hashlib.sha256(self.fmu.read_bytes()).hexdigest()

    def variable(self, name: str) -> Variable:
        """Return the unit's variable for one of a plant."""
        found = self.variables.get(name, name)
        return Variable(name=found) if isinstance(found, str) else found


def names_unit(plant: str) -> bool:
    """Return whether a plant is a file: a unit, or a list of the names in one."""
    return Path(plant).suffix in (ENDING, *LISTS)


def read_unit_file(path: Path) -> UnitFile:
    """Return the unit that a file is, or names.

    Raises:
        InputError: it cannot be read, or the unit is not there.
    """
    if path.suffix == ENDING:
        found = UnitFile(fmu=path)
    else:
        named = validate(UnitFile, read_yaml(path), str(path))
        found = named.model_copy(update={"fmu": path.parent / named.fmu})
    if not found.fmu.is_file():
        raise InputError(f"plant {found.fmu}: no such file, allowed: a unit of FMI 2, {ENDING}")
    return found
