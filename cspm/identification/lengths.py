"""Identifying cable lengths: encoders against measured poses."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

from cspm.identification.identified import Identification, estimates, source_of
from cspm.measured import looked_at
from cspm.parameters import Parameters
from cspm.recorded import AnyRecording
from cspm.testbed import AnyTestbed
from cspm_ident.fitted_testbed import FittedNumber, with_fitted
from cspm_ident.lengths.identify_lengths import SCALE, LengthsResult
from cspm_ident.lengths.identify_lengths import identify_lengths as fit_lengths
from cspm_msgs_py.testbed import TestbedFile


def identify_lengths(
    recordings: AnyRecording | Iterable[AnyRecording],
    *,
    held_out: AnyRecording | Iterable[AnyRecording] = (),
    testbed: AnyTestbed | None = None,
) -> Identification[LengthsResult]:
    """Hold encoders against the lengths that poses give: `cspm identify lengths`.

    Args:
        recordings: to fit, all of one machine, with poses and motor angles.
        held_out: which judge without being fitted.
        testbed: the machine, instead of the one that the recordings carry.

    Raises:
        InputError: naming what is wrong in recordings or test-bed.
    """
    searched, judged, checks = looked_at(recordings, held_out, testbed)
    result = fit_lengths(searched, judged)
    file, source = searched[0].testbed, source_of(testbed, searched[0].path)
    return Identification(
        result,
        Parameters(p for cable in result.cables for p in estimates(cable.estimate, cable.name)),
        lambda: _fitted(result, file, source),
        _no_pictures,
        objections=result.objections,
        data_checks=checks,
    )


def _fitted(result: LengthsResult, file: TestbedFile, source: str) -> TestbedFile | None:
    """Return the file with the drum radii that the poses say, of scales that are off; or None."""
    hashes = tuple(m.sha256 for m in result.searched)
    windows = tuple((0.0, m.duration) for m in result.searched)
    radii = {cable.name: cable.drum_radius for cable in file.testbed.cables}
    changes = {}
    for cable in result.cables:
        if cable.is_off and not cable.objections:
            low, high = cable.estimate.interval(SCALE)
            radius = radii[cable.name]
            number = FittedNumber(
                radius * cable.estimate.value(SCALE),
                (radius * low, radius * high),
                hashes,
                windows,
                "as far as gear ratio and encoder are right",
            )
            changes[cable.name] = {"drum_radius": number}
    return with_fitted(file.text, source, changes) if changes else None


def _no_pictures(_: Path) -> dict[str, str]:
    return {}
