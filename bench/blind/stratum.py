"""A way of concealing, and the cases from which its recordings are drawn."""

from __future__ import annotations

from dataclasses import dataclass

MOVING = ("calm_broadband", "worst_case_steep")
# Winches locked: what needs turning motors does not show in it.
LOCKED = ("verification_mid", "factor_six_mid")
ANY = (*MOVING, *LOCKED)


@dataclass(frozen=True)
class Case:
    """What one recording may conceal.

    Attributes:
        phenomena: names, all of them at once; none: nothing is concealed.
        multiples: amounts in detection limits, one of which is drawn.
        scenarios: one of which is drawn.
        everywhere: on all cables; otherwise on one that is drawn.
        onset_share: of the duration, when it begins; 0: it is there from the start.
        without: topics that are not recorded.
        absorbed_by: the number of the file that was fitted while the phenomenon acted.
    """

    phenomena: tuple[str, ...] = ()
    multiples: tuple[float, ...] = (1.0,)
    scenarios: tuple[str, ...] = ANY
    everywhere: bool = False
    onset_share: float = 0.0
    without: tuple[str, ...] = ()
    absorbed_by: str | None = None


@dataclass(frozen=True)
class Stratum:
    """A way of concealing.

    Attributes:
        name: as on the command line.
        share: of all recordings, in proportion to the other strata's.
        cases: of which one is drawn for each recording.
    """

    name: str
    share: float
    cases: tuple[Case, ...]
