"""The title of a diagnosis: what was found, where, how much, and how far it helps."""

from dataclasses import replace

import numpy as np
from diagnosis_samples import PLACE, RUBBING, TORQUE, diagnosis, equation

from cspm_ident.diagnosis.regression.block_regression import Gain
from cspm_ident.diagnosis.regression.hypothesis import Hypothesis, Rival
from cspm_ident.diagnosis.reporting.evidence_figure import driver_figure
from cspm_ident.diagnosis.reporting.headline import headline
from cspm_ident.diagnosis.residuals.free_shapes import Driver
from cspm_ident.diagnosis.residuals.regressors import Candidate
from cspm_ident.diagnosis.validation.residual_curves import held_out_curves
from cspm_sim.effects import catalogue

LOADED = Candidate(catalogue()["winch_load_friction"], "surge_2")


def test_a_title_has_cause_place_size_and_what_it_helps():
    size = "30.0 ± 1.0 mN·m; held-out error 20 → 0.67 %"
    assert headline(diagnosis()) == f"Dry friction at winch surge 2: {size}"
    rival = Rival(Hypothesis(LOADED.effect, (LOADED,)), 0.1)
    both = "Dry friction or friction in proportion to tension at winch surge 2"
    assert headline(diagnosis(alternatives=[rival])) == f"{both}: {size}"


def test_many_elements_are_counted():
    found = diagnosis()
    three = [Candidate(RUBBING.effect, name) for name in ("surge_1", "surge_2", "sway_1")]
    finding = replace(found.findings[0], hypothesis=Hypothesis(RUBBING.effect, tuple(three)))
    assert headline(replace(found, findings=(finding,))).startswith("Dry friction at 3 winches: 30")


def test_what_is_not_named_is_called_unmodelled_and_a_right_model_right():
    driver = (Driver(PLACE, "tension [N]"), Gain(50.0, 5.0), 0.4)
    unknown = diagnosis(named=False, unknown=[driver])
    assert headline(unknown) == "Unmodelled function of tension at winch surge 2"
    agrees = "today: the model agrees with the recording to its noise"
    assert headline(diagnosis(named=False)) == agrees


def test_a_fitted_step_is_drawn_as_a_step():
    """Of friction as wide as a bin of a line, where means over bins made a ramp of it."""
    (curve,) = held_out_curves([[equation()]], {RUBBING: np.array([TORQUE])})
    figure = driver_figure(curve, "speed [rad/s]")
    law = figure.data[-1]
    assert (law.name, law.mode) == ("fitted law", "lines")
    x, y = np.array(law.x), np.array(law.y)
    np.testing.assert_allclose(np.abs(y), TORQUE, rtol=1e-3)
    assert set(np.sign(y[x > 0])) == {1.0}
    assert set(np.sign(y[x < 0])) == {-1.0}
    assert {each.mode for each in figure.data[:-1]} == {"markers"}
