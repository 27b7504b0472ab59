"""What benchmarks draw, before anything is recorded."""

import math
import re
import sys
from collections import Counter
from itertools import combinations, pairwise
from pathlib import Path

import pytest
from error_lines import said

from cspm_msgs_py.errors import InputError
from cspm_msgs_py.testbed import load_testbed

pytest.importorskip("mujoco", minversion="4.0", reason="the MuJoCo plant needs MuJoCo 4")
from bench.blind import __main__ as cli
from bench.blind import make as making
from bench.blind.concealed_run import machine_of
from bench.blind.item import amounts_of, draw_items, truth_of
from bench.blind.make import Request, make
from bench.blind.reality.phenomena import PHENOMENA
from bench.blind.strata import STRATA
from bench.blind.truth import SPLITS
from cspm_run.library import find_scenario
from cspm_sim.effects import catalogue

SCENARIOS = Path(__file__).resolve().parents[3] / "scenarios"
MACHINE = load_testbed(SCENARIOS / "testbeds/thesis.yaml").testbed


def draw(count=400, seed=5, strata=None):
    return draw_items(strata or list(STRATA.values()), count, seed, 60.0, machine_of)


def test_one_seed_draws_one_benchmark_and_another_another():
    assert draw() == draw()
    assert not {i.name for i in draw()} & {i.name for i in draw(seed=6)}


def test_strata_have_their_shares_and_enough_has_nothing_to_find():
    counted = Counter(item.stratum for item in draw())
    whole = sum(s.share for s in STRATA.values())
    assert all(abs(counted[n] - 400 * s.share / whole) <= 1 for n, s in STRATA.items())
    assert counted["nothing"] >= 60
    assert counted["parameter"] >= 60
    page = (SCENARIOS.parent / "docs/explanation/blind-benchmark.md").read_text(encoding="utf-8")
    rows = re.findall(r"^\| (\w+) \| .* \| (\d+) \|$", page, re.MULTILINE)
    assert {name: int(count) for name, count in rows} == counted


def test_the_order_of_names_tells_nothing_of_the_stratum():
    """Neighbours share a stratum as often as chance has it."""
    items = draw()
    counted = Counter(item.stratum for item in items)
    expected = sum((n / 400) ** 2 for n in counted.values())
    same = sum(a.stratum == b.stratum for a, b in pairwise(items)) / 399
    assert abs(same - expected) < 4.0 * math.sqrt(expected * (1 - expected) / 399)


def test_notes_are_drawn_without_regard_to_the_truth():
    items = [i for i in draw(2000) if i.concealed and PHENOMENA[i.concealed[0].phenomenon].effect]
    right = sum(i.note == PHENOMENA[i.concealed[0].phenomenon].effect for i in items) / len(items)
    effects = len({p.effect for p in PHENOMENA.values() if p.effect})
    assert abs(right - 1 / effects) < 4.0 * math.sqrt(1 / effects / len(items))


def test_all_that_strata_name_is_there():
    for stratum in STRATA.values():
        for case in stratum.cases:
            assert set(case.phenomena) <= set(PHENOMENA)
            assert all(find_scenario(name).exists() for name in case.scenarios)
            assert case.absorbed_by is None or case.absorbed_by in PHENOMENA
    used = {n for s in STRATA.values() for c in s.cases for n in c.phenomena}
    assert used == set(PHENOMENA)


def test_every_case_is_drawn_as_often_as_any_other_of_its_stratum():
    counted = Counter((item.stratum, item.case) for item in draw())
    for stratum in STRATA.values():
        times = [counted[stratum.name, case] for case in stratum.cases]
        assert min(times) >= 1
        assert max(times) - min(times) <= 1
    multiples = Counter(i.concealed[0].multiple for i in draw(4000) if i.stratum == "noise")
    assert {abs(m) for m in multiples} == {0.5, 1.0, 2.0, 4.0}


def test_all_that_the_catalogue_calls_confounded_is_combined():
    known = {p.effect for p in PHENOMENA.values() if p.effect}
    confounded = {
        frozenset((effect.id, other))
        for effect in catalogue().values()
        for other in effect.description.confounded_with
        if effect.id in known and other in known
    }
    assert len(confounded) >= 32
    pairs = [i.case.phenomena for i in draw() if i.stratum == "combined"]
    assert confounded <= {frozenset(PHENOMENA[name].effect for name in pair) for pair in pairs}


