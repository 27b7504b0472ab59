"""By being the same on all eight cables, where no cable differs from the others."""

from bench.blind.stratum import MOVING, Case, Stratum

EVERYWHERE = Stratum(
    "everywhere",
    1.0,
    tuple(
        Case((name,), (2.0, 4.0), MOVING, everywhere=True)
        for name in (
            *("bristles", "grease", "capstan"),
            *("drag on ropes", "internal friction", "hanging rope"),
        )
    ),
)
