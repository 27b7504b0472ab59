"""By a late onset."""

from bench.blind.stratum import MOVING, Case, Stratum

ONSET = Stratum(
    "onset",
    1.0,
    tuple(
        Case((name,), (4.0, 8.0), MOVING, onset_share=0.4)
        for name in ("bristles", "drive scale", "cell zero", "cell scale", "internal friction")
    ),
)
