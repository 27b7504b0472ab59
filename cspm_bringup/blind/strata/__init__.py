"""The ways of concealing."""

from collections.abc import Mapping

from cspm_bringup.blind.strata.absence import ABSENCE
from cspm_bringup.blind.strata.company import COMPANY
from cspm_bringup.blind.strata.everywhere import EVERYWHERE
from cspm_bringup.blind.strata.feedback import FEEDBACK
from cspm_bringup.blind.strata.mistuned import MISTUNED
from cspm_bringup.blind.strata.noise import NOISE
from cspm_bringup.blind.strata.nothing import NOTHING
from cspm_bringup.blind.strata.onset import ONSET
from cspm_bringup.blind.strata.outside import OUTSIDE
from cspm_bringup.blind.strata.parameter import PARAMETER
from cspm_bringup.blind.strata.rig import RIG
from cspm_bringup.blind.stratum import Stratum

_ALL = (
    *(NOTHING, PARAMETER, NOISE, FEEDBACK, MISTUNED),
    *(COMPANY, ABSENCE, ONSET, EVERYWHERE, OUTSIDE, RIG),
)
STRATA: Mapping[str, Stratum] = {each.name: each for each in _ALL}
