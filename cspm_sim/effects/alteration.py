"""Test-beds with single numbers changed, checked as if they had been read from a file."""

from __future__ import annotations

from cspm_msgs_py.errors import InputError
from cspm_msgs_py.testbed import Bar, Cable, Testbed
from cspm_msgs_py.testbed_keys.route import moved_ends
from cspm_msgs_py.yaml_file import Model, validate


def altered_cable(testbed: Testbed, element: int, **changes: object) -> Testbed:
    """Return the test-bed with some of one cable's or its winch's numbers replaced.

    Exit and attachment take the stops of a route with them.

    Raises:
        InputError: naming what is not allowed.
    """
    cable = testbed.cables[element]
    if cable.route and not changes.get("route"):
        changes["route"] = moved_ends(cable.route, changes.get("exit"), changes.get("attachment"))
    cables = list(testbed.cables)
    cables[element] = _checked(Cable, cable, changes, f"altered {cable.name}")
    return testbed.model_copy(update={"cables": tuple(cables)})


def altered_bar(testbed: Testbed, **changes: object) -> Testbed:
    """Return the test-bed with some of its bar's numbers replaced.

    Raises:
        InputError: naming what is not allowed, or there is no bar.
    """
    if testbed.bar is None:
        raise InputError("this test-bed has no bar, allowed: effects on winches")
    return testbed.model_copy(update={"bar": _checked(Bar, testbed.bar, changes, "altered bar")})


def _checked(kind: type[Model], part: Model, changes: dict[str, object], where: str) -> Model:
    return validate(kind, {**part.model_dump(), **changes}, where)
