"""Linear analysis: modes, gains and published figures, each by a second road."""

import json
import re

import control
import numpy as np
import pytest
from altered_machines import CENTRE, TESTBEDS, THESIS
from machines import build, general_content
from numpy.testing import assert_allclose

from cspm_control.analysis.cable_groups import cable_groups
from cspm_control.analysis.claim import Claim, rounded
from cspm_control.analysis.control_system import control_system
from cspm_control.analysis.gain import condition, directions, relative_gains, singular_values
from cspm_control.analysis.linear import FREQUENCIES, LOW, analyse_linear
from cspm_control.analysis.published_linear import EXACT, FROZEN, linear_claims
from cspm_model.kernels.cable import RADIUS
from cspm_model.linearisation import linear_model
from cspm_model.parameters import nominal_parameters


@pytest.fixture(scope="module")
def found():
    return analyse_linear(THESIS, CENTRE)


def words(analysis):
    return {round(mode.frequency, 1): mode.words for mode in analysis.modes}


def test_modes_are_put_in_words(found):
    frozen, exact = words(found.frozen), words(found.exact)
    assert frozen[33.0] == "pitch against hoist winches"
    assert frozen[42.5] == "heave against hoist winches"
    assert frozen[60.4] == "surge winches, the bar nearly still"
    assert exact[26.4] == "roll, the winches nearly still"
    assert exact[0.2] == "heave with hoist and sway winches"


def test_against_stretches_the_cables_and_with_does_not(found):
    """By the energy in the cables' elongation, which the words do not use."""
    parameters, point = nominal_parameters(THESIS), found.point
    a = found.exact.model.A
    poles, vectors = np.linalg.eig(a)
    wound = parameters.cables[:, RADIUS]
    for wanted, stretched in ((33.06, True), (42.76, True), (0.2026, False), (0.8382, False)):
        vector = vectors[:, np.argmin(np.abs(np.abs(poles) - wanted))]
        by_bar, by_winch = (point.jacobian @ vector[:6])[:2], (wound * vector[12:20])[:2]
        together = np.abs(by_bar + by_winch).sum() > np.abs(by_bar - by_winch).sum()
        assert together == stretched
        mode = min(found.exact.modes, key=lambda m: abs(m.frequency - wanted))
        assert ("against hoist" in mode.words, "with hoist" in mode.words) == (
            stretched,
            not stretched,
        )


def test_shares_of_all_that_moves_add_up_and_winches_of_more_inertia_take_more(found):
    for mode in found.exact.modes:
        assert mode.shares.sum() == pytest.approx(1.0)
        assert mode.shares.min() > -1e-9
    roll = min(found.exact.modes, key=lambda m: abs(m.frequency - 26.38))
    assert roll.shares[3] > 0.9
    cables = tuple(
        cable.model_copy(update={"rotor_inertia": 3.0 * cable.rotor_inertia})
        for cable in THESIS.cables
    )
    heavy = analyse_linear(THESIS.model_copy(update={"cables": cables}), CENTRE)
    # The slowest mode moves bar and winches by kinematics alone.
    ratios = []
    for each in (found, heavy):
        winches = each.exact.modes[0].shares[6:].sum()
        ratios.append(winches / (1.0 - winches))
    assert ratios[1] == pytest.approx(3.0 * ratios[0], rel=0.01)


def test_python_control_gets_the_names_and_finds_the_same_frequencies_and_damping(found):
    system = control_system(found.exact.model)
    assert system.input_labels == list(found.exact.model.inputs)
    assert system.output_labels == list(found.exact.model.outputs)
    assert system.state_labels == list(found.exact.model.states)
    frequencies, ratios, poles = control.damp(system, doprint=False)
    upper = np.flatnonzero(poles.imag >= 0.0)
    upper = upper[np.argsort(frequencies[upper])]
    ours = found.exact.modes
    assert_allclose([mode.frequency for mode in ours], frequencies[upper], rtol=1e-6)
    assert_allclose([mode.damping for mode in ours], ratios[upper], atol=1e-6)


