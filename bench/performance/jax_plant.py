"""The plant's equations in JAX, for many variants at once: what lanes of a compiler give.

The same states and equations as `cspm_sim.kernels.plant` without effects and pulleys, written for
arrays instead of numbers, with the winch frame at rest. XLA compiles them for the processor, and
`vmap` puts the variants side by side, as simulators of many robots do.
"""

from __future__ import annotations

from collections.abc import Callable

import jax
import jax.numpy as jnp
import numpy as np

from cspm_model.kernels import bar as bar_rows
from cspm_model.kernels import cable as cable_rows
from cspm_model.kernels.machine import BAR_STATES, PlantParameters

jax.config.update("jax_enable_x64", True)
Rate = Callable[[jax.Array, jax.Array], jax.Array]


def make_rate(parameters: PlantParameters, frame_pose: np.ndarray) -> Rate:
    """Return the derivative of a state (36,) under motor torques (8,) [N·m].

    Args:
        parameters: of a machine with a bar.
        frame_pose: of the winch frame, x y z φ θ ψ.
    """
    cables, bar = jnp.asarray(parameters.cables), jnp.asarray(parameters.bar)
    exits = cables[:, cable_rows.EXIT : cable_rows.EXIT + 3]
    exits = exits @ rotation_of(jnp.asarray(frame_pose[3:])).T + frame_pose[:3]
    tables = jnp.asarray(parameters.tables)

    def rate(state: jax.Array, torque: jax.Array) -> jax.Array:
        rotation = rotation_of(state[3:6])
        arms = cables[:, cable_rows.ATTACHMENT : cable_rows.ATTACHMENT + 3] @ rotation.T
        spans = state[:3] + arms - exits
        lengths = jnp.linalg.norm(spans, axis=1)
        directions = spans / lengths[:, None]
        spin = rotation @ state[9:12]
        speeds = jnp.sum(directions * (state[6:9] + jnp.cross(spin, arms)), axis=1)
        unstretched, _, turning = state[BAR_STATES:].reshape(3, -1)
        radii = cables[:, cable_rows.RADIUS]
        winding = -unstretched * radii * turning / lengths
        tensions = _tensions(cables, tables, lengths, unstretched, speeds - winding)
        limits = cables[:, cable_rows.TORQUE_LIMIT]
        net = jnp.clip(torque, -limits, limits) - radii * tensions
        pulls = -tensions[:, None] * directions
        of_bar = _bar_rate(state, rotation, bar, pulls.sum(0), jnp.cross(arms, pulls).sum(0))
        return jnp.concatenate([of_bar, winding, turning, net / cables[:, cable_rows.INERTIA]])

    return rate


def rotation_of(angles: jax.Array) -> jax.Array:
    """Return R = Rz(ψ)·Ry(θ)·Rx(φ)."""
    (cr, cp, cy), (sr, sp, sy) = jnp.cos(angles), jnp.sin(angles)
    return jnp.array(
        [
            [cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr],
            [sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr],
            [-sp, cp * sr, cp * cr],
        ]
    )


def _tensions(
    cables: jax.Array,
    tables: jax.Array,
    lengths: jax.Array,
    unstretched: jax.Array,
    stretching: jax.Array,
) -> jax.Array:
    """Return the tensions (n,) [N] by the exponential law below its cap, with its damper."""
    elastic_length = unstretched + cables[:, cable_rows.OFFSET_LENGTH]
    scale = cables[:, cable_rows.LAW_SCALE] * elastic_length ** -cables[:, cable_rows.LAW_EXPONENT]
    scaled = scale * jnp.maximum(lengths - unstretched, 0.0)
    elastic = jnp.where(scaled > 0.0, _law(cables, tables, scaled), 0.0)
    damping = jnp.maximum(
        cables[:, cable_rows.DAMPING_CONSTANT]
        - cables[:, cable_rows.DAMPING_SLOPE] * elastic_length,
        0.0,
    )
    damping *= jnp.minimum(elastic / cables[:, cable_rows.FLOOR_TENSION], 1.0)
    return jnp.maximum(elastic + damping * stretching, 0.0)


