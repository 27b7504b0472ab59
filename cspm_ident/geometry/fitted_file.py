"""A test-bed file with the geometry that was identified."""

from __future__ import annotations

import io

from cspm_ident.fitted_testbed import FittedNumber, with_fitted
from cspm_ident.geometry.identify_geometry import AXES, RADIUS, CableGeometry, GeometryResult
from cspm_ident.geometry.unknowns import ENDS
from cspm_ident.system.choice import PointPlace
from cspm_ident.system.fitted_file import put_point
from cspm_msgs_py.testbed import TestbedFile, parse_testbed
from cspm_msgs_py.yaml_file import round_trip


def fitted_file(result: GeometryResult, file: TestbedFile, source: str) -> TestbedFile:
    """Return the file with all ends as the poses see them, and all drum radii of moving winches.

    They belong together: where only their sum is known, a part of them would be another machine.
    Cables whose numbers are no result stay.

    Args:
        result: what was identified.
        file: of the machine that was described.
        source: names it in errors.
    """
    good = [i for i, cable in enumerate(result.cables) if cable.moves and not cable.objections]
    names = file.testbed.cable_names
    drums = {names[i]: {"drum_radius": _radius(result, file, i)} for i in good}
    yaml = round_trip()
    content = yaml.load(with_fitted(file.text, source, drums).text)
    for i in good:
        cable, described = result.cables[i], file.testbed.cables[i]
        for end in ENDS:
            for axis, at in enumerate(getattr(described, end)):
                number = _number(result, cable, f"{end} {AXES[axis]}", at, 1.0)
                put_point(content["cables"], PointPlace(i, end, axis), number)
    stream = io.StringIO()
    yaml.dump(content, stream)
    return parse_testbed(stream.getvalue(), source)


def _radius(result: GeometryResult, file: TestbedFile, i: int) -> FittedNumber:
    radius = file.testbed.cables[i].drum_radius
    note = "as far as gear ratio and encoder are right"
    return _number(result, result.cables[i], RADIUS, radius, radius, note)


def _number(
    result: GeometryResult,
    cable: CableGeometry,
    name: str,
    described: float,
    unit: float,
    note: str = "",
) -> FittedNumber:
    """Return a number as described, with what it is off by in `unit` added."""
    found = cable.number(name)
    low, high = (described + unit * end for end in found.ci95)
    if not found.determined:
        note = "; ".join([each for each in (note, "not determined by the motion") if each])
    hashes = tuple(m.sha256 for m in result.searched)
    windows = tuple((0.0, m.duration) for m in result.searched)
    return FittedNumber(described + unit * found.off, (low, high), hashes, windows, note)
