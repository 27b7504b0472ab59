"""Effects concealed in recordings: that they are what is said, and how answers are judged."""

import json
import sys
from pathlib import Path

import numpy as np
import pytest
import yaml

from bench.concealed import __main__ as command
from bench.concealed.case import AS_IT_IS, DELETION, SPIKE, Case, cases_of, conceal, item_of
from bench.concealed.diagnose_all import diagnose_all
from bench.concealed.machine import Machine, machines
from bench.concealed.page import board, draw_curve, misses
from bench.concealed.scatter import FURTHER, Estimate, agreeing
from bench.concealed.score import groups, judged, read_own
from bench.real.dataset import Dataset
from bench.real.least_squares import least_squares
from cspm.open_data.source import MACHINES
from cspm_ident.signals.measurement import read_measurement
from cspm_msgs_py.errors import InputError
from cspm_msgs_py.testbed import load_testbed
from cspm_sim.effects import catalogue

ROOT = Path(__file__).resolve().parents[4] / "shared" / "data" / "open"
KUKA = "repository:cspm/open_data/machines/kuka_kr300/axis_6"
DEG = np.pi / 180.0
INERTIA, VISCOUS, COULOMB = 0.45, 2.5, 0.6
# Published, not estimated from the recordings.
PUBLISHED = {("pendulum", "winch_unbalance"), ("ship", "bar_restoring")}
TORQUES = (
    *("winch_coulomb_friction", "winch_viscous_friction", "winch_inertia", "winch_torque_offset"),
    *("winch_torque_gain", "winch_torque_ripple", "winch_directional_friction"),
)


def table(path, seed):
    """A shaft that swings, with inertia and friction, in a little noise; as the KUKA's tables."""
    random = np.random.default_rng(seed)
    t = np.arange(4000) / 250.0
    waves = [(1.1, 0.7, 0.0), (0.5, 1.9, seed), (0.2, 3.1, 1.0)]
    q = sum(a * np.sin(w * t + p) for a, w, p in waves)
    v = sum(a * w * np.cos(w * t + p) for a, w, p in waves)
    a = -sum(a * w**2 * np.sin(w * t + p) for a, w, p in waves)
    torque = INERTIA * a + VISCOUS * v + COULOMB * np.sign(v) + random.normal(0.0, 0.02, len(t))
    rows = np.stack([t, q / DEG, v / DEG, torque, q / DEG], axis=1)
    np.savetxt(path, rows, "%.7f", ",", header="t,pos_deg,vel_deg_s,torque_nm,r", comments="")


@pytest.fixture(scope="module")
def place(tmp_path_factory):
    folder = tmp_path_factory.mktemp("set")
    table(folder / "A.csv", 0)
    table(folder / "B.csv", 1)
    return folder


@pytest.fixture(scope="module")
def machine(tmp_path_factory):
    """What `table` is, with all of it in the file."""
    file = tmp_path_factory.mktemp("file") / "known.yaml"
    content = yaml.safe_load((MACHINES / "kuka_kr300" / "axis_6_known.yaml").read_text())
    content["cables"][0]["rotor_inertia"] = INERTIA
    friction, drag = content["effects"]
    friction["parameters"], drag["parameters"] = {"torque": COULOMB}, {"coefficient": VISCOUS}
    file.write_text(yaml.safe_dump(content))
    known = {"winch_coulomb_friction": {"torque": (0.5, 0.7)}, "winch_viscous_friction": {}}
    files = (f"{KUKA}_mapping.yaml", f"{KUKA}.yaml", ["A.csv"])
    dataset = Dataset("made up", "here", "set", *files, known, "as made", held_out=["B.csv"])
    terms = {
        "winch_coulomb_friction": {"torque": COULOMB},
        "winch_viscous_friction": {"coefficient": VISCOUS},
    }
    columns = {"angle": ("pos_deg", DEG), "torque": ("torque_nm", 1.0)}
    deletions = {**terms, "winch_inertia": {"inertia": 0.5 * INERTIA}}
    more = ("a6", columns, 250.0, 0.1, deletions, TORQUES)
    return Machine("swing", str(file), dataset, *more)


def amounts(case, place, folder):
    """What least squares of the concealed effect alone find, and what that leaves."""
    searched, held_out = conceal(case, place, folder)
    own = [[read_measurement(each) for each in part] for part in (searched, held_out)]
    return least_squares(*own, [case.effect])


@pytest.mark.parametrize("effect", TORQUES)
def test_what_is_added_is_found_by_least_squares_with_its_size_and_sign(
    machine, place, tmp_path, effect
):
    case = Case(machine, SPIKE, effect, 4.0)
    (concealed,) = item_of(case, place)["concealed"]
    found = amounts(case, place, tmp_path)
    value, number = concealed["values"]["a6"], found.amounts[effect][concealed["parameter"]]
    if effect == "winch_torque_gain":
        # Its column is the model's torque: the weight is 1 − 1/gain.
        number = 1.0 / (2.0 - number)
    assert number - concealed["base"] == pytest.approx(value - concealed["base"], rel=0.05)
    # What is left is the noise alone.
    assert found.error < 0.04


