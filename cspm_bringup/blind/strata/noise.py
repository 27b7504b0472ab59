"""By noise: known effects about their detection limit, alone."""

from cspm_bringup.blind.stratum import ANY, MOVING, Case, Stratum

_MULTIPLES = (0.5, 1.0, 2.0, 4.0)
_ON_MOVING = (
    *("bristles", "breakaway", "loaded bristles", "grease", "cogging", "drive zero"),
    *("drive scale", "runout", "capstan", "encoder counts"),
)
_ON_ANY = (
    *("internal friction", "slow elongation", "drag on ropes", "air", "wind", "cell zero"),
    *("cell scale", "late tracker", "shifted markers", "strapped load"),
)

NOISE = Stratum(
    "noise",
    7.0,
    tuple(Case((name,), _MULTIPLES, MOVING) for name in _ON_MOVING)
    + tuple(Case((name,), _MULTIPLES, ANY) for name in _ON_ANY),
)
