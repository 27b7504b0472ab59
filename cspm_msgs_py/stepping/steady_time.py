"""ROS time that neither jumps nor stands still, from a steady clock."""

from __future__ import annotations

# How fast the system's clock may be corrected and still be followed: ntpd and chrony slew by at
# most 500 and 83 333 ppm, chrony by default far less; a laboratory's quartz is off by 100 ppm.
_SLEW = 1e-3
# What is off by more than this [ns] was set, not corrected: the age at which inputs are stale.
STEP_NS = 50_000_000


class SteadyTime:
    """Follows a ROS clock as far as that is corrected slowly, and reports when it was set.

    After that it goes on as if nothing had happened, so that waiting times are kept, until
    `accept` takes the clock as it is.
    """

    def __init__(self, ros_ns: int, steady_ns: int) -> None:
        """Take both clocks' readings of one instant [ns]."""
        self._offset = self._apart = 0.0
        self._begin(ros_ns, steady_ns)

    def _begin(self, ros_ns: int, steady_ns: int) -> None:
        self._base = ros_ns - steady_ns
        self._offset = self._apart = 0.0
        self._looked = steady_ns

    def now_ns(self, steady_ns: int) -> int:
        """Return the time [ns] at a reading of the steady clock [ns]."""
        return steady_ns + self._base + round(self._offset)

    def look(self, ros_ns: int, steady_ns: int) -> str | None:
        """Compare the clocks; return in one line that the ROS clock was set, each time once."""
        most = _SLEW * max(0, steady_ns - self._looked)
        self._looked = steady_ns
        error = ros_ns - steady_ns - self._base - self._apart - self._offset
        self._offset += min(max(error, -most), most)
        if abs(error) <= STEP_NS:
            return None
        self._apart += error
        return (
            f"the ROS clock was set by {error * 1e-9:+.3f} s, allowed: corrections of up to"
            f" {STEP_NS * 1e-9:g} s"
        )

    def accept(self, ros_ns: int, steady_ns: int) -> None:
        """Take the ROS clock as it is now."""
        self._begin(ros_ns, steady_ns)
