"""By not being in the catalogue."""

from bench.blind.stratum import ANY, MOVING, Case, Stratum

OUTSIDE = Stratum(
    "outside",
    2.0,
    (
        Case(("eddy currents",), (4.0, 8.0), MOVING),
        Case(("slip on the drum",), (4.0, 8.0), MOVING),
        Case(("loosening anchor",), (4.0, 8.0), ANY),
        Case(("vibration",), (4.0, 8.0), ANY),
        Case(("warming cell",), (4.0, 8.0), ANY),
    ),
)
