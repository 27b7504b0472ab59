"""A look at recordings before any model is fitted to them."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from cspm_ident.data_look.channel_checks import (
    constant_check,
    jump_check,
    saturation_check,
    slack_check,
)
from cspm_ident.data_look.data_check import DataCheck
from cspm_ident.data_look.motion_checks import excitation_check, length_check, standstill_check
from cspm_ident.data_look.regime_check import regime_check, without_stretches
from cspm_ident.data_look.sensor_check import sensor_check
from cspm_ident.data_look.stamp_check import stamp_check
from cspm_ident.signals.measurement import Measurement

CHECKS: tuple[Callable[[Measurement], DataCheck], ...] = (
    sensor_check,
    length_check,
    excitation_check,
    standstill_check,
    slack_check,
    saturation_check,
    stamp_check,
    constant_check,
    jump_check,
    regime_check,
)


def look_at(
    searched: Sequence[Measurement], held_out: Sequence[Measurement] = ()
) -> tuple[DataCheck, ...]:
    """Return what all checks find in all recordings, well or not.

    Args:
        searched: recordings to search or fit.
        held_out: those for the hold-out test.
    """
    return tuple(check(each) for each in (*searched, *held_out) for check in CHECKS)


def without_regimes(
    recordings: Sequence[Measurement], checks: Sequence[DataCheck]
) -> list[Measurement]:
    """Return recordings without the stretches that checks say do not belong to the rest."""
    found = []
    for each in recordings:
        for check in checks:
            if check.recording == each.path and check.stretches:
                each = without_stretches(each, check)
        found.append(each)
    return found
