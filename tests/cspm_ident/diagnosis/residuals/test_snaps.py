"""Where a cable snaps taut, its linearised law errs; elsewhere it does not."""

import numpy as np
import pytest
from run_samples import bundle_of

from cspm_ident.diagnosis.residuals.recorded_equations import equations_of
from cspm_ident.signals.measurement import read_measurement
from cspm_run.recorded_run import run
from cspm_sim.effects import Channel

pytestmark = pytest.mark.compiled


@pytest.fixture(scope="module")
def tensions(tmp_path_factory):
    """Equations of the cables in a sea in which the hoists snap from 2 to 17 N near 11.7 s."""
    folder = tmp_path_factory.mktemp("snaps") / "bag"
    run(bundle_of("worst_case", "duration=13", "seed=515"), folder)
    found = equations_of(read_measurement(folder), [])
    return {e.place.element: e for e in found if e.place.channel is Channel.TENSION}


def test_the_largest_residuals_are_marked_and_few_others(tensions):
    hoist = tensions["hoist_2"]
    marked, left = hoist.turning, np.abs(hoist.left[:, 0])
    assert 0 < marked.sum() < 0.1 * len(marked)
    assert marked[np.argsort(-left)[:3]].all()
    assert left[marked].max() > 3.0 * left[~marked].max()


def test_rows_at_rest_are_never_marked(tensions):
    for equation in tensions.values():
        if equation.turning.size:
            assert not equation.turning[equation.times < 0.5].any()