def _law(cables: jax.Array, tables: jax.Array, scaled: jax.Array) -> jax.Array:
    """Return the tension at scaled elongations, from the plant's own table."""
    step = cables[:, cable_rows.TABLE_STEP]
    past = scaled - cables[:, cable_rows.FLOOR_SCALED]
    place = jnp.clip(past / step, 0.0, tables.shape[1] - 1.0 - 1e-9)
    below = place.astype(int)
    each = jnp.arange(len(scaled))
    (t0, g0), (t1, g1) = tables[each, below].T, tables[each, below + 1].T
    s, slope = place - below, (t1 - t0) / step
    c2, c3 = 3.0 * slope - 2.0 * g0 - g1, g0 + g1 - 2.0 * slope
    beyond = t0 + s * (g0 + s * (c2 + s * c3)) * step
    return jnp.where(past <= 0.0, cables[:, cable_rows.FLOOR_SLOPE] * scaled, beyond)


def _bar_rate(
    state: jax.Array, rotation: jax.Array, bar: jax.Array, force: jax.Array, moment: jax.Array
) -> jax.Array:
    """Return the derivative of the bar's 12 states, by Newton and Euler about its mass centre."""
    com = bar[bar_rows.COM : bar_rows.COM + 3]
    inertia = bar[bar_rows.INERTIA : bar_rows.INERTIA + 9].reshape(3, 3)
    inverse = bar[bar_rows.INVERSE_INERTIA : bar_rows.INVERSE_INERTIA + 9].reshape(3, 3)
    spin = state[9:12]
    about = rotation.T @ (moment - jnp.cross(rotation @ com, force))
    angular = inverse @ (about - jnp.cross(spin, inertia @ spin))
    off = jnp.cross(angular, com) + jnp.cross(spin, jnp.cross(spin, com))
    gravity = jnp.array([0.0, 0.0, 1.0]) * bar[bar_rows.GRAVITY]
    linear = force / bar[bar_rows.MASS] + gravity - rotation @ off
    sine, cosine = jnp.sin(state[3]), jnp.cos(state[3])
    yaw = (sine * spin[1] + cosine * spin[2]) / jnp.cos(state[4])
    euler = jnp.array([spin[0] + jnp.sin(state[4]) * yaw, cosine * spin[1] - sine * spin[2], yaw])
    return jnp.concatenate([state[6:9], euler, linear, angular])


def make_advance(rate: Rate, period: float, steps: int) -> Callable[..., jax.Array]:
    """Return what makes so many Runge-Kutta steps of variants, compiled.

    It takes states (variants, 36) and torques (variants, 8) that are held.
    """

    def step(state: jax.Array, torque: jax.Array) -> jax.Array:
        k1 = rate(state, torque)
        k2 = rate(state + 0.5 * period * k1, torque)
        k3 = rate(state + 0.5 * period * k2, torque)
        k4 = rate(state + period * k3, torque)
        return state + period / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + k4)

    def advance(states: jax.Array, torques: jax.Array) -> jax.Array:
        many = jax.vmap(step)
        return jax.lax.fori_loop(0, steps, lambda _, each: many(each, torques), states)

    return jax.jit(advance)


def operations_of(rate: Rate, state: np.ndarray) -> float:
    """Return the floating-point operations of a Runge-Kutta step, as the compiler counts them."""
    torque = np.zeros((len(state) - BAR_STATES) // 3)
    counted = jax.jit(rate).lower(state, torque).compile().cost_analysis()
    of_rate = float(counted["flops"])
    # Four rates, and for each state four stages of two operations and a last sum of seven.
    return 4.0 * of_rate + 15.0 * len(state)
