"""Recordings as identification and diagnosis read them."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from pathlib import Path

from cspm.recorded import AnyRecording, Recording, path_of
from cspm.testbed import AnyTestbed, as_file
from cspm_ident.data_look.data_check import DataCheck
from cspm_ident.data_look.look import look_at, without_regimes
from cspm_ident.data_look.shared_rows import refuse_shared_rows
from cspm_ident.recording_roles import check_roles
from cspm_ident.signals.measurement import Measurement, read_measurement
from cspm_msgs_py.errors import InputError


def measured(recordings: Iterable[AnyRecording], testbed: AnyTestbed | None) -> list[Measurement]:
    """Return what was measured, said to be of a test-bed, or of those that the recordings carry.

    Raises:
        InputError: no recording, no test-bed, or other cables than the test-bed's.
    """
    file = None if testbed is None else as_file(testbed)
    return [read_measurement(path_of(each), file) for each in recordings]


def read_for(
    recordings: AnyRecording | Iterable[AnyRecording],
    held_out: AnyRecording | Iterable[AnyRecording],
    testbed: AnyTestbed | None,
    *,
    step: Callable[[str], None] = lambda _: None,
) -> tuple[list[Measurement], list[Measurement]]:
    """Return what is searched and what is held out; arguments and errors are those of `looked_at`.

    Raises:
        InputError: no recording, no test-bed, other cables than the test-bed's, or recordings that
            share rows.
    """
    step("reading")
    searched, judged = measured(listed(recordings), testbed), measured(listed(held_out), testbed)
    check_roles(searched, judged)
    refuse_shared_rows(searched, judged)
    return searched, judged


def looked_at(
    recordings: AnyRecording | Iterable[AnyRecording],
    held_out: AnyRecording | Iterable[AnyRecording],
    testbed: AnyTestbed | None,
    *,
    leave_out_regimes: bool = False,
    step: Callable[[str], None] = lambda _: None,
) -> tuple[list[Measurement], list[Measurement], tuple[DataCheck, ...]]:
    """Return what is searched, what is held out, and what a first look says of both.

    Args:
        recordings: to search.
        held_out: to judge by.
        testbed: the machine, instead of the one that the recordings carry.
        leave_out_regimes: whether stretches of another regime are left out.
        step: called with what is done next.

    Raises:
        InputError: no recording, no test-bed, other cables than the test-bed's, or recordings that
            share rows.
    """
    searched, judged = read_for(recordings, held_out, testbed, step=step)
    step("looking at the data")
    checks = look_at(searched, judged)
    if leave_out_regimes:
        searched, judged = without_regimes(searched, checks), without_regimes(judged, checks)
    return searched, judged, checks


def listed(recordings: AnyRecording | Iterable[AnyRecording]) -> Sequence[AnyRecording]:
    """Return one recording or several as a sequence.

    Raises:
        InputError: something else.
    """
    if isinstance(recordings, (Recording, str, Path)):
        return [recordings]
    found = list(recordings) if isinstance(recordings, Iterable) else [recordings]
    for each in found:
        if not isinstance(each, (Recording, str, Path)):
            raise InputError(
                f"{each!r}: is no recording, allowed: one that cspm.open or Run.save returns, or a"
                " path"
            )
    return found
