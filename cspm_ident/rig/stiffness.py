"""The stiffness of one kind of cable from slow ramps at several lengths (thesis, 3-2-1)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.stats import t as student

from cspm_ident.estimation.objection import Objection, error_objections, sign_objections
from cspm_ident.rig.branches import BRANCHES, Branch, mean_branches
from cspm_ident.rig.candidates import Rank, rank_candidates
from cspm_ident.rig.distortion import centred, modelled, undistorted
from cspm_ident.rig.flanks import Ramps, find_ramps
from cspm_ident.rig.hysteresis import Hysteresis, find_hysteresis
from cspm_ident.rig.law import Law, law_of, section_of
from cspm_ident.rig.law_interval import with_intervals
from cspm_ident.rig.response import Response, find_response
from cspm_ident.rig.specimen import Specimen
from cspm_ident.rig.stiffness_fit import ASYMPTOTE_SHARE, Fitted, above_cap, fit_law
from cspm_ident.vaf import error_percent, vaf
from cspm_msgs_py.errors import InputError
from cspm_msgs_py.testbed_keys.near_name import allowed_names

Array = NDArray[np.float64]

SIGN_REMEDY = "check the signs of angle and tension"
CUTOFF = 2.0
MEAN, POINTS = "mean", 100
# Where the winch rests the encoder is off by a part of its step all the time; through the filter
# that reaches so many samples into the ramp, equal in every cycle.
REACH = 3
# The law determines how far the cables are stretched at their lowest tension and what the filter
# did to them, and that changes the law by a tenth of its interval at most from the third round on.
ROUNDS = 4


@dataclass(frozen=True)
class SpecimenStiffness:
    """How well the law fits one specimen.

    Attributes:
        ramps: its measured flanks.
        fitted: whether it is among those that the law was fitted to.
        branches: mean over the cycles, up and down.
        vaf: of the stiffness [%], of `up`, of `down`, and of the mean of both over the tension.
        hysteresis: the size of its loops.
        asymptote: E [N/m²] from its part on the asymptote and its 95 % interval; None where it has
            none.
    """

    ramps: Ramps
    fitted: bool
    branches: tuple[Branch, ...]
    vaf: dict[str, float]
    hysteresis: Hysteresis
    asymptote: tuple[float, tuple[float, float]] | None

    @property
    def specimen(self) -> Specimen:
        """The cable."""
        return self.ramps.specimen


@dataclass(frozen=True)
class StiffnessResult:
    """The law of one kind of cable.

    Attributes:
        specimens: those fitted, then those that verify.
        both: the law of both branches together, each moved into the middle of its loop.
        alone: the law of each branch alone, by name.
        candidates: functions of the tension, best first.
        cutoff: of the filter [Hz].
    """

    specimens: tuple[SpecimenStiffness, ...]
    both: Fitted
    alone: dict[str, Fitted]
    candidates: tuple[Rank, ...]
    cutoff: float

    @property
    def area(self) -> float:
        """Cross-section that the test-bed file gives the cables [m²]."""
        return section_of(self.specimens[0].specimen.cable)

    @property
    def objections(self) -> tuple[Objection, ...]:
        """Why the law is no result; none where it is one."""
        found, fitted = self.both.estimate, [one for one in self.specimens if one.fitted]
        errors = [(one.specimen.label, error_percent(one.vaf[MEAN])) for one in fitted]
        return (
            *sign_objections(found, {"a", "rigidity"}, set(), SIGN_REMEDY),
            *error_objections(found, errors, "stiffness"),
        )

    def data(self) -> dict[str, Any]:
        """Return everything as plain data for JSON."""
        return {
            "cutoff_hz": self.cutoff,
            "law": self._law_data(self.both),
            "branches": {name: self._law_data(found) for name, found in self.alone.items()},
            "candidates": [
                {
                    "name": rank.name,
                    "formula": rank.formula,
                    "parameters": rank.parameters,
                    "vaf_percent": rank.mean,
                }
                for rank in self.candidates
            ],
            "specimens": [_specimen_data(one) for one in self.specimens],
        }

    def _law_data(self, found: Fitted) -> dict[str, Any]:
        modulus = {
            "value": found.law.rigidity / self.area,
            "ci95": [end / self.area for end in found.estimate.interval("rigidity")],
        }
        return found.estimate.data() | {
            "youngs_modulus": modulus if found.asymptote else None,
            "scatter_explains_residuals": found.fits,
        }


def identify_stiffness(
    specimens: Sequence[Specimen], verify: Sequence[str] = (), cutoff: float = CUTOFF
) -> StiffnessResult:
    """Return the law of specimens of one kind that were stretched and released slowly.

    Args:
        specimens: cables of one diameter and several lengths.
        verify: labels of those that judge the law without being fitted.
        cutoff: of the filter [Hz].

    Raises:
        InputError: nothing to fit, cables of several diameters, or no slow cycles.
    """
    fitted, others = split(specimens, verify)
    floor = law_of(fitted[0].cable).floor
    ramps = [find_ramps(one, cutoff) for one in fitted]
    both, apart = _law_of_both(ramps, floor, cutoff)
    alone = {
        name: _law_of_one([[group[i]] for group in apart.branches], apart.response.of(i), floor)
        for i, name in enumerate(BRANCHES)
    }
    judged = [(one, True) for one in ramps] + [(find_ramps(one, cutoff), False) for one in others]
    return StiffnessResult(
        specimens=tuple(_judge(one, is_fitted, both, cutoff) for one, is_fitted in judged),
        both=both,
        alone=alone,
        candidates=tuple(rank_candidates(ramps, both.law)),
        cutoff=cutoff,
    )


class _Apart(NamedTuple):
    """Branches by specimen where they lie in their loops, and how they answer."""

    branches: list[list[Branch]]
    response: Response


def _law_of_both(ramps: Sequence[Ramps], floor: float, cutoff: float) -> tuple[Fitted, _Apart]:
    """Return the law in the middle of the loops, and what laws of one branch are fitted to."""
    widths = [find_hysteresis(one).half_width for one in ramps]
    middle = [centred(one, width) for one, width in zip(ramps, widths, strict=True)]
    seen: list[Ramps | None] = [None] * len(ramps)
    law: Law | None = None
    for _ in range(ROUNDS):
        pairs = list(zip(middle, seen, strict=True))
        groups = [undistorted(one, model, law) for one, model in pairs]
        both = fit_law(groups, floor)
        law = both.law
        seen = [modelled(m, law, w, cutoff) for m, w in zip(middle, widths, strict=True)]
    response = find_response(ramps, both, cutoff)
    pairs = list(zip(ramps, seen, strict=True))
    apart = [undistorted(one, model, law) for one, model in pairs]
    return with_intervals(both, groups, response), _Apart(apart, response)


def _law_of_one(groups: Sequence[Sequence[Branch]], response: Response, floor: float) -> Fitted:
    return with_intervals(fit_law(groups, floor), groups, response)


def split(
    specimens: Sequence[Specimen], verify: Sequence[str]
) -> tuple[list[Specimen], list[Specimen]]:
    """Return the specimens to fit and those that verify.

    Raises:
        InputError: a label is unknown, nothing is left, or the diameters differ.
    """
    labels = [one.label for one in specimens]
    for label in verify:
        if label not in labels:
            raise InputError(f"--verify {label}: no such cable, {allowed_names(label, labels)}")
    fitted = [one for one in specimens if one.label not in verify]
    if not fitted:
        raise InputError(f"--verify {', '.join(verify)}: leaves no cable to fit, allowed: some")
    sizes = {one.cable.stiffness.diameter: one.label for one in specimens if one.cable.stiffness}
    if len(sizes) > 1:
        sizes_mm = ", ".join(f"{label} {1e3 * size:g} mm" for size, label in sizes.items())
        raise InputError(f"diameters {sizes_mm}, allowed: cables of one kind; choose with --cables")
    return fitted, [one for one in specimens if one.label in verify]


def mean_curve(branches: Sequence[Branch]) -> Branch:
    """Return the mean of both branches at equal tension, as the thesis takes it."""
    low = max(float(one.tension.min()) for one in branches)
    high = min(float(one.tension.max()) for one in branches)
    tension = np.linspace(low, high, POINTS)

    def mean(of: str) -> Array:
        found = []
        for one in branches:
            order = np.argsort(one.tension)
            found.append(np.interp(tension, one.tension[order], getattr(one, of)[order]))
        return np.asarray(np.mean(found, axis=0))

    return Branch(MEAN, tension, mean("stiffness"), mean("length"))


def _judge(ramps: Ramps, fitted: bool, found: Fitted, cutoff: float) -> SpecimenStiffness:
    branches = tuple(mean_branches(ramps, found.law))
    curves = {one.branch: one for one in (*branches, mean_curve(branches))}
    hysteresis = find_hysteresis(ramps)
    return SpecimenStiffness(
        ramps=ramps,
        fitted=fitted,
        branches=branches,
        vaf={
            name: vaf(one.stiffness, found.law.stiffness(one.tension, one.length))
            for name, one in curves.items()
        },
        hysteresis=hysteresis,
        asymptote=_asymptote(ramps, found, hysteresis.half_width, cutoff),
    )


def _asymptote(
    ramps: Ramps, found: Fitted, half_width: float, cutoff: float
) -> tuple[float, tuple[float, float]] | None:
    """Return E from k·l/A on the asymptote, cycle by cycle, as in table 3-5."""
    if not found.asymptote:
        return None
    law, area, values = found.law, section_of(ramps.specimen.cable), []
    middle = centred(ramps, half_width)
    seen = modelled(middle, law, half_width, cutoff)
    for cycle in range(ramps.cycles):
        branches = undistorted(middle, seen, law, (cycle,))
        chosen = [(one, _asymptotic(law, one)) for one in branches]
        if min(float(np.mean(above)) for _, above in chosen) < ASYMPTOTE_SHARE:
            return None
        rigid = np.concatenate([(one.stiffness * one.length)[above] for one, above in chosen])
        values.append(float(rigid.mean()) / area)
    mean = float(np.mean(values))
    spread = float(np.std(values, ddof=1) / np.sqrt(len(values)))
    half = float(student.ppf(0.975, len(values) - 1)) * spread
    return mean, (mean - half, mean + half)


def _asymptotic(law: Law, branch: Branch) -> NDArray[np.bool_]:
    """Return which points lie on the asymptote, (n,): those away from the rest above it."""
    above = above_cap(law, branch)
    above[-REACH:] = False
    return above


def _specimen_data(one: SpecimenStiffness) -> dict[str, Any]:
    found = one.specimen
    return {
        "label": found.label,
        "recording": str(found.recording),
        "sha256": found.sha256,
        "window_s": list(found.window),
        "length_m": found.length,
        "cycles": one.ramps.cycles,
        "fitted": one.fitted,
        "tension_n": [
            float(min(b.tension.min() for b in one.branches)),
            float(max(b.tension.max() for b in one.branches)),
        ],
        "vaf_percent": one.vaf,
        "hysteresis": one.hysteresis.data(),
        "youngs_modulus": None
        if one.asymptote is None
        else {"value": one.asymptote[0], "ci95": list(one.asymptote[1])},
    }
