"""Scenarios as a script handles them: loaded by name, changed in one call."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, TypeAlias

from cspm.testbed import Testbed
from cspm_msgs_py.edited import plain
from cspm_msgs_py.errors import InputError
from cspm_msgs_py.scenario import Scenario as Description
from cspm_msgs_py.scenario import load_scenario as load_file
from cspm_msgs_py.testbed import TestbedFile, load_testbed
from cspm_run.library import find_scenario


@dataclass(frozen=True)
class Scenario:
    """One experiment: which machine, which motions, which controllers, at which rates.

    Changes give a new one; this one stays.

    Attributes:
        path: of its file.
        description: every value of the file as attributes, such as `description.duration` [s].
        overrides: what was changed, as `cspm run --set` takes it.
    """

    path: Path
    description: Description
    overrides: tuple[str, ...] = ()

    @property
    def name(self) -> str:
        """The name that the file gives."""
        return self.description.name

    @property
    def testbed(self) -> Testbed:
        """The machine that the scenario is made for.

        Raises:
            InputError: the file that it names is missing or has a fault.
        """
        return Testbed(self.testbed_file)

    @property
    def testbed_file(self) -> TestbedFile:
        """The file of the machine, its effects unchecked.

        Raises:
            InputError: the file that the scenario names is missing or has a fault.
        """
        return load_testbed(self.path.parent / self.description.testbed)

    def with_parameter(self, key: str, value: object) -> Scenario:
        """Return the scenario with another value of one parameter.

        Args:
            key: its path in the file: `duration`, `seed`, `rates.motion_controller`,
                `control.motion.crossover.surge`; see `docs/reference/scenario-file.md`.
            value: the new one in SI: a number, a text, or lists and mappings of these.

        Raises:
            InputError: no such parameter, or a value that it cannot have.

        Examples:
            >>> import cspm
            >>> calm = cspm.load_scenario("calm").with_parameter("duration", 30)
            >>> calm.description.duration
            30.0
        """
        if not all(key.split(".")) or "=" in key:
            raise InputError(f"{key}: allowed: a key path, such as control.motion.crossover.surge")
        override = f"{key}={_json(value, key)}"
        return _loaded(self.path, (*self.overrides, override))


AnyScenario: TypeAlias = Scenario | str | Path


def load_scenario(name: str | Path) -> Scenario:
    """Return a scenario by its name in the library or by its file's path.

    Args:
        name: such as `calm`, or the path of a YAML file; see `docs/reference/scenario-file.md`.

    Raises:
        InputError: no such scenario, or a file with a fault: which key, what is allowed.

    Examples:
        >>> import cspm
        >>> cspm.load_scenario("calm").description.duration
        700.0
    """
    return _loaded(find_scenario(str(name)), ())


def as_scenario(scenario: AnyScenario) -> Scenario:
    """Return what a caller may give as a scenario.

    Raises:
        InputError: see `load_scenario`.
    """
    return scenario if isinstance(scenario, Scenario) else load_scenario(scenario)


def with_changes(scenario: Scenario, **changes: Any) -> Scenario:  # noqa: ANN401 - its own values
    """Return the scenario with the values that are not None."""
    for key, value in changes.items():
        scenario = scenario if value is None else scenario.with_parameter(key, value)
    return scenario


def overridden(scenario: Scenario, overrides: Sequence[str]) -> Scenario:
    """Return the scenario with values replaced as `cspm run --set` takes them, `key.path=value`.

    Raises:
        InputError: no such parameter, or a value that it cannot have.
    """
    if not overrides:
        return scenario
    return _loaded(scenario.path, (*scenario.overrides, *overrides))


def redescribed(scenario: Scenario, **changes: Any) -> Scenario:  # noqa: ANN401 - checked models
    """Return the scenario with other parts of its description, which were checked already."""
    return replace(scenario, description=scenario.description.model_copy(update=changes))


def _loaded(path: Path, overrides: tuple[str, ...]) -> Scenario:
    return Scenario(path, load_file(path, overrides), overrides)


def _json(value: object, key: str) -> str:
    """Return a value as JSON, which is YAML as well."""
    try:
        return json.dumps(plain(value), allow_nan=False)
    except (TypeError, ValueError):
        raise InputError(
            f"{key}: {value!r}, allowed: a finite number, a text, or lists and mappings of these"
        ) from None
