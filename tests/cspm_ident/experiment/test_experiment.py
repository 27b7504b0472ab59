"""Experiments that separate: planned within what was recorded, and better than it when run."""

from dataclasses import replace

import numpy as np
import pytest
from run_samples import SCENARIOS

from cspm_ident.diagnosis.diagnosis import Diagnosis
from cspm_ident.diagnosis.finding import Finding, Status
from cspm_ident.diagnosis.parameter import Coefficients
from cspm_ident.diagnosis.regression.block_regression import Gain
from cspm_ident.diagnosis.regression.hypothesis import Hypothesis, Rival
from cspm_ident.diagnosis.reporting.verdict import diagnosis_data
from cspm_ident.diagnosis.residuals.recorded_equations import equations_of
from cspm_ident.diagnosis.residuals.regressors import Candidate, Place
from cspm_ident.diagnosis.residuals.residual_equation import Equation
from cspm_ident.diagnosis.validation.holdout_residuals import HeldOut
from cspm_ident.experiment import experiment_files
from cspm_ident.experiment.choice import Question, best_answer, is_safe, most_showing, safe_plans
from cspm_ident.experiment.envelope import reach_of
from cspm_ident.experiment.excitations import DURATION_S, excitations
from cspm_ident.experiment.plan import planned
from cspm_ident.experiment.separation import decided, separation
from cspm_ident.signals.measurement import read_measurement
from cspm_ident.signals.samples import Samples
from cspm_msgs_py.scenario import load_scenario, parse_scenario
from cspm_msgs_py.testbed import load_testbed
from cspm_msgs_py.yaml_file import dump_yaml
from cspm_run.assembly import resolve
from cspm_run.bundle import make_bundle
from cspm_run.library import find_scenario
from cspm_run.recorded_run import run
from cspm_sim.effects import Channel, catalogue

THESIS = load_testbed(SCENARIOS / "testbeds" / "thesis.yaml")
ONE_WINCH = load_testbed(SCENARIOS / "testbeds" / "one_winch.yaml")


def candidate(name, element):
    return Candidate(catalogue()[name], element)


RUBBING = candidate("winch_coulomb_friction", "surge_2")
LOADED = candidate("winch_load_friction", "surge_2")
BIAS = candidate("tension_bias", "hoist_1")
WRENCH = candidate("bar_constant_wrench", "bar")
CONFOUNDED = {
    "friction": Question({RUBBING: np.array([0.03])}, (LOADED,)),
    "bias": Question({BIAS: np.array([0.3])}, (WRENCH,)),
}


@pytest.fixture(scope="module")
def sea():
    """What 12 s of the worst sea would read, as planned."""
    scenario = load_scenario(find_scenario("worst_case_steep"), ["duration=12"])
    return planned(scenario, THESIS).measurement


@pytest.fixture(scope="module")
def plans(sea):
    wanted = ("slow_sea", "postures")
    scenarios = [s for s in excitations(sea, "testbed.yaml") if s.name in wanted]
    return [(scenario, planned(scenario, THESIS)) for scenario in scenarios]


def test_a_plan_leaves_no_residual_but_the_dampers():
    """The planned signals obey all equations, but for the dampers, which the plan leaves out."""
    damping = catalogue()["cable_axial_damping"]
    calm = planned(load_scenario(find_scenario("calm_broadband"), ["duration=12"]), THESIS)
    assert np.mean(calm.missed > 0.05) < 0.02
    for equation in equations_of(calm.measurement, [damping]):
        columns = equation.columns.get(Candidate(damping, equation.place.element))
        left = equation.target
        if columns is not None:
            free = np.concatenate([columns, equation.nuisance], axis=2)[:, 0]
            weights = np.linalg.lstsq(free, left[:, 0], rcond=None)[0]
            # One less than the file's own damping: none.
            assert weights[0] == pytest.approx(-1.0, abs=0.1)
            left = left - (free @ weights)[:, None]
        scale = np.std(equation.measured, axis=0)
        if equation.place.element == "bar":
            weight = THESIS.testbed.bar.mass * THESIS.testbed.gravity
            # Roll is not controlled, and what the least tensions miss is left.
            scale = weight * np.array([1.0, 1.0, 1.0, np.inf, 0.5, 0.5])
        # Rates are given by tensions as if the cables were damped.
        assert np.all(np.std(left, axis=0) < 0.04 * scale), equation.place


@pytest.mark.slow
def test_excitations_stay_within_what_was_recorded(sea):
    seen = reach_of(sea.bar_pose)
    for scenario in excitations(sea, "testbed.yaml"):
        found = planned(scenario, THESIS).measurement.bar_pose
        again = reach_of(found)
        moving = np.arange(6) != 3
        far = np.abs(found.values - seen.mean).max(axis=0)[moving]
        assert np.all(far <= 1.02 * np.maximum(seen.excursion, 0.02)[moving]), scenario.name
        if scenario.name != "quick_sea":
            assert np.all(again.speed[moving] <= 1.4 * np.maximum(seen.speed, 0.02)[moving])


