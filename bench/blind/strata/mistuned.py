"""By a number of the file that was fitted while the effect acted, and took part of it over."""

from bench.blind.stratum import MOVING, Case, Stratum

MISTUNED = Stratum(
    "mistuned",
    1.0,
    (
        Case(("internal friction",), (2.0, 4.0), MOVING, absorbed_by="damper"),
        Case(("slow elongation",), (2.0, 4.0), MOVING, absorbed_by="stiffness"),
        Case(("drive scale",), (2.0, 4.0), MOVING, absorbed_by="radius"),
    ),
)
