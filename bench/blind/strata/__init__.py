"""The ways of concealing."""

from collections.abc import Mapping

from bench.blind.strata.absence import ABSENCE
from bench.blind.strata.combined import COMBINED
from bench.blind.strata.everywhere import EVERYWHERE
from bench.blind.strata.feedback import FEEDBACK
from bench.blind.strata.mistuned import MISTUNED
from bench.blind.strata.noise import NOISE
from bench.blind.strata.nothing import NOTHING
from bench.blind.strata.onset import ONSET
from bench.blind.strata.outside import OUTSIDE
from bench.blind.strata.parameter import PARAMETER
from bench.blind.strata.rig import RIG
from bench.blind.stratum import Stratum

_ALL = (
    *(NOTHING, PARAMETER, NOISE, FEEDBACK, MISTUNED),
    *(COMBINED, ABSENCE, ONSET, EVERYWHERE, OUTSIDE, RIG),
)
STRATA: Mapping[str, Stratum] = {each.name: each for each in _ALL}
