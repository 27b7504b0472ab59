"""From a test-bed's `effects` to what acts: checked entries, changed parameters, rows of hooks."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from typing import NamedTuple

import numpy as np
from numba.core.errors import NumbaError
from numpy.typing import NDArray

from cspm_msgs_py.errors import InputError
from cspm_msgs_py.testbed import EffectEntry, Testbed
from cspm_msgs_py.testbed_keys.effect_table import EMPIRICAL
from cspm_msgs_py.testbed_keys.near_name import allowed_names
from cspm_sim.effects import Block, Effect, Elements, Hook, catalogue
from cspm_sim.effects.empirical import table_effect
from cspm_sim.effects.winch_load import load_effects
from cspm_sim.kernels.effect_call import kernel_address
from cspm_sim.kernels.hooks import ROW_COLUMNS

Array = NDArray[np.float64]


class Action(NamedTuple):
    """One effect on one element.

    Attributes:
        effect: of the catalogue.
        element: index of the cable, or of the body among those that the test-bed has.
        name: of the element.
        values: all its parameters, in the effect's order.
    """

    effect: Effect
    element: int
    name: str
    values: dict[str, float]

    @property
    def numbers(self) -> list[float]:
        """What the kernels take: the effect's constants, then its parameters."""
        return [*self.effect.physics.constants, *self.values.values()]

    @property
    def where(self) -> str:
        """The entry's place in error messages."""
        return f"effects: {self.effect.id}"


def read_actions(testbed: Testbed) -> list[Action]:
    """Return a test-bed's effects one by one, without those whose parameters make them absent.

    Loads of winches are among them, as effects that act alike; see `load_effects`.

    Raises:
        InputError: an effect, one of its elements or parameters is unknown or out of bounds, or an
            effect with memory is listed twice on one element, or one at an attachment acts on a
            cable of several parts.
    """
    actions = [action for entry in testbed.effects for action in _of_entry(entry, testbed)]
    seen = set()
    for action in actions:
        place = action.effect.key, action.name
        if action.effect.physics.states and place in seen:
            raise InputError(f"{action.where}: twice on {action.name}, allowed: once per element")
        seen.add(place)
        _check_parts(action, testbed)
    actions += [
        Action(effect, i, cable.name, values)
        for i, cable in enumerate(testbed.cables)
        for effect, values in load_effects(cable, testbed.gravity)
    ]
    return [action for action in actions if not action.effect.is_absent(action.values)]


def _check_parts(action: Action, testbed: Testbed) -> None:
    """Refuse what is derived for a single span, on a cable of several parts."""
    if Hook.ATTACHMENT in action.effect.physics.kernels:
        cable = testbed.cables[action.element]
        if cable.route:
            raise InputError(
                f"{action.where}: {action.name} has a route, allowed: cables without one"
            )
        parts = cable.parts
        if parts > 1:
            raise InputError(
                f"{action.where}: {action.name} has {parts} parts, allowed: cables of one part"
            )


def altered_testbed(testbed: Testbed, actions: Iterable[Action]) -> Testbed:
    """Return the test-bed with the parameters as effects change them.

    Raises:
        InputError: a changed parameter is out of bounds.
    """
    for action in actions:
        if action.effect.physics.alter:
            try:
                testbed = action.effect.physics.alter(testbed, action.element, action.values)
            except InputError as err:
                raise InputError(f"{action.where}: {err}") from None
    return testbed


def first_states(actions: Sequence[Action], n_states: int) -> list[int]:
    """Return the index of each action's first state, the plant having `n_states`; -1 for none."""
    ends = np.cumsum([n_states] + [action.effect.physics.states for action in actions])
    return [
        int(end) if action.effect.physics.states else -1
        for end, action in zip(ends[:-1], actions, strict=True)
    ]


def hook_rows(actions: Sequence[Action], n_states: int) -> tuple[NDArray[np.int64], Array]:
    """Return `effects` and `effect_parameters` of `PlantParameters`.

    Args:
        actions: in any order.
        n_states: the plant's own states, before those of effects.

    Returns:
        Rows (m, ROW_COLUMNS), ascending by hook and element as the kernels need them, and the
        parameters of each, (m, widest).

    Raises:
        InputError: a kernel does not compile.
    """
    first = first_states(actions, n_states)
    calls = sorted(
        (int(hook), action.element, k)
        for k, action in enumerate(actions)
        for hook in action.effect.physics.kernels
    )
    width = max((len(actions[k].numbers) for *_, k in calls), default=1)
    effects = np.zeros((len(calls), ROW_COLUMNS), dtype=np.int64)
    parameters = np.zeros((len(calls), width))
    for row, (hook, element, k) in enumerate(calls):
        effect, values = actions[k].effect, actions[k].numbers
        address = _address(effect, Hook(hook))
        effects[row] = hook, element, address, first[k], effect.physics.states, 0, 0
        parameters[row, : len(values)] = values
    return effects, parameters


