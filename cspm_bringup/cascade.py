"""The thesis's control cascade on one schedule: motion, tension distribution, force."""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np
from numpy.typing import NDArray

from cspm_bringup.assembly import Controllers
from cspm_msgs_py.diagnostics import Level, Status
from cspm_msgs_py.scenario import Rates

Array = NDArray[np.float64]
Send = Callable[[str, Array], None]

UNMOVED = np.array([0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0])


class Cascade:
    """Steps each controller when it is due, on the latest measurements.

    `infeasible` says whether the present wrench cannot be met within the tension limits.
    """

    def __init__(self, controllers: Controllers, rates: Rates, torque: Array) -> None:
        """Take the controllers and the torque to hold until there is something to control on."""
        self._controllers = controllers
        self._dividers = (
            rates.plant // rates.motion_controller,
            rates.plant // rates.tension_distribution,
            rates.plant // rates.force_controller,
        )
        self._wrench: Array | None = None
        self._tensions: Array | None = None
        self._torque = torque
        self._counts = {"steps": 0, "infeasible": 0, "saturated": 0, "limited": 0}
        self._saturated = 0
        self.infeasible = False

    def step(
        self, step: int, measured: Mapping[str, Array], reference: Array | None, send: Send
    ) -> Array:
        """Return the torque command (n,) [N·m] at plant step `step`; `send` gets what is new."""
        motion, distribution, force = self._controllers
        pose, tension = measured.get("/bar/pose"), measured.get("/cables/tension")
        every_motion, every_distribution, every_force = self._dividers
        if step % every_motion == 0 and pose is not None and reference is not None:
            self._wrench = motion.step(pose, reference)
            send("/wrench_command", self._wrench)
        if step % every_distribution == 0 and pose is not None and self._wrench is not None:
            found = distribution.step(
                self._wrench, pose, measured.get("/winch_frame/pose", UNMOVED)
            )
            self._tensions, self.infeasible = found.tensions, not found.feasible
            self._saturated = found.saturated
            send("/tension_command", self._tensions)
        if step % every_force == 0 and tension is not None and self._tensions is not None:
            self._torque = force.step(self._tensions, tension)
            send("/winches/torque_command", self._torque)
        self._counts["steps"] += 1
        self._counts["infeasible"] += self.infeasible
        self._counts["saturated"] += self._saturated > 0
        self._counts["limited"] += force.saturated > 0
        return self._torque

    def statuses(self) -> list[Status]:
        """Return what happened since the last call."""
        counts, self._counts = self._counts, dict.fromkeys(self._counts, 0)
        steps = max(1, counts["steps"])
        shares = {name: f"{counts[name] / steps:.3f}" for name in counts if name != "steps"}
        return [
            _status(
                "tension_distribution",
                "wrench infeasible" if counts["infeasible"] else "tension at a limit",
                counts["infeasible"] or counts["saturated"],
                {"infeasible_share": shares["infeasible"], "saturated_share": shares["saturated"]},
            ),
            _status(
                "force_controller",
                "torque at its limit",
                counts["limited"],
                {"limited_share": shares["limited"]},
            ),
        ]


def _status(name: str, trouble: str, happened: int, values: dict[str, str]) -> Status:
    return Status(Level.WARN if happened else Level.OK, name, trouble if happened else "ok", values)
