"""What a machine does when it can no longer be controlled: the scenario's safe state."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import (
    Field,
    PositiveFloat,
    SerializerFunctionWrapHandler,
    model_serializer,
)

from cspm_msgs_py.yaml_file import StrictModel

LONGEST = 10.0  # s; a bar that nobody controls for longer is no longer where it was

Wait = Annotated[float, Field(gt=0.0, le=LONGEST)]


class Safety(StrictModel):
    """The safe state and what leads to it.

    Attributes:
        state: `hold`: the winches hold the bar by their motors; `brake`: zero torque, brakes set.
        ramp_time: from the tension measured last to the balancing one [s], in `hold`.
        stale_after: an input older than this is stale [s], and so is one of a noisy sensor that
            repeats itself for longer; in lockstep inputs are waited for.
        tension_trip: a measured tension above it trips [N]; None: twice each cable's upper limit.
        torque_slew: fastest change of a torque command [N·m/s]; None: from one torque limit to the
            other within one period of the force controller, which never acts.
        watchdog: the plant goes to the safe state by itself without a torque command for so long
            [s].
        lateness: largest age of the state that a torque command answers [s], in real time; None:
            what the delay margin of the force loops allows.
        stop_heartbeat: longest silence of the emergency stop [s]; None: it may be silent.
        workspace: largest distance of a body from its mean position [m]; None: the machine's size.
        pose_speed: largest speed of a body's points [m/s]; None: what the cables can give the bar.
        pose_acceleration: largest acceleration of a body's points [m/s²], beyond which a pose
            trembles by more than its sensor's noise; None: what the cables can give the bar.
        following_error: largest distance of the bar's points from where they are wanted [m]; None:
            three times the simulated tracking error, at most half the machine's size.
        torque_mismatch: torque at the motor shaft by which tension and motion may be missed [N·m];
            None: a twentieth of each motor's limit.
    """

    state: Literal["hold", "brake"] = "hold"
    ramp_time: Annotated[float, Field(ge=0.0, le=LONGEST)] = 0.5
    stale_after: Wait = 0.05
    tension_trip: PositiveFloat | None = None
    torque_slew: PositiveFloat | None = None
    watchdog: Wait = 0.05
    lateness: Wait | None = None
    stop_heartbeat: Wait | None = None
    workspace: PositiveFloat | None = None
    pose_speed: PositiveFloat | None = None
    pose_acceleration: PositiveFloat | None = None
    following_error: PositiveFloat | None = None
    torque_mismatch: PositiveFloat | None = None

    @model_serializer(mode="wrap")
    def _written(self, write: SerializerFunctionWrapHandler) -> dict[str, object]:
        """Leave out what was added to recordings later, so that those of before stay the same."""
        found: dict[str, object] = write(self)
        if self.lateness is None:
            found.pop("lateness", None)
        return found
