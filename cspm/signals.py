"""Recorded or simulated quantities by name, as arrays in SI units."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.lib.mixins import NDArrayOperatorsMixin
from numpy.typing import NDArray

from cspm_model.kernels.trajectory import eulers_along
from cspm_msgs_py.dofs import DOFS
from cspm_msgs_py.errors import InputError
from cspm_msgs_py.installed.extra_library import extra_library
from cspm_msgs_py.recording.rows import Rows
from cspm_msgs_py.topics import POSE, Topic

if TYPE_CHECKING:
    import pandas
    import xarray

Array = NDArray[np.float64]

POSE_UNITS = ("m", "m", "m", "rad", "rad", "rad")
WRENCH_UNITS = ("N", "N", "N", "N·m", "N·m", "N·m")


@dataclass(frozen=True, eq=False)
class Signal(NDArrayOperatorsMixin):
    """One quantity over time; it works as an array of shape (n, k) wherever one is taken.

    `signal["sway_3"]` is one column, (n,); any other index is that of the array.

    Examples:
        >>> import numpy as np
        >>> from cspm import Signal
        >>> tension = Signal("tension", np.arange(3.0), np.eye(3, 2), ("a", "b"), ("N", "N"))
        >>> tension["b"]
        array([0., 1., 0.])
        >>> (2.0 * tension).shape
        (3, 2)

    Attributes:
        name: of the quantity.
        time: when the values are valid, (n,) [s].
        values: (n, k).
        columns: names of the columns: cables, degrees of freedom or fields.
        units: of the columns.
    """

    name: str
    time: Array
    values: Array
    columns: tuple[str, ...]
    units: tuple[str, ...]

    @property
    def shape(self) -> tuple[int, ...]:
        """Shape (n, k) of the values."""
        return self.values.shape

    def __getitem__(self, key: Any) -> Array:  # noqa: ANN401 - any index
        if not isinstance(key, str):
            return np.asarray(self.values[key])
        if key not in self.columns:
            raise InputError(f"{self.name}: no {key}, allowed: {', '.join(self.columns)}")
        return self.values[:, self.columns.index(key)]

    def __len__(self) -> int:
        return len(self.values)

    def __iter__(self) -> Iterator[Array]:
        return iter(self.values)

    def __array__(self, dtype: Any = None, copy: bool | None = None) -> Array:  # noqa: ANN401
        return np.array(self.values, dtype=dtype, copy=copy)

    def __array_ufunc__(self, ufunc: np.ufunc, method: str, *inputs: Any, **more: Any) -> Any:  # noqa: ANN401
        plain = [each.values if isinstance(each, Signal) else each for each in inputs]
        return getattr(ufunc, method)(*plain, **more)

    def __repr__(self) -> str:
        return f"Signal({self.name!r}, {len(self.time)} × {', '.join(self.columns)})"


class _Place(NamedTuple):
    """Where a quantity is: topic, what part of its message, and its unit."""

    topic: str
    part: str
    unit: str = ""


_PLACES = {
    "bar_pose": _Place("/bar/pose", "pose"),
    "frame_pose": _Place("/winch_frame/pose", "pose"),
    "target_pose": _Place("/target/pose", "pose"),
    "winch_angle": _Place("/winches/state", "position", "rad"),
    "winch_speed": _Place("/winches/state", "velocity", "rad/s"),
    "winch_torque": _Place("/winches/state", "effort", "N·m"),
    "tension": _Place("/cables/tension", "effort", "N"),
}
_WANTED = {
    "bar_reference": _Place("/bar/reference", "pose"),
    "frame_reference": _Place("/winch_frame/reference", "pose"),
    "wrench_command": _Place("/wrench_command", "wrench"),
    "tension_command": _Place("/tension_command", "effort", "N"),
    "torque_command": _Place("/winches/torque_command", "effort", "N·m"),
}
_TRUTH = "/truth"


class Signals(ABC):
    """Quantities by name. What is measured comes from the sensors, with their noise and delay.

    Poses are x y z φ θ ψ in world_ned [m, rad], angles without jumps, shape (n, 6), with the
    columns surge, sway, heave, roll, pitch, yaw. Winch quantities are at the motor shaft, positive
    winds in, with a column per cable. Time counts from the recording's start [s].

    A quantity that is not recorded raises `InputError`, which lists those that are.
    """

    @abstractmethod
    def _topics(self) -> tuple[str, ...]:
        """Return the names of all topics with messages."""

    @abstractmethod
    def _read(self, name: str) -> tuple[Topic, Rows]:
        """Return a topic and its messages."""

    @abstractmethod
    def _start_ns(self) -> int:
        """Return the instant from which time counts [ns]."""

    @property
    def topics(self) -> tuple[str, ...]:
        """Names of all topics with messages."""
        return self._topics()

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the quantities that are recorded, such as `tension`."""
        topics = self._topics()
        return tuple(n for n, place in (_PLACES | _WANTED).items() if place.topic in topics)

    @property
    def time(self) -> Array:
        """Stamps of the sensor with the most samples, (n,) [s]; each signal has its own `time`."""
        sensors = [name for name in self.names if name in _PLACES]
        if not sensors:
            raise InputError(f"{self._label}: no measured topic, it has: {self._listed()}")
        return max((self.signal(name).time for name in sensors), key=len)

    @property
    def bar_pose(self) -> Signal:
        """Measured pose of the bar, (n, 6) [m, rad]."""
        return self.signal("bar_pose")

    @property
    def frame_pose(self) -> Signal:
        """Measured pose of the winch frame, (n, 6) [m, rad]."""
        return self.signal("frame_pose")

    @property
    def winch_angle(self) -> Signal:
        """Measured motor angles, (n, cables) [rad]."""
        return self.signal("winch_angle")

    @property
    def winch_speed(self) -> Signal:
        """Measured motor speeds, (n, cables) [rad/s]."""
        return self.signal("winch_speed")

    @property
    def winch_torque(self) -> Signal:
        """Motor torques as the drives report them, (n, cables) [N·m]."""
        return self.signal("winch_torque")

    @property
    def tension(self) -> Signal:
        """Measured cable tensions, (n, cables) [N]."""
        return self.signal("tension")

    @property
    def bar_reference(self) -> Signal:
        """Wanted pose of the bar, (n, 6) [m, rad]."""
        return self.signal("bar_reference")

    @property
    def frame_reference(self) -> Signal:
        """Wanted pose of the winch frame, (n, 6) [m, rad]."""
        return self.signal("frame_reference")

    @property
    def wrench_command(self) -> Signal:
        """Wanted wrench on the bar in world_ned, (n, 6) [N, N·m]."""
        return self.signal("wrench_command")

    @property
    def tension_command(self) -> Signal:
        """Wanted tensions, (n, cables) [N]."""
        return self.signal("tension_command")

    @property
    def torque_command(self) -> Signal:
        """Commanded motor torques, (n, cables) [N·m]."""
        return self.signal("torque_command")

    @property
    def truth(self) -> Truth:
        """The simulated state without noise, by the same names: `truth.tension`, `truth.bar_pose`.

        Raises:
            InputError: it is not recorded, as on hardware.
        """
        return Truth(self)

    def _repr_html_(self) -> str:
        """Show the signals as a table in a notebook."""
        from cspm.notebook import signals_table

        return signals_table(repr(self), self)

    @property
    def _label(self) -> str:
        return type(self).__name__.lower()

    def _listed(self) -> str:
        return ", ".join(self._topics()) or "none"

    def signal(self, name: str) -> Signal:
        """Return a quantity by its name, one of `names`, or all columns of a topic by the topic's.

        Raises:
            InputError: it is not recorded, or a topic carries no row of numbers.
        """
        place = (_PLACES | _WANTED).get(name, _Place(name, ""))
        if place.topic not in self._topics():
            has = ", ".join((*self.names, *self._topics()))
            raise InputError(f"{self._label}: no {name}, it has: {has or 'none'}")
        topic, rows = self._read(place.topic)
        time = np.asarray((rows.stamp_ns - self._start_ns()) / 1e9, dtype=np.float64)
        columns, values, units = _part(topic, rows.rows, place)
        return Signal(name, time, values, columns, units)

    def to_pandas(self, *names: str) -> pandas.DataFrame:
        """Return signals as a table with a row per stamp and the time [s] as its index.

        A column is called `tension/sway_3`. Where signals have different stamps, a row has numbers
        for those that have this one, and NaN for the others.

        Args:
            names: of the signals; none: all that `names` lists.

        Raises:
            InputError: pandas is not installed, or a signal is not recorded.
        """
        pd = extra_library("pandas", "tables", "to_pandas")
        tables = [
            pd.DataFrame(
                s.values,
                index=pd.Index(s.time, name="time"),
                columns=[f"{s.name}/{column}" for column in s.columns],
            )
            for s in map(self.signal, names or self.names)
        ]
        found: pandas.DataFrame = pd.concat(tables, axis=1).sort_index()
        return found

    def to_xarray(self, *names: str) -> xarray.Dataset:
        """Return signals as a data set over `time` [s], `cable` and `dof`.

        Where signals have different stamps, those that have not one are NaN there.

        Args:
            names: of the signals; none: all that `names` lists.

        Raises:
            InputError: xarray is not installed, or a signal is not recorded.
        """
        xr = extra_library("xarray", "tables", "to_xarray")
        found: xarray.Dataset = xr.Dataset(
            {
                s.name.strip("/"): xr.DataArray(
                    s.values,
                    dims=("time", _dimension(s)),
                    coords={"time": s.time, _dimension(s): list(s.columns)},
                    attrs={"units": ", ".join(dict.fromkeys(s.units))},
                )
                for s in map(self.signal, names or self.names)
            }
        )
        return found


