"""From a test-bed description to the plant's flat parameter arrays."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from cspm_msgs_py.errors import InputError
from cspm_msgs_py.testbed import Bar, Cable, EffectEntry, ExponentialStiffness, Testbed
from cspm_sim.effects import Block, Effect, catalogue
from cspm_sim.kernels import bar as bar_kernel
from cspm_sim.kernels import cable as cable_kernel
from cspm_sim.kernels.effect_call import kernel_address
from cspm_sim.kernels.plant import BAR_BLOCK, WINCH_BLOCK, PlantParameters
from cspm_sim.stiffness import POINTS, law_slope, law_table

Array = NDArray[np.float64]

_BLOCKS = {Block.WINCH: WINCH_BLOCK, Block.BAR: BAR_BLOCK}


def plant_parameters(testbed: Testbed) -> PlantParameters:
    """Return the kernels' parameters of a machine, its effects included.

    Raises:
        InputError: an effect, one of its elements or parameters is unknown or out of bounds.
    """
    rows, tables = zip(*(_cable_row(cable) for cable in testbed.cables), strict=True)
    actions = [action for entry in testbed.effects for action in _actions(entry, testbed)]
    width = max((len(values) for *_, values in actions), default=1)
    return PlantParameters(
        bar=_bar_array(testbed.bar, testbed.gravity) if testbed.bar else np.zeros(0),
        cables=np.asfortranarray(rows),
        tables=np.array(tables),
        effects=np.array(
            [(_BLOCKS[e.block], element, kernel_address(e.kernel)) for e, element, _ in actions],
            dtype=np.int64,
        ).reshape(len(actions), 3),
        effect_parameters=np.array(
            [values + [0.0] * (width - len(values)) for *_, values in actions], dtype=float
        ).reshape(len(actions), width),
    )


def _bar_array(bar: Bar, gravity: float) -> Array:
    out = np.zeros(bar_kernel.BAR_COLUMNS)
    out[bar_kernel.MASS] = bar.mass
    out[bar_kernel.GRAVITY] = gravity
    out[bar_kernel.COM : bar_kernel.COM + 3] = bar.com
    out[bar_kernel.INERTIA : bar_kernel.INERTIA + 9] = bar.inertia.matrix.ravel()
    inverse = np.linalg.inv(bar.inertia.matrix)
    out[bar_kernel.INVERSE_INERTIA : bar_kernel.INVERSE_INERTIA + 9] = inverse.ravel()
    return out


def _cable_row(cable: Cable) -> tuple[Array, Array]:
    row = np.zeros(cable_kernel.CABLE_COLUMNS)
    table = np.zeros((POINTS, 2))
    row[cable_kernel.RADIUS] = cable.drum_radius / cable.gear_ratio
    row[cable_kernel.INERTIA] = cable.rotor_inertia
    row[cable_kernel.TORQUE_LIMIT] = cable.torque_limit
    law, damping = cable.stiffness, cable.damping
    if not (cable.exit and cable.attachment and law and damping and cable.tension_limits):
        return row, table
    row[cable_kernel.HAS_CABLE] = 1.0
    row[cable_kernel.EXIT : cable_kernel.EXIT + 3] = cable.exit
    row[cable_kernel.ATTACHMENT : cable_kernel.ATTACHMENT + 3] = cable.attachment
    row[cable_kernel.OFFSET_LENGTH] = cable.offset_length
    row[cable_kernel.AXIAL_RIGIDITY] = law.axial_rigidity
    row[cable_kernel.FLOOR_TENSION] = law.floor_tension
    row[cable_kernel.DAMPING_CONSTANT] = damping.factor * damping.constant
    row[cable_kernel.DAMPING_SLOPE] = damping.factor * damping.slope
    if isinstance(law, ExponentialStiffness):
        row[cable_kernel.LAW_SCALE] = law.a
        row[cable_kernel.LAW_EXPONENT] = law.b
        row[cable_kernel.FLOOR_SLOPE] = law_slope(law, law.floor_tension)
        row[cable_kernel.FLOOR_SCALED] = law.floor_tension / row[cable_kernel.FLOOR_SLOPE]
        table, step = law_table(law, cable.tension_limits[1])
        row[cable_kernel.TABLE_STEP] = step
        row[cable_kernel.TABLE_STEPS] = 1.0 / step
    return row, table


def _actions(entry: EffectEntry, testbed: Testbed) -> Iterator[tuple[Effect, int, list[float]]]:
    """Yield effect, element index and ordered parameter values, once per element."""
    where = f"effects: {entry.effect}"
    effect = catalogue().get(entry.effect)
    if effect is None:
        raise InputError(f"{where}: no such effect, allowed: {', '.join(catalogue())}")
    values = _ordered_parameters(effect, entry, where)
    if effect.block is Block.BAR:
        if testbed.bar is None:
            raise InputError(f"{where}: this test-bed has no bar, allowed: effects on winches")
        if entry.elements not in ((), ("bar",)):
            raise InputError(f"{where}: elements {list(entry.elements)}, allowed: [bar] or none")
        yield effect, 0, values
        return
    for element in entry.elements or testbed.cable_names:
        if element not in testbed.cable_names:
            allowed = ", ".join(testbed.cable_names)
            raise InputError(f"{where}: no element '{element}', allowed: {allowed}")
        yield effect, testbed.cable_names.index(element), values


def _ordered_parameters(effect: Effect, entry: EffectEntry, where: str) -> list[float]:
    names = [parameter.name for parameter in effect.parameters]
    given = entry.parameters
    if set(given) != set(names):
        raise InputError(f"{where}: parameters {sorted(given)}, allowed: exactly {names}")
    for parameter in effect.parameters:
        if not parameter.minimum <= given[parameter.name] <= parameter.maximum:
            raise InputError(
                f"{where}: {parameter.name} = {given[parameter.name]:g} {parameter.unit}, allowed:"
                f" {parameter.minimum:g} to {parameter.maximum:g}"
            )
    return [given[name] for name in names]