def test_plans_that_would_overload_are_refused(plans):
    machine = THESIS.testbed
    for _, plan in plans:
        assert is_safe(plan, machine)
        tension = plan.measurement.tension
        heavy = Samples(tension.times, tension.values * 1.0)
        heavy.values[5, 2] = 0.95 * machine.cables[2].tension_limits[1]
        assert not is_safe(
            plan._replace(measurement=replace(plan.measurement, tension=heavy)), machine
        )
        assert not is_safe(plan._replace(missed=np.ones(len(plan.missed))), machine)


def test_a_separation_is_what_the_rival_cannot_imitate(sea):
    equations = equations_of(sea, [RUBBING.effect, LOADED.effect])
    noise = {e.place: np.full(e.target.shape[1], 1e-3) for e in equations}
    truth = {RUBBING: np.array([0.03])}
    alone = separation(equations, noise, truth, ())
    apart = separation(equations, noise, truth, (LOADED,))
    assert 0.0 < apart < 0.9 * alone
    assert separation(equations, noise, truth, (RUBBING,)) < 1e-9 * alone
    (own,) = (e for e in equations if e.place.element == "surge_2" and RUBBING in e.columns)
    one, other = (own.columns[c][:, 0, 0] / 1e-3 for c in (RUBBING, LOADED))
    left = 0.03 * (one - other * (one @ other) / (other @ other))
    assert apart == pytest.approx(np.linalg.norm(left), rel=1e-6)


@pytest.mark.parametrize(("unlike", "promised"), [(0.06, False), (0.08, True)])
def test_what_no_model_is_true_enough_for_is_not_promised(unlike, promised):
    """Half a percent of the squares is 7 % of the amplitude; both are far above the noise."""
    turns = np.linspace(0.0, 20.0 * np.pi, 5000, endpoint=False)
    one, other = np.sin(turns), np.sin(turns) + unlike * np.cos(turns)
    columns = {RUBBING: one[:, None, None], LOADED: other[:, None, None]}
    place = Place(Channel.SHAFT, "surge_2")
    target = 0.03 * one[:, None]
    equations = [Equation(place, 0.01 * np.arange(5000), target, columns, target)]
    noise, truth = {place: np.array([1e-5])}, {RUBBING: np.array([0.03])}
    left = separation(equations, noise, truth, (LOADED,))
    alone = separation(equations, noise, truth, ())
    assert left == pytest.approx(unlike * alone, rel=0.01)
    reported = decided(equations, noise, truth, (LOADED,))
    assert reported == pytest.approx(alone * np.sqrt(max(0.0, unlike**2 - 0.005)), rel=0.03)
    assert (reported > 3.0) is promised
    assert left > 3.0


def test_two_that_do_the_same_get_no_experiment(sea, plans):
    """Friction by load at the motor and at the pulley differ by rounding alone."""
    noise = {Place(Channel.SHAFT, "surge_2"): np.array([1e-4])}
    pulley = Candidate(catalogue()["pulley_friction"], "surge_2", (("wrap", 1.57),))
    same = Question({LOADED: np.array([0.03])}, (pulley,))
    gentle = sea.within(0.0, 2.0)
    assert best_answer([gentle], noise, same, plans) is None
    assert best_answer([gentle], noise, CONFOUNDED["friction"], plans) is not None


def test_what_cannot_show_safely_is_not_promised(plans):
    few = plans[:1]
    scenario, shown = most_showing([RUBBING.effect, catalogue()["winch_backlash"]], few)
    # Backlash shows where a cable is slack, which no safe motion makes it.
    assert shown == {"winch_coulomb_friction"}
    assert scenario.duration == DURATION_S
    assert most_showing([catalogue()["winch_backlash"]], few) is None
    assert most_showing([RUBBING.effect], []) is None


def test_a_rig_without_a_bar_is_turned_up_and_down():
    times = np.arange(0.0, 10.0, 0.005)
    angle = 0.05 * np.sin(2.0 * times)[:, None]
    scenario = parse_scenario(
        "{name: x, testbed: y, duration: 10, control:"
        " {mode: angle, angle: {surge: {points: [[0, 0]], tension: 20}}}}",
        "x",
    )
    measured = planned(scenario, ONE_WINCH).measurement
    assert measured.tension.values == pytest.approx(20.0, rel=1e-6)
    measured = measured.with_samples("angle", Samples(times, angle))
    found = safe_plans(measured, "testbed.yaml")
    assert {s.name for s, _ in found} == {"slow_reversals", "quick_reversals", "levels"}
    for scenario, plan in found:
        turned = plan.measurement.angle.values[:, 0]
        assert np.abs(turned).max() <= 0.0501
        # Winding in draws the cable.
        tension = plan.measurement.tension.values[:, 0]
        assert np.corrcoef(turned, tension)[0, 1] > 0.9
        assert parse_scenario(dump_yaml(scenario.model_dump(mode="json")), "x") == scenario


