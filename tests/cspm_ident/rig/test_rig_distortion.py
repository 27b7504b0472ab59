"""What filter, differences and the damper's loop make of a stiffness, and that it is taken out."""

import numpy as np
import pytest

from bench.accuracy import rig_cables
from bench.accuracy.rig_cables import SpecimenTruth, ramps, stretch_at, tension_on
from cspm_ident.rig.distortion import centred, modelled, undistorted
from cspm_ident.rig.flanks import DOWN, SAMPLES, UP, find_ramps
from cspm_ident.rig.hysteresis import find_hysteresis
from cspm_ident.rig.law import Law
from cspm_ident.rig.winding import Winding

CUTOFF, LENGTH, LOWEST = 2.0, 1.25, 0.6
TRUTH = SpecimenTruth()
LAW = Law(TRUTH.a, TRUTH.b, TRUTH.c, TRUTH.d, TRUTH.rigidity, TRUTH.floor)


@pytest.fixture
def silent(monkeypatch):
    """Ramps of a cable with a damper whose load cell does not scatter."""
    monkeypatch.setattr(rig_cables, "noise", lambda rng, count: np.zeros(count))
    return find_ramps(ramps(TRUTH, LENGTH, seed=3, lowest=LOWEST, cycles=2), CUTOFF)


def test_the_tension_over_what_is_wound_is_that_of_another_quadrature(silent):
    """One integrates dt/dwound, the other inverts ε(t) at each unstretched length."""
    wound = np.linspace(0.0, float(np.ptp(silent.specimen.wound)), 300)
    stretch = stretch_at(TRUTH, LOWEST, LENGTH)
    expected = tension_on(TRUTH, wound, LENGTH, stretch, 120.0)
    found = Winding(silent, LAW).tension(wound)
    # The recording's zero of what is wound is known to a step of the encoder.
    step = 2.0 * np.pi / 8192 * rig_cables.RADIUS
    np.testing.assert_allclose(found, expected, atol=step * TRUTH.rigidity / LENGTH)
    assert np.ptp(found) > 50.0


def test_without_a_law_there_is_no_tension(silent):
    with pytest.raises(ValueError, match="needs a law"):
        Winding(silent, None).tension(np.zeros(3))


def test_centred_directions_lie_on_one_curve(silent):
    width = find_hysteresis(silent).half_width
    assert width == pytest.approx(
        TRUTH.damping(LENGTH) * silent.flanks[0].speed, rel=0.02
    )  # the damper's
    middle = centred(silent, width)
    assert abs(find_hysteresis(middle).half_width) < 1e-3 * width
    moved = {
        one.branch: float(np.mean(one.tension - other.tension))
        for one, other in zip(middle.flanks, silent.flanks, strict=True)
    }
    assert moved == {UP: pytest.approx(-width), DOWN: pytest.approx(width)}


def test_what_the_filter_rounds_is_taken_out(silent):
    width = find_hysteresis(silent).half_width
    middle = centred(silent, width)
    seen = modelled(middle, LAW, width, CUTOFF)

    def squares(branches):
        rest = [one.stiffness - LAW.stiffness(one.tension, one.length) for one in branches]
        # A period of the filter from the rest, where the encoder is off by a part of its step.
        return sum(float(np.sum(part[: -int(SAMPLES)] ** 2)) for part in rest)

    raw, clean = undistorted(middle, None, LAW), undistorted(middle, seen, LAW)
    # What remains lies at the bend: the tension there is known to a step of the encoder.
    assert squares(raw) > 5.0 * squares(clean)
    # What another law's filter would round does not fit.
    stiff = LAW._replace(a=1.5 * LAW.a)
    other = undistorted(middle, modelled(middle, stiff, width, CUTOFF), stiff)
    assert squares(other) > 5.0 * squares(clean)
