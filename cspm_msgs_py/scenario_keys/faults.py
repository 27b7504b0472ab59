"""The key `faults:` of a scenario: what fails during a run, and for how long."""

from __future__ import annotations

import math
from typing import Literal, get_args

from pydantic import NonNegativeFloat, PositiveFloat

from cspm_msgs_py.errors import InputError
from cspm_msgs_py.testbed import Testbed
from cspm_msgs_py.yaml_file import StrictModel

Kind = Literal[
    "sensor_frozen",
    "sensor_noisy",
    "sensor_biased",
    "sensor_late",
    "sensor_dropped",
    "winch_weak",
    "cable_cut",
    "brake",
]
KINDS: tuple[str, ...] = get_args(Kind)
# What `amount` is, where a kind has one.
AMOUNTS: dict[str, str] = {
    "sensor_noisy": "standard deviation of what is added, in the sensor's unit",
    "sensor_biased": "what is added, in the sensor's unit",
    "sensor_late": "by how much messages come later than their stamps say, s",
    "winch_weak": "remaining share of the torque",
}
ON_SENSORS = tuple(kind for kind in KINDS if kind.startswith("sensor_"))
ON_CABLES = ("winch_weak", "cable_cut")
# In lockstep every message is waited for.
ONLY_IN_REAL_TIME = ("sensor_late", "sensor_dropped")


class Fault(StrictModel):
    """Something that fails.

    Attributes:
        at: the instant from which it does [s], since the start of the run.
        fault: what it is.
        on: a measured topic for sensors, a cable for winches and cables, nothing for the brake.
        amount: see `AMOUNTS`.
        lasts: for how long [s]; absent, to the end. A cut lasts anyway.
    """

    at: NonNegativeFloat = 0.0
    fault: Kind
    on: str = ""
    amount: float | None = None
    lasts: PositiveFloat | None = None

    def __str__(self) -> str:
        """Return it in words."""
        where = f" on {self.on}" if self.on else ""
        how = "" if self.amount is None else f", {self.amount:g}"
        lasts = "" if self.lasts is None else f", for {self.lasts:g} s"
        return f"{self.fault}{where}{how}{lasts}"


def check_fault(fault: Fault, testbed: Testbed, where: str, *, realtime: bool) -> None:
    """Check that a machine has what fails, and that it can fail so.

    Args:
        fault: what fails.
        testbed: the machine.
        where: names it in errors.
        realtime: whether the run is one in real time.

    Raises:
        InputError: naming what is wrong and what is allowed.
    """
    places = _places(fault, testbed)
    if places and fault.on not in places:
        raise InputError(f"{where}: on {fault.on or 'nothing'}, allowed: {', '.join(places)}")
    if not places and fault.on:
        raise InputError(f"{where}: on {fault.on}, allowed for {fault.fault}: nothing")
    if (fault.amount is None) == (fault.fault in AMOUNTS):
        allowed = AMOUNTS.get(fault.fault, "none")
        raise InputError(f"{where}: amount {fault.amount}, allowed for {fault.fault}: {allowed}")
    _check_amount(fault, where)
    if fault.fault in ONLY_IN_REAL_TIME and not realtime:
        raise InputError(
            f"{where}: {fault.fault}, allowed in lockstep, where every message is waited for:"
            f" {', '.join(kind for kind in KINDS if kind not in ONLY_IN_REAL_TIME)}"
        )


def _check_amount(fault: Fault, where: str) -> None:
    amount = fault.amount
    if amount is None:
        return
    if not math.isfinite(amount) or (amount < 0.0 and fault.fault != "sensor_biased"):
        raise InputError(f"{where}: amount {amount}, allowed: {AMOUNTS[fault.fault]}, 0 or more")
    if fault.fault == "winch_weak" and amount > 1.0:
        raise InputError(f"{where}: amount {amount:g}, allowed: 0 to 1, {AMOUNTS[fault.fault]}")


def _places(fault: Fault, testbed: Testbed) -> list[str]:
    if fault.fault in ON_SENSORS:
        return list(testbed.sensors)
    if fault.fault not in ON_CABLES:
        return []
    cuts = fault.fault == "cable_cut"
    return [cable.name for cable in testbed.cables if cable.has_cable or not cuts]