def test_drifting_poles_are_those_that_nothing_pulls_back(found):
    assert (found.frozen.drifting, found.exact.drifting) == (12, 0)
    assert len(found.frozen.model.A) - found.frozen.drifting == sum(
        2 if mode.pole.imag > 0 else 1 for mode in found.frozen.modes
    )


def test_slow_modes_grow_because_a_longer_cable_is_softer(found):
    parameters, point = nominal_parameters(THESIS), found.point

    def growth(changed):
        poles = np.linalg.eigvals(linear_model(THESIS, parameters, changed, exact=True).A)
        return poles.real[(np.abs(poles) < 30.0) & (poles.imag > 0.1)]

    assert (growth(point) > 1e-7).sum() == 5
    assert (growth(point._replace(unstretched_lengths=point.lengths)) > 1e-7).sum() == 5
    assert growth(point._replace(length_stiffness=point.stiffness)).max() < 0.0


def test_relative_gains_are_ratios_of_open_to_closed_gains():
    """By their definition: gain with other inputs held over gain with other outputs held."""
    gain = np.random.default_rng(3).normal(size=(4, 4)) + 1j
    array = relative_gains(gain)
    for i in range(4):
        for j in range(4):
            others = [k for k in range(4) if k != i]
            inputs = [k for k in range(4) if k != j]
            rest = np.linalg.solve(gain[np.ix_(others, inputs)], gain[others, j])
            closed = gain[i, j] - gain[i, inputs] @ rest
            assert array[i, j] == pytest.approx(gain[i, j] / closed)
    scaled = np.diag([1.0, 20.0, 3.0, 0.1]) @ gain @ np.diag([7.0, 1.0, 0.2, 1.0])
    assert_allclose(relative_gains(scaled), array, atol=1e-12)


def test_condition_leaves_out_what_is_zero():
    assert condition(np.array([12.0, 4.0, 3.0, 1e-15])) == 4.0
    assert condition(np.array([12.0, 4.0])) == 3.0


def test_singular_values_bound_the_gain_and_directions_attain_it(found):
    response = found.exact.motion.system.response([7.0])
    low, high = singular_values(response)[0][[-1, 0]]
    rng = np.random.default_rng(1)
    for _ in range(20):
        wrench = rng.normal(size=6)
        gain = np.linalg.norm(response[0] @ wrench) / np.linalg.norm(wrench)
        assert low - 1e-12 <= gain <= high
    side = directions(response[0])
    assert_allclose(response[0] @ side.inputs[:, 0], side.gains[0] * side.outputs[:, 0], atol=1e-12)


def test_frequencies_begin_where_the_thesis_looks():
    assert FREQUENCIES[0] == LOW == 0.1


def test_what_holds_of_chapter_6(found):
    claims = {claim.what: claim for claim in linear_claims(found, THESIS.cable_names)}
    fails = {what for what, claim in claims.items() if not claim.holds(FROZEN)}
    # 1719 / 10.96; the thesis divided by the rounded 11.
    assert fails == {"motion, their ratio"}
    lost = {what for what, claim in claims.items() if not claim.holds(EXACT)}
    assert {"motion, largest σ", "tension, condition", "slowest oscillation, rad/s"} < lost


def test_the_pages_table_is_what_the_code_finds(found):
    page = (TESTBEDS.parents[1] / "docs" / "explanation" / "what-a-machine-can-do.md").read_text(
        encoding="utf-8"
    )
    rows = [line.strip("| ").split(" | ") for line in page.splitlines()]
    reported = {row[0]: row[1:] for row in rows if len(row) == 4}
    for claim in linear_claims(found, THESIS.cable_names):
        published, *cells = reported[claim.what]
        assert published == claim.published
        for way, cell in zip((FROZEN, EXACT), cells, strict=True):
            number, _, cross = cell.replace("−", "-").partition(" ")
            assert float(number) == pytest.approx(claim.found[way], rel=1e-3, abs=2e-5)
            assert (cross == "✗") is not claim.holds(way)