class Truth(Signals):
    """What a simulation knows and no sensor measures."""

    def __init__(self, whole: Signals) -> None:
        """Take the run or recording.

        Raises:
            InputError: it has no truth.
        """
        self._whole = whole
        if not self._topics():
            raise InputError(f"{whole._label}: no {_TRUTH} topics, allowed: what was simulated")

    def _topics(self) -> tuple[str, ...]:
        names = self._whole.topics
        return tuple(n.removeprefix(_TRUTH) for n in names if n.startswith(f"{_TRUTH}/"))

    def _read(self, name: str) -> tuple[Topic, Rows]:
        return self._whole._read(f"{_TRUTH}{name}")

    def _start_ns(self) -> int:
        return self._whole._start_ns()


def _part(
    topic: Topic, rows: Array, place: _Place
) -> tuple[tuple[str, ...], Array, tuple[str, ...]]:
    """Return columns, values and units of a part of a topic's rows."""
    if place.part == "pose":
        return DOFS, _poses(rows), POSE_UNITS
    if place.part == "wrench":
        return DOFS, rows, WRENCH_UNITS
    if not place.part:
        return topic.fields, rows, ("",) * topic.width
    kept = [i for i, field in enumerate(topic.fields) if field.startswith(f"{place.part}/")]
    if not kept:
        raise InputError(f"{topic.name}: carries no {place.part}, it has: {', '.join(topic.parts)}")
    columns = tuple(topic.fields[i].partition("/")[2] for i in kept)
    return columns, rows[:, kept], (place.unit,) * len(kept)


def _poses(rows: Array) -> Array:
    """Return x y z φ θ ψ, (n, 6), of rows that begin with a pose and its quaternion."""
    found = np.empty((len(rows), 6))
    found[:, :3] = rows[:, :3]
    eulers_along(np.ascontiguousarray(rows[:, 3 : len(POSE)]), found[:, 3:])
    found[:, 3:] = np.unwrap(found[:, 3:], axis=0)
    return found


def _dimension(signal: Signal) -> str:
    if signal.columns == DOFS:
        return "dof"
    return f"field of {signal.name}" if signal.name.startswith("/") else "cable"
