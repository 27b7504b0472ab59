"""Peers on made-up residuals: what they keep, and that they have no safeguard."""

from importlib import import_module

import numpy as np
import pytest
from scipy.stats import t

from bench.blind.peers import retuned
from bench.blind.peers.library import Library
from bench.blind.peers.normal import normal_of
from bench.blind.peers.report import left_with, report_of
from bench.blind.scoring import method
from bench.blind.scoring.method import ABLATED, CSPM, METHODS, PEERS, require_method
from bench.blind.white_regression import WhiteSums
from cspm_ident.diagnosis.regression.block_gram import gather
from cspm_ident.diagnosis.regression.block_regression import BlockRegression
from cspm_ident.diagnosis.residuals.regressors import Candidate, Place
from cspm_ident.diagnosis.residuals.residual_equation import Equation
from cspm_msgs_py.errors import InputError
from cspm_sim.effects import Channel, catalogue

ROWS, STEP, BLOCK_S = 2400, 0.01, 1.0
PLACE = Place(Channel.SHAFT, "only")
COULOMB, VISCOUS, INERTIA = (
    Candidate(catalogue()[name], "only")
    for name in ("winch_coulomb_friction", "winch_viscous_friction", "winch_inertia")
)


def equation(seed, weights, colour=0.0):
    """A shaft with dry friction, drag and inertia of given sizes, in noise of one."""
    rng = np.random.default_rng(seed)
    times = STEP * np.arange(ROWS)
    speed = 3.0 * np.sin(2.1 * times + seed) + 2.0 * np.sin(0.83 * times)
    columns = np.stack([np.sign(speed), speed, np.gradient(speed, STEP)], axis=1)
    noise = rng.standard_normal(ROWS)
    for k in range(1, ROWS):
        noise[k] = colour * noise[k - 1] + np.sqrt(1.0 - colour**2) * noise[k]
    target = columns @ np.array(weights) + noise
    shaped = {c: columns[:, None, k : k + 1] for k, c in enumerate((COULOMB, VISCOUS, INERTIA))}
    never = np.ones((ROWS, 1, 1))
    signals = {"speed [rad/s]": speed, "time [s]": times}
    return Equation(PLACE, times, target[:, None], shaped, target[:, None], never, signals=signals)


def library(weights, colour=0.0):
    searched, judge = equation(1, weights, colour), equation(2, weights, colour)
    gram, other = (gather([[each]], BLOCK_S) for each in (searched, judge))
    return Library([searched], [judge], gram, WhiteSums(gram), other)


def peer(name):
    if name != "retuned":
        pytest.importorskip("pysindy" if name == "sindy" else "sklearn")
    return import_module(f"bench.blind.peers.{name}").diagnosis_of


SPARSE = ("stepwise", "lasso", "sindy")


@pytest.mark.parametrize("name", SPARSE)
def test_sparse_regressions_find_the_largest_term_first_and_its_size(name):
    reported = peer(name)(library((2.0, 0.0, 0.0)))
    first = reported["findings"][0]
    assert (first["effect"], first["elements"], first["subsystem"]) == (
        "winch_coulomb_friction",
        ["only"],
        "winch",
    )
    (value,) = (p["value"] for p in first["parameters"] if p["name"] == "torque")
    assert value == pytest.approx(2.0, rel=0.1)
    (fit,) = reported["residuals"]
    held_out = fit["held_out"]
    assert held_out["nrmse_after"] == pytest.approx(1.0, abs=0.06)
    assert held_out["nrmse_before"] > 2.0
    assert held_out["nrmse_after"] < held_out["nrmse_retuned_nominal"]


@pytest.mark.parametrize("name", ["retuned", *SPARSE])
def test_white_noise_alone_is_mostly_nothing_to_them(name):
    reported = peer(name)(library((0.0, 0.0, 0.0)))
    # What suits the last quarter by chance is kept by SINDy, which tests nothing.
    assert len(reported["findings"]) <= (2 if name == "sindy" else 1)
    assert reported["residuals"][0]["held_out"]["nrmse_after"] == pytest.approx(1.0, abs=0.06)


def test_coloured_noise_misleads_errors_of_white_rows_and_not_those_of_blocks():
    """Of thirty recordings without any effect; 5 % is what the intervals promise."""
    misled, healthy = 0, 0
    for seed in range(30):
        gram = gather([[equation(seed, (0.0, 0.0, 0.0), colour=0.95)]], BLOCK_S)
        columns = gram.with_nuisance([VISCOUS])
        white, blocks = (
            abs(sums.weights(columns)[-1]) > sums.half_width(columns[:-1], columns[-1:])[0]
            for sums in (WhiteSums(gram), BlockRegression(gram))
        )
        misled, healthy = misled + white, healthy + blocks
    assert misled >= 10
    assert healthy <= 6


