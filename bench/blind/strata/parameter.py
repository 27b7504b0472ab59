"""By a number of the file that is wrong while no physics is missing."""

from bench.blind.stratum import ANY, MOVING, Case, Stratum

PARAMETER = Stratum(
    "parameter",
    4.0,
    (
        Case(("mass",), (2.0, 4.0), ANY),
        Case(("centre of mass",), (2.0, 4.0), ANY),
        Case(("inertia of the bar",), (2.0, 4.0), ("worst_case_steep",)),
        Case(("stiffness",), (2.0, 4.0), ANY),
        Case(("damper",), (2.0, 4.0), MOVING),
        Case(("inertia",), (2.0, 4.0), MOVING),
        Case(("radius",), (2.0, 4.0), MOVING),
    ),
)
