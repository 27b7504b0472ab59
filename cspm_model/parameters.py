"""From a test-bed description to the kernels' flat parameter arrays, effects left out."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from cspm_model.kernels import bar as bar_kernel
from cspm_model.kernels import cable as cable_kernel
from cspm_model.kernels import route as route_kernel
from cspm_model.kernels.machine import BAR_STATES, EFFECT_COLUMNS, PlantParameters
from cspm_model.stiffness import POINTS, law_slope, law_table
from cspm_msgs_py.testbed import Bar, Cable, ExponentialStiffness, Testbed
from cspm_msgs_py.testbed_keys.route import Stop, exit_pulley, first_on_bar

Array = NDArray[np.float64]


def nominal_parameters(testbed: Testbed) -> PlantParameters:
    """Return the kernels' parameters without effects: what controllers know of the machine."""
    gravity = testbed.gravity
    rows, tables = zip(*(_cable_row(cable, gravity) for cable in testbed.cables), strict=True)
    return PlantParameters(
        bar=_bar_array(testbed.bar, gravity) if testbed.bar else np.zeros(0),
        cables=np.asfortranarray(rows),
        tables=np.array(tables),
        effects=np.zeros((0, EFFECT_COLUMNS), dtype=np.int64),
        effect_parameters=np.zeros((0, 1)),
    )


def plant_states(testbed: Testbed) -> int:
    """Return the number of states of bar, cables and winches, which those of effects follow."""
    return (BAR_STATES if testbed.bar else 0) + 3 * len(testbed.cables)


def _bar_array(bar: Bar, gravity: float) -> Array:
    out = np.zeros(bar_kernel.BAR_COLUMNS)
    out[bar_kernel.MASS] = bar.mass
    out[bar_kernel.GRAVITY] = gravity
    out[bar_kernel.COM : bar_kernel.COM + 3] = bar.com
    out[bar_kernel.INERTIA : bar_kernel.INERTIA + 9] = bar.inertia.matrix.ravel()
    inverse = np.linalg.inv(bar.inertia.matrix)
    out[bar_kernel.INVERSE_INERTIA : bar_kernel.INVERSE_INERTIA + 9] = inverse.ravel()
    return out


def _cable_row(cable: Cable, gravity: float) -> tuple[Array, Array]:
    row = np.zeros(cable_kernel.CABLE_COLUMNS)
    table = np.zeros((POINTS, 2))
    row[cable_kernel.GEAR_RATIO] = cable.gear_ratio
    row[cable_kernel.GRAVITY_HERE] = gravity
    row[cable_kernel.RADIUS] = cable.wound_radius
    row[cable_kernel.INERTIA] = cable.rotor_inertia
    row[cable_kernel.TORQUE_LIMIT] = cable.torque_limit
    row[cable_kernel.PARTS] = cable.parts
    law, damping = cable.stiffness, cable.damping
    if not (cable.exit and cable.attachment and law and damping and cable.tension_limits):
        return row, table
    row[cable_kernel.HAS_CABLE] = 1.0
    row[cable_kernel.EXIT : cable_kernel.EXIT + 3] = cable.exit
    row[cable_kernel.ATTACHMENT : cable_kernel.ATTACHMENT + 3] = cable.attachment
    pulley = exit_pulley(cable.route) if cable.route else cable.pulley
    if pulley:
        row[cable_kernel.PULLEY_RADIUS] = pulley.radius
        row[cable_kernel.PULLEY_AXIS : cable_kernel.PULLEY_AXIS + 3] = pulley.direction
    # A route of exit and attachment alone is a cable without one.
    if cable.route and len(cable.route) > 2:
        row[cable_kernel.ROUTE :] = _route_columns(cable.route)
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


def _route_columns(route: Sequence[Stop]) -> Array:
    """Return a route's columns, see `kernels.route`; its first stop is the exit."""
    columns = np.zeros(route_kernel.ROUTE_COLUMNS)
    columns[route_kernel.STOP_COUNT] = len(route) - 1
    stops = columns[route_kernel.FIRST_STOP :].reshape(-1, route_kernel.STOP_COLUMNS)
    for row, stop in zip(stops, route[1:], strict=False):
        on_bar = stop.on == "bar"
        row[route_kernel.BODY] = route_kernel.ON_BAR if on_bar else route_kernel.ON_FRAME
        row[route_kernel.PLACE : route_kernel.PLACE + 3] = stop.at
        row[route_kernel.RADIUS] = stop.radius or 0.0
    stops[first_on_bar(route) - 1, route_kernel.BODY] = route_kernel.AT_ATTACHMENT
    return columns
