"""Identifying a machine's geometry: poses against encoders."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from pathlib import Path

from cspm.identification.identified import Identification, source_of
from cspm.measured import looked_at
from cspm.parameters import Parameter, Parameters
from cspm.recorded import AnyRecording
from cspm.testbed import AnyTestbed
from cspm_ident.geometry.fitted_file import fitted_file
from cspm_ident.geometry.identify_geometry import GeometryResult
from cspm_ident.geometry.identify_geometry import identify_geometry as fit_geometry


def identify_geometry(
    recordings: AnyRecording | Iterable[AnyRecording],
    *,
    held_out: AnyRecording | Iterable[AnyRecording] = (),
    testbed: AnyTestbed | None = None,
) -> Identification[GeometryResult]:
    """Fit where cables begin and end, and drum radii: `cspm identify geometry`.

    Each parameter is by how much the file's number is off; of radii and stiffnesses, which share.

    Args:
        recordings: to fit, all of one machine, with poses and motor angles.
        held_out: which judge without being fitted.
        testbed: the machine, instead of the one that the recordings carry.

    Raises:
        InputError: naming what is wrong in recordings or test-bed.
    """
    searched, judged, checks = looked_at(recordings, held_out, testbed)
    result = fit_geometry(searched, judged)
    file, source = searched[0].testbed, source_of(testbed, searched[0].path)
    return Identification(
        result,
        Parameters(_parameters(result)),
        lambda: fitted_file(result, file, source),
        _no_pictures,
        objections=result.objections,
        data_checks=checks,
    )


def _parameters(result: GeometryResult) -> Iterator[Parameter]:
    for cable in result.cables:
        for each in cable.numbers:
            yield Parameter(each.name, cable.name, each.off, each.unit, each.ci95)
    late = result.lateness
    yield Parameter(late.name, "", late.off, late.unit, late.ci95)


def _no_pictures(_: Path) -> dict[str, str]:
    return {}