@pytest.mark.parametrize("effect", ["winch_coulomb_friction", "winch_inertia"])
def test_a_deleted_term_is_what_the_file_lacks_and_no_more(machine, place, tmp_path, effect):
    case = Case(machine, DELETION, effect)
    found = amounts(case, place, tmp_path)
    (concealed,) = item_of(case, place)["concealed"]
    assert found.amounts[effect][concealed["parameter"]] == pytest.approx(
        concealed["values"]["a6"], rel=0.05
    )
    assert found.error < 0.04
    has = {entry.effect for entry in load_testbed(tmp_path / "testbed.yaml").testbed.effects}
    assert has == {*machine.terms} - {effect}


def test_sizes_are_of_what_is_added_and_the_same_every_time(machine, place, tmp_path):
    def torque(folder, size):
        folder.mkdir()
        conceal(Case(machine, SPIKE, "winch_viscous_friction", size), place, folder)
        return np.loadtxt(folder / "tables" / "A.csv", delimiter=",", skiprows=1)[:, 3]

    as_it_is = np.loadtxt(place / "A.csv", delimiter=",", skiprows=1)[:, 3]
    one, again, four = (torque(tmp_path / str(k), s) for k, s in enumerate((1.0, 1.0, 4.0)))
    assert np.array_equal(one, again)
    assert four - as_it_is == pytest.approx(4.0 * (one - as_it_is), abs=1e-5)
    speed = np.abs(np.loadtxt(place / "A.csv", delimiter=",", skiprows=1)[:, 2])
    added = (one - as_it_is)[speed > 0.05 * speed.max()]
    assert np.sqrt(np.mean(added**2)) == pytest.approx(0.1, rel=0.01)


def test_no_more_is_added_than_a_machine_can_have(machine, place):
    assert item_of(Case(machine, SPIKE, "winch_torque_gain", 1.0), place) is not None
    assert item_of(Case(machine, SPIKE, "winch_torque_gain", 60.0), place) is None


def test_truth_is_repeatable_or_published_and_every_effect_is_known():
    """Searched and held-out runs agree within 5 % on what is deleted."""
    for machine in machines():
        assert {*machine.terms, *machine.deletions} <= catalogue().keys()
        assert {*machine.spikes} <= catalogue().keys()
        for effect, parameters in machine.deletions.items():
            if (machine.name, effect) in PUBLISHED:
                continue
            runs = machine.repeats[f"{effect} {next(iter(parameters))}"][:2]
            assert np.ptp(runs) / 2.0 <= 0.05 * np.mean(runs), (machine.name, effect)
    names = [case.name for m in machines() for case in cases_of(m, (1.0,))]
    assert len(names) == len(set(names)) > 50


KNOWN = {"m": {"winch_stribeck_friction"}}


def finding(effect, *, interval=(0.9, 1.1), others=()):
    return {
        "effect": effect,
        "elements": ["a"],
        "parameters": [{"element": "a", "name": "torque", "value": 1.0, "ci95": interval}],
        "alternatives": [{"effect": other} for other in others],
        "region": {"driver": "speed [rad/s]"},
    }


def item(name, effect="winch_coulomb_friction", value=1.0):
    concealed = {
        "effect": effect,
        "kind": "effect",
        "phenomenon": effect,
        "block": "winch",
        "elements": ["a"],
        "multiple": 1.0,
        "parameter": "torque",
        "base": 0.0,
        "values": {"a": value},
    }
    more = {"scenario": "m", "absorbed_by": None, "stratum": SPIKE if effect else AS_IT_IS}
    return {"name": name, "concealed": [concealed] if effect else [], **more}


def outcome(findings, verdict="effect", tmp_path=None, **given):
    """The judgement of what anybody may have written."""
    path = tmp_path / "mine.json"
    answer = {"verdict": verdict, "findings": findings}
    path.write_text(json.dumps({"method": "mine", "results": {"case": answer}}))
    method, results = read_own(path, ["case"])
    assert method == "mine"
    (found,) = judged([item("case", **given)], results, KNOWN)
    return found


DRY, OFFSET = finding("winch_coulomb_friction"), finding("winch_torque_offset")
STRIBECK, UNKNOWN = finding("winch_stribeck_friction"), finding("unknown")


