"""Where in a machine's range something concealed acts, and whether a finding reports that."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from math import inf
from typing import Any, NamedTuple

Data = Mapping[str, Any]

TIME = "time"
# In Hz; of a force from outside, and as near as 30 s resolve it.
VIBRATION = 2.7
_RESOLVED = 1.0 / 30.0
# When an anchor begins to give way [s].
LOOSENING = 12.0


class Acts(NamedTuple):
    """Values of a signal by which something changes.

    Attributes:
        signal: as a diagnosis calls it, without its unit.
        low, high: ends of the values at which it acts.
    """

    signal: str
    low: float = -inf
    high: float = inf

    @property
    def both_ways(self) -> bool:
        """Whether it acts in both directions, as everything that goes by a motion does here."""
        return "speed" in self.signal or self.signal.startswith("rate")


_SPEED, _TENSION = Acts("speed"), Acts("tension")
_SHAFT_ANGLE, _WOUND, _STRETCHING = Acts("angle"), Acts("motor angle"), Acts("rate of elongation")
_ALONG = tuple(Acts(f"{dof} speed") for dof in ("surge", "sway", "heave"))
_ROLLING, *_SWINGING = (Acts(f"{dof} speed") for dof in ("roll", "pitch", "yaw"))
# By the truth's name: of which signals each is a function, by its own definition. What is
# constant, or goes by accelerations, by none of those that a diagnosis looks at.
ACTS: Mapping[str, tuple[Acts, ...]] = {
    "bristles": (_SPEED,),
    "breakaway": (_SPEED,),
    "loaded bristles": (_SPEED, _TENSION),
    "grease": (_SPEED,),
    "cogging": (_SHAFT_ANGLE,),
    "drive zero": (),
    "drive scale": (_TENSION, Acts("reported torque")),
    "slow drive": (),
    "runout": (_SHAFT_ANGLE, _WOUND, _TENSION),
    "eddy currents": (_SPEED,),
    "internal friction": (_TENSION, _STRETCHING),
    "slow elongation": (_TENSION,),
    "capstan": (_SPEED, _TENSION),
    "drag on ropes": (*_ALONG, _ROLLING, *_SWINGING),
    "drag on strings": (*_ALONG, _ROLLING, *_SWINGING),
    "hanging rope": (_TENSION,),
    "slip on the drum": (Acts(TIME),),
    "loosening anchor": (Acts(TIME, LOOSENING),),
    # A roll moves no strip, since they lie on its axis.
    "air": (*_ALONG, *_SWINGING),
    "wind": (),
    "vibration": (Acts("frequency", VIBRATION - _RESOLVED, VIBRATION + _RESOLVED),),
    "strapped load": (),
    "yielding frame": (),
    "cell zero": (),
    "cell scale": (_TENSION,),
    "warming cell": (Acts(TIME),),
    "encoder counts": (_SHAFT_ANGLE, _WOUND, _SPEED),
    "late tracker": (*_ALONG, _ROLLING, *_SWINGING, _STRETCHING),
    "fast clock": (Acts(TIME), *_ALONG, _ROLLING, *_SWINGING, _STRETCHING),
    "shifted markers": (),
    "mass": (),
    "inertia of the bar": (),
    "centre of mass": (),
    "stiffness": (_TENSION,),
    "damper": (_STRETCHING,),
    "inertia": (),
    "radius": (_TENSION, _WOUND),
}


def region_right(phenomenon: str, onset: float, finding: Data) -> bool | None:
    """Return whether all that a finding reports of where it acts is right; None: nothing.

    Args:
        phenomenon: what the finding names, by the truth's name.
        onset: when that begins [s]; 0: it is there from the start.
        finding: as `diagnosis.json` has it.
    """
    reported = finding.get("region") or {}
    claims: list[bool] = []
    if finding.get("onset_s") is not None:
        low, high = finding["onset_ci95_s"]
        claims.append(onset > 0.0 and low <= onset <= high)
    if reported:
        late = (Acts(TIME, onset),) if onset > 0.0 else ()
        claims.append(any(_holds(reported, acts) for acts in (*ACTS[phenomenon], *late)))
    return all(claims) if claims else None


def _holds(reported: Data, acts: Acts) -> bool:
    # "time, in sway [s]": each of the bar's components has its own.
    signal = str(reported["driver"]).split(" [")[0].split(", in ")[0]
    if signal != acts.signal:
        return False
    ends = _ends(reported)
    if ends is None:
        return True
    low, high = ends
    inside = acts.low <= low and high <= acts.high
    return inside and (low < 0.0 < high or not acts.both_ways)


def _ends(reported: Data) -> tuple[float, float] | None:
    """Return the values that are reported; None: a function over all that were recorded."""
    if "low" in reported:
        return reported["low"], reported["high"]
    at: Sequence[float] = reported.get("at", ())
    return (at[0], at[0]) if len(at) == 1 else None