@pytest.mark.slow
@pytest.mark.compiled
def test_ties_and_what_was_not_testable_become_scenarios_that_run(
    sea, plans, tmp_path, monkeypatch
):
    monkeypatch.setattr(experiment_files, "safe_plans", lambda *_: plans)
    found = tied(sea)
    data = diagnosis_data(found)
    # The same motion shows it and separates the confounded effects, or there are two files.
    data["not_excited"] = [
        {"effect": name, "elements": []} for name in ("winch_viscous_friction", "winch_backlash")
    ]
    data["model"] = None
    experiment_files.write_experiments(tmp_path, found, data)
    (alternative,) = data["findings"][0]["alternatives"]
    assert alternative["separating_experiment"] == "experiment.yaml"
    shown = {e["effect"]: e["separating_experiment"] for e in data["not_excited"]}
    assert shown["winch_backlash"] is None
    assert shown["winch_viscous_friction"] in ("experiment.yaml", "experiment_2.yaml")
    scenario = load_scenario(tmp_path / "experiment.yaml", ["duration=0.5"])
    assert "winch_coulomb_friction on surge_2 from winch_load_friction" in scenario.description
    testbed = load_testbed(tmp_path / scenario.testbed)
    assert testbed.testbed == THESIS.testbed
    bundle = make_bundle(resolve(scenario, testbed.testbed), testbed, tmp_path)
    assert run(bundle, None).failure is None


def tied(measurement):
    """A diagnosis that found dry friction on one winch, and friction by load as likely."""
    noise = {e.place: np.full(e.target.shape[1], 1e-3) for e in equations_of(measurement, [])}
    # So little was recorded that any motion shows more.
    short = measurement.within(0.0, 2.5)
    rival = Rival(Hypothesis(LOADED.effect, (LOADED,)), 0.1)
    finding = Finding(
        Hypothesis(RUBBING.effect, (RUBBING,)),
        Gain(9.0, 1.0),
        0.9,
        (rival,),
        Status.TIED,
        coefficients=(Coefficients(RUBBING, np.array([0.03]), np.array([0.001])),),
    )
    fit = HeldOut(Place(Channel.SHAFT, "surge_2"), 0.1, 0.03, 0.03, 0.001, 0.001, 0.001)
    return Diagnosis(
        searched=(short,),
        held_out=(),
        findings=(finding,),
        unexplained=(),
        tested=1,
        fit=(fit,),
        simulated=(),
        lines=(),
        limits=(),
        not_excited=(),
        places=(),
        curves=(),
        noise=noise,
    )


@pytest.fixture(scope="module")
def gentle(tmp_path_factory):
    """Five seconds of a calm sea on the second plant, with its sensors' noise, and what is safe."""
    pytest.importorskip("mujoco", minversion="4.0", reason="the MuJoCo plant needs MuJoCo 4")
    calm = load_scenario(find_scenario("calm_broadband"), ["duration=5"])
    recorded = recorded_on("mujoco", tmp_path_factory.mktemp("gentle") / "calm_broadband", calm)
    return recorded, safe_plans(recorded, "testbeds/thesis.yaml")


@pytest.mark.slow
@pytest.mark.compiled
@pytest.mark.parametrize(("pair", "plant"), [("friction", "mujoco"), ("bias", "sim")])
def test_the_experiment_separates_better_than_the_recording(tmp_path, gentle, pair, plant):
    """The experiment is run; the choice knew the recording and the plans alone."""
    recorded, plans = gentle
    assert {scenario.name for scenario, _ in plans} >= {"slow_sea", "postures", "heights"}
    assert all(is_safe(plan, THESIS.testbed) for _, plan in plans)
    question = CONFOUNDED[pair]
    noise = {e.place: e.noise for e in equations_of(recorded, [])}
    answer = best_answer([recorded], noise, question, plans)
    shorter = answer.scenario.model_copy(update={"duration": 8.0})
    experiment = recorded_on(plant, tmp_path / "better", shorter)
    equations = equations_of(experiment, question.effects)
    whole = separation(equations, noise, question.truth, question.rivals)
    assert answer.separation > 1.1 * answer.recorded
    assert whole / np.sqrt(experiment.duration) > answer.recorded


def recorded_on(plant, folder, scenario):
    bundle = make_bundle(resolve(scenario, THESIS.testbed), THESIS, SCENARIOS)
    assert run(replace(bundle, plant=plant), folder).failure is None
    return read_measurement(folder)