def test_errors_of_white_rows_are_the_textbook_s():
    made = equation(3, (2.0, 1.0, 0.0))
    gram = gather([[made]], BLOCK_S)
    sums, columns = WhiteSums(gram), gram.with_nuisance([COULOMB, VISCOUS])
    x = np.column_stack([np.ones(ROWS), *(made.columns[c][:, 0, 0] for c in (COULOMB, VISCOUS))])
    y = made.target[:, 0]
    weights, (left,), *_ = np.linalg.lstsq(x, y, rcond=None)
    covariance = left / (ROWS - 3) * np.linalg.inv(x.T @ x)
    np.testing.assert_allclose(sums.weights(columns), weights, rtol=1e-9)
    base, own = columns[:2], columns[2:]
    np.testing.assert_allclose(sums.covariance(columns[:0], columns), covariance, rtol=1e-6)
    np.testing.assert_allclose(sums.covariance(base, own), covariance[2:, 2:], rtol=1e-6)
    chance = 2.0 * t.sf(weights[2] / np.sqrt(covariance[2, 2]), ROWS - 3)
    assert sums.p_value(base, own) == pytest.approx(chance, rel=1e-3, abs=1e-300)


def test_normal_equations_are_those_of_rows_without_what_is_never_reported():
    lib = library((2.0, 1.0, 0.0))
    (made,) = lib.searched
    candidates = [COULOMB, VISCOUS, INERTIA]
    x = np.column_stack([made.columns[c][:, 0, 0] for c in candidates])
    y = made.target[:, 0]
    length = np.linalg.norm(x, axis=0)
    x, y = (x - x.mean(axis=0)) / length, y - y.mean()
    normal = normal_of(lib, candidates)
    np.testing.assert_allclose(normal.gram, x.T @ x, atol=1e-9)
    np.testing.assert_allclose(normal.cross, x.T @ y, rtol=1e-7)
    assert (normal.square, normal.rows) == (pytest.approx(y @ y), ROWS)
    weights = np.array([[1.0, 0.0], [2.0, 3.0], [0.0, 0.0]])
    np.testing.assert_allclose(normal.left(weights), np.sum((y[:, None] - x @ weights) ** 2, 0))
    few, target = normal.root()
    np.testing.assert_allclose(few.T @ few, normal.gram, atol=1e-9)
    np.testing.assert_allclose(few.T @ target, normal.cross, atol=1e-6)


def test_a_retuned_number_is_reported_and_friction_makes_one_wrong():
    (reported,) = retuned.diagnosis_of(library((0.0, 0.0, 1.0)))["findings"]
    assert reported["effect"] == "winch_inertia"
    (number,) = reported["parameters"]
    assert number["ci95"][0] < 1.0 < number["ci95"][1]
    report = retuned.diagnosis_of(library((2.0, 0.0, 0.0)))
    assert report["residuals"][0]["held_out"]["nrmse_after"] > 2.0


def test_the_most_important_finding_comes_first():
    lib = library((2.0, 0.1, 0.0))
    reported = report_of(lib, lib.gram.columns_of([VISCOUS, COULOMB]), intervals=True)
    assert [f["effect"] for f in reported["findings"]] == [
        "winch_coulomb_friction",
        "winch_viscous_friction",
    ]
    assert left_with(lib, {})[PLACE] > left_with(lib, {COULOMB: np.array([2.0])})[PLACE]


def test_a_black_box_says_where_and_not_what():
    reported = peer("black_box")(library((2.0, 0.0, 0.0)))
    (found,) = reported["findings"]
    assert (found["effect"], found["elements"], found["subsystem"]) == (
        "unknown",
        ["only"],
        "winch",
    )
    held_out = reported["residuals"][0]["held_out"]
    assert held_out["nrmse_after"] < 0.7 * held_out["nrmse_before"]
    assert peer("black_box")(library((0.0, 0.0, 0.0)))["findings"] == []


def test_methods_are_named_and_others_refused(monkeypatch):
    assert (CSPM, *ABLATED, *PEERS) == METHODS
    for name in (CSPM, *ABLATED, "retuned"):
        require_method(name)
    with pytest.raises(InputError, match=r"^--method magic: allowed: cspm, cspm-without-measured-"):
        require_method("magic")
    monkeypatch.setattr(method, "find_spec", lambda name: None)
    with pytest.raises(
        InputError, match=r"^--method sindy: pysindy is not .* after pip install cspm\[blind\]$"
    ):
        require_method("sindy")


def test_what_a_healthy_machine_has_as_well_is_not_reported():
    reported = report_of(skewed(5e-6), np.array([0]), intervals=False)
    assert (reported["verdict"], reported["findings"]) == ("consistent", [])
    (finding,) = report_of(skewed(5e-4), np.array([0]), intervals=False)["findings"]
    assert finding["effect"] == "clock_skew"


def skewed(skew):
    """A residual that is a clock's skew alone, of a size that the catalogue calls none or some."""
    effect = catalogue()["clock_skew"]
    candidate, times = Candidate(effect, "bar"), STEP * np.arange(ROWS)
    column = np.sin(times)
    target = skew * column[:, None]
    row = Equation(PLACE, times, target, {candidate: column[:, None, None]}, target)
    gram = gather([[row]], BLOCK_S)
    return Library([row], [row], gram, WhiteSums(gram), gram)