@pytest.mark.parametrize(
    ("findings", "first", "tied", "wrong", "held"),
    [
        ([DRY], True, True, 0, [True]),
        ([UNKNOWN, STRIBECK, DRY], True, True, 0, [True]),
        ([finding("winch_coulomb_friction", interval=(0.8, 0.95))], True, True, 0, [False]),
        ([finding("winch_torque_offset", others=["winch_coulomb_friction"])], False, True, 0, []),
        ([OFFSET, DRY], False, True, 1, [True]),
        ([OFFSET], False, False, 1, []),
        ([UNKNOWN], False, False, 0, []),
        ([], False, False, 0, []),
    ],
)
def test_an_answer_is_judged_by_what_it_names(findings, first, tied, wrong, held, tmp_path):
    found = outcome(findings, tmp_path=tmp_path)
    assert (found.first, found.tied, found.wrong) == (first, tied, wrong)
    assert [each.covered for each in found.estimates] == held


def test_where_nothing_is_concealed_only_what_is_true_there_may_be_named(tmp_path):
    assert outcome([STRIBECK], effect=None, tmp_path=tmp_path).wrong == 0
    assert outcome([DRY], effect=None, tmp_path=tmp_path).wrong == 1
    assert outcome([UNKNOWN], effect=None, tmp_path=tmp_path).wrong == 0


def test_board_and_curve_show_every_group_and_every_miss(tmp_path):
    answers = {
        "named": [DRY],
        "false": [OFFSET],
        "silent": [],
        "blank": [OFFSET],
    }
    results = {
        name: {"verdict": "effect" if given else "unknown", "findings": given}
        for name, given in answers.items()
    }
    path = tmp_path / "mine.json"
    path.write_text(json.dumps({"method": "mine", "results": results}))
    items = [item(name) for name in ("named", "false", "silent")] + [item("blank", effect=None)]
    outcomes = judged(items, read_own(path, [*answers])[1], KNOWN)
    blank, spikes = groups(outcomes)
    assert (blank.label, blank.false[:2]) == (AS_IT_IS, (1, 1))
    assert (spikes.size, spikes.first[:2], spikes.false[:2]) == (1.0, (1, 3), (1, 3))
    assert (spikes.abstained[:2], spikes.held[:2]) == ((1, 3), (1, 1))
    assert "| mine | spike-in 1 × | 3 | 1 of 3 | 1 of 3 | 1 of 3 | 1 of 3 |" in board(
        {"mine": outcomes}
    )
    missed = misses(outcomes)
    assert "| false | false, not named | effect | winch_torque_offset |" in missed
    assert "| silent | abstained | unknown | nothing |" in missed
    assert not any(line.startswith("| named |") for line in missed.splitlines())
    draw_curve(tmp_path / "curve.png", outcomes)
    assert (tmp_path / "curve.png").stat().st_size > 10_000


@pytest.mark.parametrize(
    ("content", "text"),
    [
        ("[]", "not readable"),
        ('{"method": "m", "results": {"case": {"findings": []}}}', "'verdict'"),
        ('{"method": "m", "results": {"x": {"verdict": "", "findings": []}}}', "no case x"),
    ],
)
def test_an_unusable_file_of_answers_is_one_line(content, text, tmp_path):
    (tmp_path / "mine.json").write_text(content)
    with pytest.raises(InputError, match=r"mine\.json: .*allowed: ") as caught:
        read_own(tmp_path / "mine.json", ["case"])
    assert text in str(caught.value)


def test_a_folder_without_any_data_set_is_one_line(tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(sys, "argv", ["x", str(tmp_path)])
    assert command.main() == 2
    assert (
        "allowed: a folder with dfki_pendulum_bsd3, kitepower_ccby, kuka" in capsys.readouterr().err
    )


def test_runs_agree_where_their_intervals_hold_the_difference():
    runs = [Estimate("A", 1.0, 0.1), Estimate("B", 1.12, 0.1), Estimate("C", 1.3, 0.1)]
    assert agreeing(runs[:2]) == (1, 1)
    assert agreeing(runs) == (1, 3)
    assert agreeing(runs[:1]) == (0, 0)
    assert {*FURTHER} < {machine.name for machine in machines()}


@pytest.mark.slow
def test_a_deleted_friction_is_named_first_in_a_real_recording(tmp_path):
    (machine,) = (each for each in machines() if each.name == "kuka_6")
    place = machine.dataset.place([ROOT])
    if place is None:
        pytest.skip("no copies of the published recordings: they are no part of the project")
    case = Case(machine, DELETION, "winch_viscous_friction")
    diagnose_all([(case, place)], tmp_path, ["cspm"], 1)
    found = json.loads((tmp_path / "results" / case.name / "diagnosis.json").read_text())
    results = {case.name: {"diagnosis": found, "times": {"cpu_s": 0.0}}}
    (outcome,) = judged([item_of(case, place)], results, {"kuka_6": machine.known})
    assert outcome.first
    assert outcome.wrong == 0
    assert [each.covered for each in outcome.estimates] == [True]
