"""How often the intervals of `cspm identify stiffness` and `damping` contain the truth."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from bench.accuracy.rig_cables import SpecimenTruth, described, multisine, ramps
from cspm_ident.rig.damping import DAMPING, identify_damping
from cspm_ident.rig.law import section_of
from cspm_ident.rig.specimen import Specimen
from cspm_ident.rig.stiffness import identify_stiffness

LENGTHS = (1.25, 2.1, 3.0, 3.5)  # m, of the thesis's rig
TRUTH = SpecimenTruth()


class RigStiffness:
    """The law of four cables on a rig, and E of each at its asymptote; four slow cycles."""

    names = ("a", "b", "c", "d", "E", *(f"E, {length:g} m" for length in LENGTHS))
    truth = np.array(
        [TRUTH.a, TRUTH.b, TRUTH.c, TRUTH.d, *[TRUTH.youngs_modulus] * (1 + len(LENGTHS))]
    )

    def intervals(self, rng: np.random.Generator) -> Iterator[tuple[str, np.ndarray]]:
        """Estimate one experiment; intervals of shape (parameters, 2)."""
        seed = int(rng.integers(2**31))
        found = identify_stiffness([ramps(TRUTH, length, seed=seed) for length in LENGTHS])
        law = found.both.estimate.ci95.copy()
        law[-1] /= section_of(found.specimens[0].specimen.cable)
        alone = [one.asymptote[1] for one in found.specimens if one.asymptote is not None]
        yield "least squares, scatter of the cycles", np.vstack([law, alone])


class RigDamping:
    """The damping of four cables on a rig, its error in N·s/m, and the line; 20 s of sines."""

    names = ("constant", "slope", *(f"{length:g} m" for length in LENGTHS))
    truth = np.array([TRUTH.constant, TRUTH.slope, *[0.0] * len(LENGTHS)])

    def intervals(self, rng: np.random.Generator) -> Iterator[tuple[str, np.ndarray]]:
        """Estimate one experiment; intervals of shape (parameters, 2)."""
        seed = int(rng.integers(2**31))
        found = identify_damping([_known_stiffness(length, seed) for length in LENGTHS])
        rows = [found.law.constant_interval, found.law.slope_interval]
        for one in found.specimens:
            ends = np.array(one.estimate.interval(DAMPING))
            rows.append(ends - TRUTH.damping(one.mean_length))
        yield "least squares, sandwich", np.array(rows)


def _known_stiffness(length: float, seed: int) -> Specimen:
    """Return a cable in sines whose stiffness the test-bed file knows."""
    one = multisine(TRUTH, length, seed=seed)
    return replace(one, cable=described(length, TRUTH, one.label, stiffness=TRUTH.law))
