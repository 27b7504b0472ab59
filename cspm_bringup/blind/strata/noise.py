"""By noise: known effects about their detection limit, alone."""

from cspm_bringup.blind.stratum import ANY, MOVING, Case, Stratum

_MULTIPLES = (0.5, 1.0, 2.0, 4.0)
_ON_MOVING = (
    *("bristles", "breakaway", "loaded bristles", "grease", "cogging", "drive zero"),
    *("drive scale", "slow drive", "runout", "capstan", "encoder counts", "fast clock"),
)
_ON_ANY = (
    *("internal friction", "slow elongation", "drag on ropes", "drag on strings"),
    *("hanging rope", "air", "wind", "strapped load", "yielding frame"),
    *("cell zero", "cell scale", "late tracker", "shifted markers"),
)

NOISE = Stratum(
    "noise",
    6.5,
    tuple(Case((name,), _MULTIPLES, MOVING) for name in _ON_MOVING)
    + tuple(Case((name,), _MULTIPLES, ANY) for name in _ON_ANY),
)
