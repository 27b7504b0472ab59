"""Dry friction between a cable and the pulley at its exit."""

from collections.abc import Sequence
from math import asinh, cosh, pi, sinh

import numpy as np

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
from cspm_sim.effects.signals import WinchSignal
from cspm_sim.kernels.winch import DRY_LIMIT, RESISTANCE, WINCH_TENSION, WINDING_RADIUS


def _kernel(parameters: Array, signals: Array) -> None:
    # e^{±x} − 1 = (cosh x − 1) ± sinh x: a bias and a dry friction.
    load = signals[WINCH_TENSION] * signals[WINDING_RADIUS]
    x = parameters[0] * parameters[1]
    signals[RESISTANCE] += load * (cosh(x) - 1.0)
    signals[DRY_LIMIT] += load * sinh(x)


def _columns(signals: Array, wrap: float) -> Array:
    load = signals[:, WinchSignal.TENSION] * signals[:, WinchSignal.RADIUS]
    side = np.sign(signals[:, WinchSignal.SPEED])
    return np.stack([load * side, load], -1)[:, None]


def _weights(values: Values) -> tuple[float, float]:
    x = values["coefficient"] * values["wrap"]
    return sinh(x), cosh(x) - 1.0


def _values(weights: Sequence[float], nonlinear: Values) -> dict[str, float]:
    return {"coefficient": asinh(weights[0]) / nonlinear["wrap"], "wrap": nonlinear["wrap"]}


EFFECT = Effect(
    id="pulley_friction",
    block=Block.CABLE,
    parameters=(
        EffectParameter("coefficient", "1", 0.0, 1.0),
        EffectParameter(
            "wrap",
            "rad",
            0.0,
            2.0 * pi,
            absent=None,
            meaning="from geometry; only the product shows",
        ),
    ),
    physics=Physics(kernels={Hook.WINCH: _kernel}),
    signature=Signature(
        regression=Regression(Channel.SHAFT, _columns),
        nonlinear={"wrap": (0.5 * pi,)},
        coefficients=_weights,
        from_coefficients=_values,
        tied=True,
    ),
    description=Description(
        noun="friction at its pulley",
        equation=(
            "tension on the winch's side = t·exp(coefficient·wrap·sign(q̇)); at rest between both"
        ),
        shows="winch torque residual steps at each reversal, in proportion to the tension there",
        confounded_with=("winch_load_friction", "winch_coulomb_friction"),
        separating_experiment="slow reversals at one tension and two wraps of the pulley",
        reference="Euler-Eytelwein capstan equation",
    ),
)