def test_splits_of_one_seed_have_nothing_in_common(tmp_path):
    drawn = [making._items(request(tmp_path, split=split, count=50)) for split in SPLITS]
    for one, other in combinations(drawn, 2):
        assert not {i.name for i in one} & {i.name for i in other}
        assert not {i.seed for i in one} & {i.seed for i in other}


def test_amounts_are_the_multiple_of_each_cables_limit():
    items = [i for i in draw() if i.case.everywhere]
    limits = {name: [0.1 * (k + 1) for k in range(8)] for name in PHENOMENA}
    for item in items:
        amounts = amounts_of(item, limits, 8)
        (each,) = item.concealed
        assert amounts[each.phenomenon] == [each.multiple * 0.1 * (k + 1) for k in range(8)]
        reported = truth_of(item, amounts, MACHINE)["concealed"][0]
        assert list(reported["values"]) == list(MACHINE.cable_names)
    single = next(i for i in draw() if i.concealed and len(i.concealed[0].cables) == 1)
    amounts = amounts_of(single, limits, 8)[single.concealed[0].phenomenon]
    assert sum(amount != 0.0 for amount in amounts) == 1


def request(folder, **changed):
    options = {
        "folder": folder / "bench",
        "truth": folder / "truth.json",
        "seed": 1,
        "count": 2,
        "split": "dev",
        "strata": ("nothing",),
        "duration": 15.0,
    }
    return Request(**{**options, **changed})


@pytest.mark.parametrize(
    ("changed", "text"),
    [
        ({"strata": ("fog",)}, r"^--strata fog: allowed: nothing, parameter, noise"),
        ({"split": "all"}, r"^--split all: allowed: dev, tune, sealed$"),
        ({"sensors": "bad"}, r"^--sensors bad: allowed: real, plain$"),
        ({"count": 0}, r"^--count 0: allowed: 1 or more$"),
        ({"survey": 0.02}, r"^--survey 20: allowed: 0 to 10 mm$"),
        ({"survey": -0.001}, r"^--survey -1: allowed: 0 to 10 mm$"),
        ({"duration": 3.0}, r"^--duration 3: allowed: 15 to 200 s$"),
    ],
)
def test_wrong_requests_are_refused(tmp_path, changed, text):
    with pytest.raises(InputError, match=text):
        make(request(tmp_path, **changed))
    assert not list(tmp_path.iterdir())


def test_the_command_line_refuses_in_one_line(monkeypatch, capsys, tmp_path):
    out = str(tmp_path / "bench")
    words = ["bench.blind", "make", "--seed", "1", "--out", out, "--split", "all"]
    monkeypatch.setattr(sys, "argv", words)
    with pytest.raises(SystemExit) as caught:
        cli.main()
    assert caught.value.code == 2
    assert said(capsys.readouterr().err) == "--split all: allowed: dev, tune, sealed\n"
    monkeypatch.setattr(sys, "argv", ["bench.blind", "run", out])
    with pytest.raises(SystemExit) as caught:
        cli.main()
    assert caught.value.code == 2
    line = f"{out}: no recordings, allowed: a folder of `python -m bench.blind make`\n"
    assert said(capsys.readouterr().err) == line


def test_a_truth_among_the_recordings_and_one_of_another_benchmark_are_refused(tmp_path):
    with pytest.raises(InputError, match=r"^--truth .*: allowed: a file outside .*bench$"):
        make(request(tmp_path, truth=tmp_path / "bench" / "deep" / "truth.json"))
    (tmp_path / "truth.json").write_text('{"asked": {"seed": 2}}')
    with pytest.raises(InputError, match=r"of another benchmark \(\{'seed': 2\}\), allowed"):
        make(request(tmp_path))


def test_what_cannot_show_is_refused_before_anything_is_recorded():
    item = next(i for i in draw() if i.concealed and i.concealed[0].cables == (3,))
    limits = {name: [math.inf] * 8 for name in PHENOMENA}
    with pytest.raises(InputError, match=r"^--duration: .* does not show in .*, allowed: a longer"):
        amounts_of(item, limits, 8)
    name = item.concealed[0].phenomenon
    limits[name] = [math.inf] * 3 + [0.5] + [math.inf] * 4
    assert amounts_of(item, {n: limits[name] for n in limits}, 8)[name][3] != 0.0
