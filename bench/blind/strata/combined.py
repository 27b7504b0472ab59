"""By combination: two faults at once that are easily confused."""

from bench.blind.stratum import MOVING, Case, Stratum

# All that the catalogue declares as confounded, and a delay that looks like internal friction.
PAIRS = (
    ("bristles", "grease"),
    ("bristles", "breakaway"),
    ("breakaway", "grease"),
    ("bristles", "loaded bristles"),
    ("bristles", "capstan"),
    ("loaded bristles", "capstan"),
    ("damper", "grease"),
    ("cogging", "runout"),
    ("drive zero", "drive scale"),
    ("drive zero", "radius"),
    ("drive scale", "radius"),
    ("cell scale", "drive scale"),
    ("cell zero", "drive zero"),
    ("cell scale", "radius"),
    ("encoder counts", "radius"),
    ("encoder counts", "stiffness"),
    ("cell scale", "stiffness"),
    ("slow elongation", "stiffness"),
    ("internal friction", "slow elongation"),
    ("internal friction", "damper"),
    ("late tracker", "damper"),
    ("late tracker", "internal friction"),
    ("drag on ropes", "air"),
    ("hanging rope", "stiffness"),
    ("hanging rope", "mass"),
    ("fast clock", "late tracker"),
    ("yielding frame", "stiffness"),
    ("yielding frame", "strapped load"),
    ("cell scale", "mass"),
    ("cell zero", "wind"),
    ("mass", "wind"),
    ("mass", "strapped load"),
    ("inertia of the bar", "strapped load"),
    ("centre of mass", "wind"),
    ("centre of mass", "shifted markers"),
)

# Of a larger lag the winches shake, which conceals nothing.
SLOW = (("slow drive", "inertia"), ("slow drive", "late tracker"))

COMBINED = Stratum(
    "combined",
    2.5,
    (
        *(Case(pair, (2.0, 4.0), MOVING) for pair in PAIRS),
        *(Case(pair, (2.0,), MOVING) for pair in SLOW),
    ),
)
