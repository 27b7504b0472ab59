"""What data that were not searched say of a finding."""

import numpy as np
import pytest

from cspm_ident.diagnosis.columns import Candidate, Place
from cspm_ident.diagnosis.confirmation import confirmed
from cspm_ident.diagnosis.equation import Equation
from cspm_ident.diagnosis.evidence import gather
from cspm_ident.diagnosis.search import Search
from cspm_sim.effects import Channel, catalogue

ROWS, STEP, BLOCK_S = 2400, 0.01, 0.5
DRAG = Candidate(catalogue()["winch_viscous_friction"], "surge_1")


def winch(weight, loud=1.0, rows=ROWS, seed=1):
    """A winch with viscous friction, in hundredths, that moves by `loud`, in units of its noise."""
    rng = np.random.default_rng(seed)
    times = STEP * np.arange(rows)
    speed = loud * (np.sin(2.1 * times) + 0.6 * np.sin(0.83 * times))
    target = (weight * speed + rng.standard_normal(rows))[:, None]
    columns = {DRAG: 100.0 * speed[:, None, None]}
    return gather(
        [[Equation(Place(Channel.SHAFT, "surge_1"), times, target, columns, target)]], 0.5
    )


@pytest.mark.parametrize(
    ("weight", "loud", "kept", "faint"),
    [
        (1.0, 1.0, True, False),
        # Where it moves a fifth as much it takes two hundredths, which is what it should.
        (1.0, 0.2, True, True),
        # There it takes none though it should.
        (0.0, 0.2, False, False),
        (0.0, 1.0, False, False),
        # It moves so little that what it takes says nothing.
        (1.0, 0.02, False, False),
    ],
)
def test_a_finding_stands_by_what_it_should_take(weight, loud, kept, faint):
    search = Search(winch(1.0))
    found = search.run().named
    stood = confirmed(search.fits, winch(weight, loud, seed=2), found)
    assert [len(each) for each in stood] == [kept, faint, not kept]


def test_of_several_findings_those_stand_that_are_confirmed():
    search = Search(winch(1.0))
    (found,) = search.run().named
    assert confirmed(search.fits, winch(-1.0, seed=2), [found]).rejected == (found,)
    assert confirmed(search.fits, winch(1.0, seed=2), []).kept == ()
