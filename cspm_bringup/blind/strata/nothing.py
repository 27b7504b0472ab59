"""By there being nothing to find."""

from cspm_bringup.blind.stratum import Case, Stratum

NOTHING = Stratum("nothing", 3.0, (Case(),))
