"""Springs between the bar and the world, and hydrostatics of a bar that floats."""

from collections.abc import Sequence

import numpy as np

from cspm_msgs_py.dofs import DOFS
from cspm_sim.effects.effect import (
    Array,
    Block,
    Channel,
    Description,
    Effect,
    EffectParameter,
    Hook,
    Physics,
    Regression,
    Signature,
    Values,
)
from cspm_sim.effects.signals import BarSignal
from cspm_sim.kernels.bar_effects import POSE, WRENCH

_HEAVE = DOFS.index("heave")


def _kernel(parameters: Array, signals: Array) -> None:
    for axis in range(6):
        signals[WRENCH + axis] -= parameters[axis] * signals[POSE + axis]
    signals[WRENCH + 2] += parameters[2] * parameters[6]


def _columns(signals: Array) -> Array:
    columns = np.zeros((len(signals), 6, 7))
    pose = signals[:, BarSignal.POSE : BarSignal.POSE + 6]
    columns[:, :, :6] = -pose[:, :, None] * np.eye(6)
    columns[:, _HEAVE, 6] = 1.0
    return columns


def _weights(values: Values) -> list[float]:
    return [*(values[dof] for dof in DOFS), values["heave"] * values["rest_heave"]]


def _values(weights: Sequence[float], nonlinear: Values) -> dict[str, float]:
    stiffness = weights[_HEAVE]
    rest = weights[6] / stiffness if stiffness else 0.0
    return dict(zip(DOFS, weights, strict=False)) | {"rest_heave": rest}


EFFECT = Effect(
    id="bar_restoring",
    block=Block.BAR,
    parameters=(
        *(
            EffectParameter(dof, "N/m" if i < 3 else "N·m/rad", 0.0, 1e4)
            for i, dof in enumerate(DOFS)
        ),
        EffectParameter(
            "rest_heave",
            "m",
            -20.0,
            20.0,
            absent=None,
            meaning="where no heave force acts",
        ),
    ),
    physics=Physics(kernels={Hook.BAR: _kernel}),
    signature=Signature(
        regression=Regression(Channel.WRENCH, _columns),
        coefficients=_weights,
        from_coefficients=_values,
        tied=True,
        # The moment that turns the bar is its inertia times the second derivative of these angles.
        shares_noise=True,
    ),
    description=Description(
        noun="restoring forces",
        equation=(
            "force on the bar = −stiffness·(position − rest) and moment = −stiffness·Euler angle in"
            " world_ned, a stiffness per axis; the rest is the world's origin but for rest_heave"
        ),
        shows="bar wrench residual is a falling straight line against the same axis's position",
        confounded_with=("bar_constant_wrench", "bar_com"),
        separating_experiment="hold still at three positions and three angles along each axis",
        reference="Fossen, Handbook of Marine Craft Hydrodynamics and Motion Control, 2011, 4.1",
    ),
)
