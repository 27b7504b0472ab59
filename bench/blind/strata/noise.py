"""By noise: known effects about their detection limit, alone."""

from bench.blind.stratum import ANY, MOVING, Case, Stratum

_MULTIPLES = (0.5, 1.0, 2.0, 4.0)
_ON_MOVING = (
    *("bristles", "breakaway", "loaded bristles", "grease", "cogging", "drive zero"),
    *("drive scale", "runout", "capstan", "encoder counts", "fast clock"),
)
_ON_ANY = (
    *("internal friction", "slow elongation", "drag on ropes", "drag on strings"),
    *("hanging rope", "air", "wind", "strapped load", "yielding frame"),
    *("cell zero", "cell scale", "late tracker", "shifted markers"),
)

NOISE = Stratum(
    "noise",
    6.5,
    (
        # Of more the winches shake, which conceals nothing.
        Case(("slow drive",), _MULTIPLES[:3], MOVING),
        *(Case((name,), _MULTIPLES, MOVING) for name in _ON_MOVING),
        *(Case((name,), _MULTIPLES, ANY) for name in _ON_ANY),
    ),
)
