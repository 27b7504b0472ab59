"""The measured signals that an effect's regressors read: one row per sample, columns by name.

All of them can be filled from a recording: smoothed readings, their derivatives, and what the
nominal model says at the measured state. Slices name what has several columns. Units SI, axes as in
docs/reference/conventions.md.
"""

from __future__ import annotations

from enum import IntEnum


class WinchSignal(IntEnum):
    """One winch, at the motor shaft."""

    ANGLE = 0
    SPEED = 1
    TENSION = 2
    RADIUS = 3  # drum radius / gear ratio [m]
    ACCELERATION = 4
    TORQUE = 5  # as the drive reports it
    TORQUE_RATE = 6
    GEAR = 7
    TIME = 8


class CableSignal(IntEnum):
    """One cable; what the nominal law says is taken at the measured state."""

    TIME = 0
    LENGTH = 1  # from exit to attachment [m]
    ELONGATION = 2  # length less unstretched length [m]
    RATE = 3  # of the elongation [m/s]
    TENSION = 4
    STIFFNESS = 5  # ∂t/∂ε of the law [N/m]
    LENGTH_SLOPE = 6  # ∂t/∂(elastic length) of the law at constant elongation [N/m]
    DAMPER = 7  # force of the nominal damper [N]
    WOUND = 8  # unstretched length / length
    ANGLE = 9  # of the motor
    SPEED = 10
    RADIUS = 11  # drum radius / gear ratio [m]
    GEAR = 12
    HORIZONTAL = 13  # horizontal share of the cable's direction
    GRAVITY = 14
    DAMPING = 15  # ∂t/∂ε̇ of the nominal damper [N·s/m]
    DOWNWARD = 16  # share of the cable's direction downwards, from exit to attachment
    LENGTH_BY_EXIT = 17  # three, slopes of its length over the exit x y z in winch frame axes
    LENGTH_BY_ATTACHMENT = 20  # three, over the attachment x y z in bar axes
    LENGTH_BY_PULLEY = 23  # over the radius of a pulley at the exit


class BarSignal(IntEnum):
    """The bar; slices of six are surge, sway, heave, roll, pitch, yaw in world axes."""

    VELOCITY = 0  # six
    ACCELERATION = 6  # six, of the bar frame's origin and of ω
    ROTATION = 12  # nine, R_world_bar row by row
    COM = 21  # three, centre of mass in bar axes [m]
    MASS = 24
    GRAVITY = 25
    TIME = 26
    POSE = 27  # six: position [m], Euler angles [rad]


class EndSignal(IntEnum):
    """One cable's end at the bar, world axes."""

    DIRECTION = 0  # three, from exit to attachment
    VELOCITY = 3  # three, of the attachment against the exit
    ARM = 6  # three, from the bar frame's origin to the attachment
    LENGTH = 9
    GRAVITY = 10
    EXIT_VELOCITY = 11  # three
    TENSION = 14
    WRENCH_BY_EXIT = 15  # 6 × 3 row by row, slopes per newton of its wrench on the bar
    WRENCH_BY_ATTACHMENT = 33  # likewise, over the attachment
    WRENCH_BY_PULLEY = 51  # six, over the radius of a pulley at the exit


class FrameSignal(IntEnum):
    """One cable's exit on the winch frame, world axes."""

    TIME = 0
    DIRECTION = 1  # three, from exit to attachment
    EXIT = 4  # three, exit in winch_frame_ned [m]
    ROTATION = 7  # nine, R_world_frame row by row
    FORCE = 16  # three, of all cables on the frame [N]
    STIFFNESS = 19  # ∂t/∂ε of the cable's law [N/m]


class ReadingSignal(IntEnum):
    """One reading of a sensor, as it should be."""

    TIME = 0
    VALUE = 1
    RATE = 2
    OTHERS = 3  # mean of the sensor's other readings of this kind


class PoseSignal(IntEnum):
    """A body's pose as it should be read, x y z φ θ ψ."""

    TIME = 0
    POSE = 1  # six
    RATE = 7  # six, of the pose's coordinates
