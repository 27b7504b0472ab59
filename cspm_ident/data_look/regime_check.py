"""Stretches that do not belong to the rest of a recording, and recordings without them."""

from __future__ import annotations

from cspm_ident.data_look.data_check import DataCheck, check_of
from cspm_ident.data_look.regimes import regimes_of
from cspm_ident.signals.measurement import Measurement


def regime_check(measurement: Measurement) -> DataCheck:
    """Return the stretches in which winches obey another equation than in the rest."""
    found = regimes_of(measurement)
    words = [
        f"{each.winch} from {each.start:.1f} to {each.end:.1f} s: its torque is off by"
        f" {each.torque:.2g} N·m, where {each.usual:.1g} is usual"
        for each in found
    ]
    remedy = "another load, a hand or a late effect; `--leave-out-regimes` leaves it out"
    well = "no stretch obeys another equation than the rest"
    stretches = tuple((each.start, each.end) for each in found)
    return check_of("regimes", measurement.path, words, well, remedy)._replace(stretches=stretches)


def without_stretches(measurement: Measurement, check: DataCheck) -> Measurement:
    """Return a recording without the stretches of a check; each leaves a hole in all sensors."""
    for start, end in check.stretches:
        measurement = measurement.without(start, end)
    return measurement
