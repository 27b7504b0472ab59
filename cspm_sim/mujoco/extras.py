"""The test-bed's known effects, in the forms that MuJoCo has for them."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from cspm_msgs_py.dofs import DOFS
from cspm_msgs_py.errors import InputError
from cspm_msgs_py.testbed import EffectEntry, Testbed
from cspm_msgs_py.testbed_keys.near_name import allowed_names

Array = NDArray[np.float64]

_PARAMETERS: dict[str, tuple[str, ...]] = {
    "bar_linear_damping": DOFS,
    "cable_transverse_damping": ("coefficient", "exit_share"),
    "winch_viscous_friction": ("coefficient",),
    "winch_coulomb_friction": ("torque",),
}
# Of these a file may leave out what is given here.
_DEFAULTS = {"cable_transverse_damping": {"exit_share": 1.0}}
_SIGNED = {"exit_share"}


class Extras(NamedTuple):
    """What acts beside cables, motors and gravity.

    Attributes:
        drag: on the bar per world axis, about its origin, (6,) [N·s/m, N·m·s/rad].
        across: what each attachment's velocity across its cable meets, and by how much the
            exit's lessens it, (n, 2) [N·s/m].
        damping: of the winches, (n,) [N·m·s/rad].
        friction: dry friction of the winches, (n,) [N·m].
    """

    drag: Array
    across: Array
    damping: Array
    friction: Array


def find_extras(testbed: Testbed) -> Extras:
    """Return the sum of a machine's effects.

    Raises:
        InputError: an effect or a load that this plant does not have, or a wrong element or
            parameter.
    """
    for cable in testbed.cables:
        if cable.load is not None:
            raise InputError(f"load: of {cable.name}: not in the MuJoCo plant, allowed: none")
    n = len(testbed.cables)
    extras = Extras(np.zeros(6), np.zeros((n, 2)), np.zeros(n), np.zeros(n))
    of_cables = {
        "winch_viscous_friction": extras.damping,
        "winch_coulomb_friction": extras.friction,
    }
    for entry in testbed.effects:
        values = _values(entry)
        if entry.effect == "bar_linear_damping":
            if testbed.bar is None or entry.elements not in ((), ("bar",)):
                raise InputError(
                    f"effects: {entry.effect}: elements {list(entry.elements)}, allowed: [bar] or"
                    " none, on a machine with a bar"
                )
            extras.drag[:] += values
            continue
        if entry.effect == "cable_transverse_damping":
            coefficient, share = values
            extras.across[_cables(entry, testbed)] += coefficient, coefficient * share
            continue
        of_cables[entry.effect][_cables(entry, testbed)] += values[0]
    return extras


def _values(entry: EffectEntry) -> list[float]:
    names = _PARAMETERS.get(entry.effect)
    if names is None:
        allowed = ", ".join(_PARAMETERS)
        raise InputError(f"effects: {entry.effect}: not in the MuJoCo plant, allowed: {allowed}")
    given = {**_DEFAULTS.get(entry.effect, {}), **entry.numbers}
    if set(given) != set(names):
        raise InputError(
            f"effects: {entry.effect}: parameters {sorted(entry.numbers)}, allowed: exactly"
            f" {list(names)}"
        )
    negative = [name for name in names if name not in _SIGNED and not given[name] >= 0.0]
    if negative:
        raise InputError(f"effects: {entry.effect}: {negative[0]} below 0, allowed: 0 and more")
    return [given[name] for name in names]


def _cables(entry: EffectEntry, testbed: Testbed) -> list[int]:
    names = testbed.cable_names
    unknown = [element for element in entry.elements if element not in names]
    if unknown:
        known = allowed_names(unknown[0], names)
        raise InputError(f"effects: {entry.effect}: no element '{unknown[0]}', {known}")
    # Without repetition in `names` each element has one place; one named twice counts twice.
    return sorted({names.index(element) for element in entry.elements or names})
