"""A model that is simulated, and what of it is to be fitted."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from cspm_ident.estimation.parameter import Parameter, free_indices, scales
from cspm_ident.estimation.record import as_channels

Array = NDArray[np.float64]
Residual = Callable[[Array], Sequence[Array]]
Map = Callable[[Callable[[Array], Any], Iterable[Array]], Iterable[Any]]


@dataclass(frozen=True)
class Problem:
    """What is to be fitted.

    Attributes:
        residual: from all parameters, shape (parameters,), to one array per window and group of
            channels, shape (n,) or (n, channels), measured minus model or the other way round.
        parameters: bounds, scales, priors, and which are frozen.
        groups: the group of each array; those of one group share a noise model. All are of one
            group if none are given.
        jacobian: from all parameters to one array per window, the shape of its residual and one
            axis for all parameters; by differences if none is given.
        step: of the differences [scales].
        evaluate: what applies `residual` to several parameter vectors, such as the `map` of a
            process pool.
    """

    residual: Residual
    parameters: Sequence[Parameter]
    groups: Sequence[str] | None = None
    jacobian: Residual | None = None
    step: float = 1e-6
    evaluate: Map = map

    def residuals(self, theta: Array) -> list[Array]:
        """Return the residuals with channels.

        Raises:
            InputError: of a shape that does not fit, or not finite.
        """
        return [as_channels(part, "a residual") for part in self.residual(theta)]

    def jacobians(self, theta: Array) -> list[Array]:
        """Return the derivatives by the free parameters, per window (n, channels, free)."""
        free = free_indices(self.parameters)
        if self.jacobian is not None:
            parts = [np.asarray(part, dtype=float) for part in self.jacobian(theta)]
            return [(p if p.ndim == 3 else p[:, None, :])[:, :, free] for p in parts]
        steps = self._steps(theta)
        points = [theta + step * unit for step, unit in zip(steps, np.eye(len(theta)), strict=True)]
        moved = list(self.evaluate(self.residual, [theta, *(points[i] for i in free)]))
        base = [as_channels(part, "a residual") for part in moved[0]]
        columns = [
            [
                (as_channels(p, "a residual") - b) / steps[i]
                for p, b in zip(parts, base, strict=True)
            ]
            for i, parts in zip(free, moved[1:], strict=True)
        ]
        return [np.stack(window, axis=-1) for window in zip(*columns, strict=True)]

    def _steps(self, theta: Array) -> Array:
        """Steps that stay within the bounds."""
        steps = self.step * scales(self.parameters)
        upper = np.array([parameter.upper for parameter in self.parameters])
        return np.where(theta + steps > upper, -steps, steps)

    @property
    def rounding(self) -> float:
        """Relative error of the Jacobian."""
        return _DIFFERENCE_ERROR if self.jacobian is None else _EXACT_ERROR


# Forward differences of a smooth function with steps of 1e-6 scales are off by about that much.
_DIFFERENCE_ERROR = 1e-6
_EXACT_ERROR = 1e-12