def test_the_pages_python_gives_a_named_system(found, monkeypatch):
    root = TESTBEDS.parents[1]
    page = (root / "docs" / "explanation" / "what-a-machine-can-do.md").read_text(encoding="utf-8")
    (code,) = re.findall(r"```python\n(.*?)```", page, re.DOTALL)
    monkeypatch.chdir(root)
    said = {}
    exec(compile(code, "docs/explanation/what-a-machine-can-do.md", "exec"), said)
    system, ours = said["system"], found.exact.motion.system
    assert isinstance(system, control.StateSpace)
    assert system.input_labels == list(ours.inputs)
    for name in "ABCD":
        assert_allclose(getattr(system, name), getattr(ours, name), rtol=1e-12)


def test_claims_are_valid_json(found):
    for claim in linear_claims(found, THESIS.cable_names):
        json.dumps(claim.data(), allow_nan=False)


def test_a_claim_holds_within_its_rounding_only():
    low, high = rounded("0.74")
    for value, wanted in ((0.7349, False), (0.735, True), (0.745, True), (0.7451, False)):
        assert Claim("", "0.74", low, high, {"x": value}).holds("x") is wanted


def test_names_with_a_last_number_are_one_group():
    names = ("hoist_1", "left", "hoist_2", "9")
    assert cable_groups(names) == {"hoist": [0, 2], "left": [1], "9": [3]}


def test_a_machine_of_no_symmetry_spans_all_directions():
    found = analyse_linear(build(general_content()), CENTRE)
    assert found.rank == 6
    assert found.exact.motion.low.gains.min() > 0.0


@pytest.mark.slow
def test_command_prints_draws_and_writes(cspm, tmp_path):
    code, out, err = cspm("analyze", "linear", "--out", "found", "--json", "found.json")
    assert (code, err) == (0, "")
    assert "rank of Jᵀ 5" in out
    assert "pitch against hoist winches" in out
    data = json.loads((tmp_path / "found.json").read_text())
    assert data["rank"] == 5
    verdicts = {claim["figure"]: claim["holds"] for claim in data["claims"]}
    assert verdicts["tension, condition"] == {"frozen": True, "exact": False}
    assert data["exact"]["motion"]["condition"] == pytest.approx(62.8, abs=0.1)
    model = json.loads((tmp_path / "found" / "model.json").read_text())["exact"]["motion"]
    assert len(model["A"]) == len(model["states"]) == 28
    assert model["inputs"][4] == "wrench pitch"
    assert (tmp_path / "found" / "linear.png").stat().st_size > 20_000


def test_elsewhere_the_thesis_says_nothing(cspm, tmp_path):
    code, out, err = cspm("analyze", "linear", "--pose", "0,0,1.5,0,0,0", "--json", "found.json")
    assert (code, err) == (0, "")
    assert "chapter 6" not in out
    data = json.loads((tmp_path / "found.json").read_text())
    assert data["claims"] == []
    assert data["pose"][2] == 1.5


@pytest.mark.parametrize(
    ("arguments", "text"),
    [
        (
            ["--pose", "0,0,2"],
            "--pose 0,0,2: allowed: six numbers with commas, surge, sway, heave, roll, pitch, yaw"
            " [m, rad], such as 0,0,2,0,0,0",
        ),
        (["--pose", "0,0,2,0,0,nan"], "--pose 0,0,2,0,0,nan: allowed: six numbers with commas"),
        (
            ["--testbed", str(TESTBEDS / "one_winch.yaml")],
            f"{TESTBEDS / 'one_winch.yaml'}: machine one_winch has no bar, allowed: one with a bar",
        ),
        (["nowhere"], "nowhere: no such scenario, allowed: "),
    ],
)
def test_bad_input_is_one_line(refused, arguments, text):
    assert refused("analyze", "linear", *arguments).startswith(text)


def test_a_pose_at_which_nothing_holds_the_bar_is_refused(refused):
    line = refused("analyze", "linear", "--pose", "3,0,1,0,0,0", code=1)
    assert "no tensions" in line
