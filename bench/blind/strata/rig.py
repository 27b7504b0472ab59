"""By there being one winch alone, as where winches are identified: no bar, no other cable."""

from bench.blind.stratum import Case, Stratum

_SCENARIOS = ("one_winch",)

RIG = Stratum(
    "rig",
    1.0,
    (
        Case(scenarios=_SCENARIOS),
        *(
            Case((name,), (2.0, 4.0), _SCENARIOS)
            for name in ("bristles", "breakaway", "grease", "cogging", "drive scale", "cell scale")
        ),
        Case(("inertia",), (2.0, 4.0), _SCENARIOS),
        Case(("radius",), (2.0, 4.0), _SCENARIOS),
    ),
)
