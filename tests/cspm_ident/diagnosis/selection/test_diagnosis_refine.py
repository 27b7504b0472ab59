"""Parameters that hold to first order only are corrected until they hold."""

import numpy as np
import pytest
from run_samples import bundle_of

from cspm_ident.diagnosis.regression.hypothesis import Hypothesis
from cspm_ident.diagnosis.regression.parameter_estimates import of_clocks, of_forms, of_reach
from cspm_ident.diagnosis.residuals.recorded_equations import equations_of
from cspm_ident.diagnosis.residuals.regressors import Candidate, Place
from cspm_ident.diagnosis.residuals.residual_equation import Equation, steady
from cspm_ident.diagnosis.selection.refinement import refine
from cspm_ident.diagnosis.selection.search_pass import noise_of
from cspm_ident.diagnosis.thresholds import DEFAULT_THRESHOLDS
from cspm_ident.signals.measurement import read_measurement
from cspm_run.recorded_run import run
from cspm_sim.effects import Channel, catalogue
from cspm_sim.effects.alteration import altered_cable

DAMPING = catalogue()["cable_axial_damping"]
CANDIDATE = Candidate(DAMPING, "hoist_1")
BLOCK_S = 0.3


@pytest.fixture(scope="module")
def measured(tmp_path_factory):
    folder = tmp_path_factory.mktemp("refine") / "sea"
    run(bundle_of("worst_case_steep", "duration=12"), folder)
    return read_measurement(folder)


def equation_of(columns):
    """An equation of one cable with columns alone."""
    rows = len(next(iter(columns.values())))
    nothing = np.zeros((rows, 1))
    times = np.linspace(0.0, 1.0, rows)
    return Equation(Place(Channel.TENSION, "hoist_1"), times, nothing, columns, nothing)


def damper(measured, factor):
    """The damper and half its interval, in units of the true one, of a file `factor` times off."""
    machine = measured.machine
    law = machine.cables[0].damping.model_dump()
    described = altered_cable(machine, 0, damping={**law, "factor": factor * law["factor"]})
    other = measured.with_machine(described)
    parts = [equations_of(other, [DAMPING], touched=[CANDIDATE])]
    noise = noise_of(steady(parts))
    hypothesis = Hypothesis(DAMPING, (CANDIDATE,))
    found = refine([other], [hypothesis], noise, BLOCK_S, lambda parts: parts)
    (weight,), (half,) = found[CANDIDATE]
    return factor * (1.0 + weight), factor * half


@pytest.mark.parametrize("factor", [0.4, 3.0])
def test_a_factor_is_the_same_however_wrong_the_file_was(measured, factor):
    value, half = damper(measured, 1.0)
    assert abs(value - 1.0) < 0.1
    other, other_half = damper(measured, factor)
    np.testing.assert_allclose(other, value, atol=0.1 * half)
    np.testing.assert_allclose(other_half, half, rtol=0.05)


def test_no_delay_is_more_significant_than_the_clocks_of_a_healthy_machine():
    late, dry = (
        Candidate(catalogue()[name], "one") for name in ("tension_delay", "winch_coulomb_friction")
    )
    given = {c: (np.array([3e-3]), np.array([1e-4])) for c in (late, dry)}
    found = of_clocks(given)
    ((_, healthy),) = catalogue()["tension_delay"].signature.negligible.values()
    assert found[late][1] == pytest.approx(np.hypot(1e-4, healthy))
    assert found[late][0] == given[late][0]
    assert found[dry][1] == given[dry][1]


def test_no_weight_is_more_significant_than_the_form_of_its_law():
    """Be it seen to be off or not; a number of the file or of a reading has none."""
    unseen = np.sqrt(DEFAULT_THRESHOLDS.model_form_error_share)
    cases = (
        ("winch_coulomb_friction", 0.3, 0.1),
        ("winch_viscous_friction", 0.0, unseen),
        ("cable_stiffness", 0.3, 0.1),
        ("cable_axial_damping", 0.0, 0.0),
        ("tension_bias", 0.0, 0.0),
    )
    for effect, seen, share in cases:
        candidate = Candidate(catalogue()[effect], "hoist_1")
        given = np.array([-3.0, 0.0]), np.array([0.4, 0.4])
        moved = np.array([seen, 0.0])
        values, half = of_forms({candidate: given}, {candidate: moved})[candidate]
        np.testing.assert_allclose(half, [np.hypot(0.4, 3.0 * share), 0.4])
        np.testing.assert_array_equal(values, given[0])


@pytest.mark.parametrize(
    ("reach", "start", "missing"), [(0.6, 0.0, 0.4), (0.6, -5.0, 0.4), (1.2, 0.9, 0.0)]
)
def test_what_saturates_is_no_more_significant_than_how_much_of_it_has_acted(reach, start, missing):
    """Half of the range, since a memory may start anywhere."""
    slides = Candidate(catalogue()["cable_hysteresis"], "hoist_1", (("displacement", 1e-3),))
    rubs = Candidate(DAMPING, "hoist_1")
    column = reach * np.sin(np.linspace(0.0, 9.0, 500))[:, None, None] + start
    part = equation_of({slides: column, rubs: 0.1 * column})
    given = {c: (np.array([-2.0]), np.array([0.6])) for c in (slides, rubs)}
    found = of_reach(given, [[part.within(0.0, 1.0)], [part]])
    np.testing.assert_allclose(found[slides][1], np.hypot(0.6, 2.0 * missing), rtol=1e-4)
    np.testing.assert_array_equal(found[slides][0], given[slides][0])
    np.testing.assert_array_equal(found[rubs][1], given[rubs][1])
    assert of_reach(given, [[]])[slides][1] == pytest.approx(np.hypot(0.6, 2.0))
