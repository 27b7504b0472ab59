"""Sensors that the test-bed file lists and a recording lacks."""

from __future__ import annotations

from cspm_ident.data_look.data_check import DataCheck, check_of
from cspm_ident.signals.measurement import BAR, FRAME, TENSION, WINCHES, Measurement

_WITHOUT = {
    FRAME: "where the winch frame was is unknown, so that cables and bar cannot be judged",
    BAR: "cables and bar cannot be judged",
    TENSION: "tensions are estimated from the winches' torques",
    WINCHES: "winches cannot be judged",
}


def sensor_check(measurement: Measurement) -> DataCheck:
    """Return which listed sensors were not recorded, and what cannot be judged without them."""
    listed = measurement.machine.sensors
    found = [
        f"{topic} is not there: {what}"
        for topic, what in _WITHOUT.items()
        if topic in listed and topic not in measurement.sensors
    ]
    remedy = "record it; what the machine does not have does not belong under `sensors` in its file"
    return check_of("sensors", measurement.path, found, "all sensors were recorded", remedy)
