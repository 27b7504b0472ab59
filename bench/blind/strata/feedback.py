"""By feedback: what the controllers' integral action makes up for, in a slow sea."""

from bench.blind.stratum import Case, Stratum

FEEDBACK = Stratum(
    "feedback",
    1.0,
    tuple(
        Case((name,), (2.0, 4.0, 8.0), ("calm_broadband",))
        for name in ("drive zero", "drive scale", "bristles", "wind", "loaded bristles")
    ),
)
