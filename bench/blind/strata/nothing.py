"""By there being nothing to find."""

from bench.blind.stratum import Case, Stratum

NOTHING = Stratum("nothing", 4.0, (Case(),))