def _address(effect: Effect, hook: Hook) -> int:
    try:
        return kernel_address(effect.physics.kernels[hook], effect.physics.states > 0)
    except NumbaError as err:
        reason = str(err).strip().splitlines()[-1]
        raise InputError(
            f"effects: {effect.id}: its kernel at {hook.name} does not compile ({reason}), allowed:"
            " arithmetic on its arguments, functions of math, branches and loops"
        ) from err


def _of_entry(entry: EffectEntry, testbed: Testbed) -> Iterator[Action]:
    where = f"effects: {entry.effect}"
    effect = catalogue().get(entry.effect) if entry.table is None else table_effect(entry.table)
    if effect is None:
        known = allowed_names(entry.effect, (*catalogue(), EMPIRICAL))
        raise InputError(f"{where}: no such effect, {known}")
    values = _ordered(effect, entry, where) if entry.table is None else _tabled(effect)
    if effect.acts_on is Elements.CELLS and entry.elements in ((), (Elements.CELLS.value,)):
        yield Action(effect, 0, Elements.CELLS.value, values)
    elif effect.acts_on in (Elements.CABLES, Elements.CELLS):
        yield from _on_cables(effect, entry, testbed, values, where)
    else:
        yield from _on_others(effect, entry, testbed, values, where)


def _on_cables(
    effect: Effect, entry: EffectEntry, testbed: Testbed, values: dict[str, float], where: str
) -> Iterator[Action]:
    names = testbed.cable_names
    for element in entry.elements or names:
        if element not in names:
            raise InputError(f"{where}: no element '{element}', {allowed_names(element, names)}")
        index = names.index(element)
        if effect.block is Block.CABLE and not testbed.cables[index].has_cable:
            with_cable = [cable.name for cable in testbed.cables if cable.has_cable]
            allowed = ", ".join(with_cable) or "effects on winches"
            raise InputError(f"{where}: {element} has no cable, allowed: {allowed}")
        yield Action(effect, index, element, values)


def _on_others(
    effect: Effect, entry: EffectEntry, testbed: Testbed, values: dict[str, float], where: str
) -> Iterator[Action]:
    if effect.acts_on is Elements.BAR and testbed.bar is None:
        raise InputError(f"{where}: this test-bed has no bar, allowed: effects on winches")
    names = [effect.acts_on.value]
    if effect.acts_on is Elements.BODIES:
        present = {"winch_frame": testbed.winch_frame, "bar": testbed.bar}
        names = [name for name, body in present.items() if body is not None]
    if not names:
        raise InputError(f"{where}: nothing moves here, allowed: a test-bed with bar or frame")
    for element in entry.elements or names:
        if element not in names:
            raise InputError(
                f"{where}: elements {list(entry.elements)}, allowed: [{', '.join(names)}] or none"
            )
        yield Action(effect, names.index(element), element, values)


def _tabled(effect: Effect) -> dict[str, float]:
    assert effect.table is not None
    return dict(zip((p.name for p in effect.parameters), effect.table.values, strict=True))


def _ordered(effect: Effect, entry: EffectEntry, where: str) -> dict[str, float]:
    names = [parameter.name for parameter in effect.parameters]
    defaults = {p.name: p.default for p in effect.parameters if p.default is not None}
    given = {**defaults, **entry.numbers}
    if set(given) != set(names):
        needed = [name for name in names if name not in defaults]
        further = f", and {', '.join(defaults)}" if defaults else ""
        raise InputError(
            f"{where}: parameters {sorted(entry.numbers)}, allowed: exactly {needed}{further}"
        )
    for parameter in effect.parameters:
        low, high = parameter.allowed
        if not low <= given[parameter.name] <= high:
            raise InputError(
                f"{where}: {parameter.name} = {given[parameter.name]:g} {parameter.unit}, allowed:"
                f" {low:g} to {high:g}"
            )
    return {name: given[name] for name in names}
