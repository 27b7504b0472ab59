"""Motion control by state feedback about the bar's inverse dynamics: PD+ and LQR."""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

from cspm_control.controllers.bar_dynamics import bar_parameters, wanted_motion, wrench_for
from cspm_control.controllers.motion_controller import MotionController
from cspm_model.kernels.rotation import euler_from_quaternion
from cspm_msgs_py.testbed import Bar

Array = NDArray[np.float64]


class StateFeedback(MotionController):
    """From measured pose and reference to the wanted wrench on the bar, in world_ned.

    As the PID, except that the wrench without feedback is not the weight alone. It gives the
    nominal bar the reference's rate and acceleration at the measured attitude: M·q̈ + C·q̇ + g
    (Paden, Panja, Globally asymptotically stable 'PD+' controller for robot manipulators,
    International Journal of Control 47, 1988). The error then obeys m·ë = −w, w the feedback.
    Integral limits of 0 leave PD+.

    Attributes:
        bar: the kernels' parameters of the bar.
        scratch: of `add_inverse_dynamics`, (5, 6).
    """

    def _know(self, bar: Bar, gravity: float) -> None:
        super()._know(bar, gravity)
        self.bar, self.scratch = bar_parameters(bar, gravity), np.zeros((5, 6))

    def _carry(self, bar_pose: Array, reference: Array, wrench: Array) -> None:
        add_inverse_dynamics(bar_pose, reference, self.bar, self.scratch, wrench)


@njit(cache=True, error_model="numpy")
def add_inverse_dynamics(
    pose: Array, reference: Array, bar: Array, scratch: Array, out: Array
) -> None:
    """Add the wrench (6,) [N, N·m] that gives the bar the reference's motion at its attitude.

    `pose` (7,) and `reference` (19,) are rows; of `scratch` (5, 6) nothing is kept.
    """
    wanted_motion(reference, scratch[:3])
    place, wrench = scratch[3], scratch[4]
    place[0], place[1], place[2] = pose[0], pose[1], pose[2]
    place[3], place[4], place[5] = euler_from_quaternion(pose[3:7])
    wrench_for(place, scratch[1], scratch[2], bar, wrench)
    for d in range(6):
        out[d] += wrench[d]
