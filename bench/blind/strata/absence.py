"""By the absence of a sensor; one case in four has nothing to find."""

from bench.blind.stratum import MOVING, Case, Stratum

_NO_CELLS, _NO_CAPTURE = ("/cables/tension",), ("/bar/pose",)

ABSENCE = Stratum(
    "absence",
    1.0,
    (
        Case(scenarios=MOVING, without=_NO_CELLS),
        Case(scenarios=MOVING, without=_NO_CAPTURE),
        Case(("bristles",), (2.0, 4.0), MOVING, without=_NO_CELLS),
        Case(("drag on ropes",), (2.0, 4.0), MOVING, without=_NO_CELLS),
        Case(("internal friction",), (2.0, 4.0), MOVING, without=_NO_CELLS),
        Case(("bristles",), (2.0, 4.0), MOVING, without=_NO_CAPTURE),
        Case(("cell scale",), (2.0, 4.0), MOVING, without=_NO_CAPTURE),
        Case(("drive zero",), (2.0, 4.0), MOVING, without=_NO_CAPTURE),
    ),
)
