"""By company: two things at once that are easily confused."""

from cspm_bringup.blind.stratum import MOVING, Case, Stratum

COMPANY = Stratum(
    "company",
    2.0,
    tuple(
        Case(pair, (2.0, 4.0), MOVING)
        for pair in (
            ("bristles", "grease"),
            ("bristles", "capstan"),
            ("cell scale", "drive scale"),
            ("cell zero", "drive zero"),
            ("internal friction", "damper"),
            ("slow elongation", "stiffness"),
            ("drag on ropes", "air"),
            ("late tracker", "internal friction"),
            ("mass", "wind"),
            ("cogging", "runout"),
            ("encoder counts", "radius"),
        )
    ),
)
