"""What the page of results is made from."""

import re
import sys
from dataclasses import replace

import numpy as np
import pytest
from run_samples import bundle_of

from bench.accuracy.tension_distribution import drawn_wrenches, score
from bench.markdown import markdown_table
from bench.page import into_page
from bench.results.__main__ import PAGE, main
from bench.results.feasibility import least_errors, least_tensions
from bench.results.result_blocks import Block, blocks_of, pictured
from bench.results.result_cases import (
    AT_FOUR_METRES,
    BEYOND,
    CAMERA_100_HZ,
    CAUSES,
    CORNERS,
    LIMITED,
    PAST,
    ROUGH_CORNERS,
    SWITCHED,
    SWITCHED_4M,
    SWITCHED_CALM,
    SWITCHED_GAINS,
    THESIS,
    calm,
    seeded,
)
from bench.results.result_machines import fastest_crossover
from bench.results.result_measures import tracking
from bench.results.result_robust_cases import INFORMED, changed, corrected
from bench.results.result_store import Measurement, Store, spoken
from bench.results.result_tables import (
    calm_block,
    distribution_block,
    extremes_block,
    tracking_block,
)
from bench.results.result_work import work_off
from bench.results.tracking import Case, follow, track
from cspm_control.design.gains import design_motion_gains
from cspm_model.parameters import nominal_parameters
from cspm_msgs_py.control_spec.distribution import TensionDistribution
from cspm_msgs_py.errors import InputError
from cspm_run.recorded_run import run

pytestmark = pytest.mark.compiled


@pytest.mark.slow
def test_every_case_is_a_run_that_can_be_made():
    groups = (
        THESIS,
        SWITCHED,
        SWITCHED_GAINS,
        SWITCHED_CALM,
        SWITCHED_4M,
        CAUSES,
        BEYOND,
        AT_FOUR_METRES,
        CORNERS,
        LIMITED,
    )
    groups += (ROUGH_CORNERS, INFORMED, changed(PAST), corrected(), seeded(2, CAMERA_100_HZ))
    for case in {case.scenario: case for group in groups for case in group.values()}.values():
        assert case.bundle().testbed.testbed.bar is not None
    for case in SWITCHED_4M.values():
        # Gains that are designed at 4 m have to have the thesis's margins there.
        assert case.bundle().scenario.control.motion.gains
    with pytest.raises(InputError, match=r"^effects: bar_mass: parameters \['weight'\], allowed"):
        track(Case("rest", ("duration=0.01",), (("bar_mass", (), {"weight": 1.0}),)))


def test_following_finds_what_a_run_finds():
    case = Case("worst_case", ("duration=0.5",))
    errors, tensions, missed, failure = follow(case.bundle())
    statistics = run(case.bundle(), None).statistics
    np.testing.assert_allclose(np.sqrt((errors**2).mean(axis=0)), statistics.rms_error, rtol=1e-9)
    assert (tensions.min(), tensions.max()) == statistics.tension_range
    assert missed.mean() == pytest.approx(statistics.infeasible_share)
    assert failure == ""


@pytest.mark.slow
def test_the_plant_has_the_effects_of_a_case_and_the_controllers_do_not():
    plain = Case("rest", ("duration=0.1", "sensors=ideal"))
    heavy = Case("rest", plain.overrides, (("bar_mass", (), {"mass": 0.5}),))
    assert track(plain).largest[2] < 1e-6
    assert track(heavy).tensions[1] > track(plain).tensions[1] * 1.02
    gains = [case.bundle().scenario.control.motion.gains for case in (plain, heavy)]
    assert gains[0] == gains[1]


def test_the_limit_at_rest_is_the_share_of_the_weight_that_symmetry_leaves():
    """Hoist, surge and sway cables are pairs and a four: the least tension is that of them all."""
    bundle = bundle_of("rest", "duration=1.0")
    least = least_tensions(bundle, np.array([0.0, 0.5]))
    assert least == pytest.approx([least[0]] * 2, rel=1e-9)
    exits = np.array([cable.exit for cable in bundle.testbed.testbed.cables])
    ends = np.array([cable.attachment for cable in bundle.testbed.testbed.cables]) + np.array(
        [0, 0, 2.0]
    )
    upward = (ends - exits)[:, 2] / np.linalg.norm(ends - exits, axis=1)
    # With all eight alike nothing but the weight is left to hold.
    assert least[0] == pytest.approx(4.06 * 9.81 / upward.sum(), rel=1e-6)


@pytest.mark.slow
def test_more_is_asked_than_pulling_cables_can_give():
    """The bar accelerates downward at up to g; the literal reading asks for more."""
    least = least_tensions(
        bundle_of("worst_case_literal", "duration=20.0"), np.arange(0.0, 20.0, 0.1)
    )
    assert (least < 0.0).mean() > 0.1


def test_a_scenario_that_names_no_method_gets_one_that_meets_whatever_can_be_met():
    testbed = Case("worst_case").bundle().testbed.testbed
    drawn = drawn_wrenches(testbed, 200, seed=4)
    usual = score(testbed, TensionDistribution().method, drawn)
    assert usual.met == 1.0
    assert usual.residual <= 1e-6
    thesis = score(testbed, "pseudo_inverse", drawn)
    assert 0.0 < thesis.met < 0.9
    assert usual.wrong == thesis.wrong == 0


COUNTS = []


def counted(number, more=0):
    """Measure something, and leave a trace of having done so."""
    COUNTS.append(number)
    return number + more


def test_what_was_measured_is_kept_until_what_decides_it_changes(tmp_path, monkeypatch):
    COUNTS.clear()
    store, reported = Store(tmp_path), []
    first = Measurement("a, b", counted, (1,))
    second = Measurement("c", counted, (20,), needs=(first,))
    timed = Measurement("d", counted, (3,), alone=True)
    work_off(store, [second, timed], 1, reported.append)
    # What measures time comes first, what needs others last.
    assert COUNTS == [3, 1, 20]
    assert store.find(second).found == 21
    assert reported[2] == "3 of 3: c, 0 s of the processor"
    work_off(store, [second, timed, first], 1, reported.append)
    assert COUNTS == [3, 1, 20]
    assert store.find(replace(first, arguments=(2,))) is None
    # Another first one is another second one.
    assert store.find(replace(second, needs=(replace(first, arguments=(2,)),))) is None
    monkeypatch.setattr("bench.results.result_store.code_hash", lambda: "another")
    assert store.find(first) is None


def test_names_that_differ_in_a_sign_are_kept_apart(tmp_path):
    store = Store(tmp_path)
    for sign in "+−":
        store.keep(Measurement(f"stiffness {sign}20 %", counted), sign, 0.0)
    found = [store.find(Measurement(f"stiffness {sign}20 %", counted)).found for sign in "+−"]
    assert found == ["+", "−"]


def test_a_scenario_and_its_code_decide_but_not_its_comments():
    calm, rest = (Measurement("m", tracking, (Case(name),)) for name in ("calm", "rest"))
    assert calm.fingerprint() != rest.fingerprint()
    assert calm.fingerprint() == Measurement("n", tracking, (Case("calm"),)).fingerprint()
    code = 'def f(x):\n    """Say."""\n    return x + 1\n'
    assert spoken(code) == spoken("def f(x):  # say\n    return x + 1\n")
    assert spoken(code) != spoken(code.replace("1", "2"))


@pytest.mark.slow
def test_processes_measure_what_one_would(tmp_path):
    cases = [Case("rest", ("duration=0.02", f"seed={seed}")) for seed in (1, 2)]
    found = []
    for workers in (1, 2):
        store = Store(tmp_path / str(workers))
        wanted = [Measurement(f"seed {i}", tracking, (case,)) for i, case in enumerate(cases)]
        work_off(store, wanted, workers, lambda _: None)
        found.append([store.find(each).found for each in wanted])
    assert found[0] == found[1]
    assert found[0][0] != found[0][1]


def test_what_is_stopped_says_how_it_goes_on(tmp_path, monkeypatch, capsys):
    def stopped(*_):
        raise KeyboardInterrupt

    page = tmp_path / "page.md"
    page.write_text("as it was")
    monkeypatch.setattr("bench.results.__main__.PAGE", page)
    monkeypatch.setattr("bench.results.__main__.work_off", stopped)
    monkeypatch.setattr(sys, "argv", ["results", "--keep", str(tmp_path / "kept")])
    assert main() == 1
    said = "".join(capsys.readouterr().out.split())
    assert said.endswith("kept,thesamecommandgoeson")
    assert page.read_text() == "as it was"


def test_one_block_is_renewed_alone(tmp_path, monkeypatch, capsys):
    page = tmp_path / "page.md"
    blocks = "<!-- results: machine -->\nold\n<!-- end -->\n"
    page.write_text(blocks + blocks.replace("machine", "past"))
    monkeypatch.setattr("bench.results.__main__.PAGE", page)
    nothing = str(tmp_path / "kept")
    options = ["results", "--seeds", "3", "--only", "machine", "--keep", nothing]
    monkeypatch.setattr(sys, "argv", options)
    assert main() == 0
    renewed, kept = page.read_text().split("<!-- end -->\n")[:2]
    assert "; 3 seeds. 0 of " in renewed
    sources = [*blocks_of(3).values(), Block(pictured(), str)]
    every = [each for block in sources for each in block.measurements.values()]
    names = {one.name for each in every for one in (each, *each.needs)}
    assert f" of {len(names)} measurements" in renewed
    assert renewed.endswith("they took 0.0 h of one processor.\n")
    assert kept == "<!-- results: past -->\nold\n"
    monkeypatch.setattr(sys, "argv", ["results", "--only", "machines"])
    with pytest.raises(SystemExit, match="2"):
        main()
    assert "error: --only: machines, allowed: machine, thesis," in capsys.readouterr().err
    monkeypatch.setattr(sys, "argv", ["results", "--workers", "0"])
    with pytest.raises(SystemExit, match="2"):
        main()
    assert "error: --workers: 0, allowed: 1 or more" in capsys.readouterr().err


def test_an_error_that_nobody_can_avoid_is_where_no_tensions_are_left():
    drop = "target.motion={type: moves, moves: [{at: 0.5, duration: 0.4, by: [0,0,0.5,0,0,0]}]}"
    assert not least_errors(bundle_of("rest", "duration=1.5")).any()
    errors = [least_errors(bundle_of("rest", "duration=1.5", drop), t)[2] for t in (0.0, 1.0)]
    assert 1e-3 < errors[0] < errors[1]


def test_what_the_default_distribution_reaches_is_stated_beside_the_table():
    rows = [[f"`{name}`", *"123456", "78"] for name in ("qp", "analytic_centre")]
    rows[1][1:4] = "100 %", "90 %", "5e-7"
    assert distribution_block(rows).endswith(
        "The default, `analytic_centre`: 100 % of the feasible set (to reach: 100 %), residual"
        " 5e-7 of the demand (≤ 1e-6), p99 78 µs (< 100 µs)."
    )


def test_a_row_of_the_calm_sea_is_the_worst_of_its_seeds():
    worst = {
        "rms": [1e-4, 2e-4, 3e-4, 0.9, 4e-4, 5e-4],
        "largest": [1e-3, 2e-3, 3e-3, 0.9, 4e-3, 5e-3],
        "within": 0.98,
        "tensions": [1.5, 9.0],
        "slack": 0.01,
        "failure": "",
    }
    better = worst | {"rms": [0.0] * 6, "within": 1.0, "tensions": [2.0, 9.0], "slack": 0.0}
    runs = {"1000 Hz, seed 1": better, "1000 Hz, seed 2": worst, "100 Hz, seed 1": better}
    _, _, fast, slow, _ = calm_block(runs).splitlines()
    assert fast == (
        "| 1000 Hz | 2 | 0.10, 0.20, 0.30 | 0.40, 0.50 | 1.00, 2.00, 3.00 | 4.00, 5.00 | 98.00%"
        " | 1.50 | 1.000% | 0 |"
    )
    assert slow.startswith("| 100 Hz | 1 | 0.00, 0.00, 0.00 | 0.00, 0.00 | 1.00,")


def test_the_calm_sea_is_asked_to_be_followed_ten_times_as_closely():
    usual, tenth = Case("calm").bundle().scenario, calm(1)["100 Hz, seed 1"].bundle().scenario
    assert tenth.requirement.position == pytest.approx(usual.requirement.position / 10)
    assert tenth.requirement.angle == pytest.approx(usual.requirement.angle / 10)
    assert tenth.rates.motion_capture == 100


def test_the_fastest_loop_can_be_designed_and_a_faster_one_cannot():
    testbed, pose = Case(PAST).bundle().testbed.testbed, (0.0, 0.0, 2.0, 0.0, 0.0, 0.0)
    fastest = fastest_crossover(testbed, pose, "yaw")
    parameters = nominal_parameters(testbed)
    assert design_motion_gains(testbed, parameters, pose, {"yaw": fastest})
    with pytest.raises(InputError, match=r"yaw at \d+ rad/s has a gain margin"):
        design_motion_gains(testbed, parameters, pose, {"yaw": fastest + 1})


def test_a_table_goes_between_its_own_marks_alone(tmp_path):
    page = tmp_path / "page.md"
    page.write_text("<!-- a -->\nold\n<!-- end -->\n<!-- b -->\nkept\n<!-- end -->\n<!-- c -->\n")
    into_page(page, "a", "new\nlines")
    expected = "<!-- a -->\nnew\nlines\n<!-- end -->\n<!-- b -->\nkept\n<!-- end -->\n<!-- c -->\n"
    assert page.read_text() == expected
    for name in ("c", "d"):
        with pytest.raises(ValueError, match=rf"page.md: no <!-- {name} --> with <!-- end -->"):
            into_page(page, name, "new")
    assert page.read_text() == expected


def test_the_page_has_a_place_for_every_block_and_tables_in_them():
    page = PAGE.read_text(encoding="utf-8")
    names = re.findall(r"<!-- results: (\w+) -->\n.*?<!-- end -->", page, re.DOTALL)
    assert len(names) == len(set(names)) == page.count("<!-- results: ")
    assert set(names) == {*blocks_of(1), "machine"}
    assert markdown_table(["a", "b"], [["1", "2"]]) == "| a | b |\n| --- | --- |\n| 1 | 2 |"
    data = track(Case("rest", ("duration=0.02",))).data()
    for block in (tracking_block, extremes_block):
        lines = block({"rest": data}).splitlines()
        assert len({re.sub(r"[^|]", "", line) for line in lines}) == 1


# What figures the page's prose may have, beside generated blocks: none that was measured.
THE_THESIS_SAYS = ("Tables 8-1 and 8-2", "tables 7-1 and 7-2", "(60°, 6 dB)")
RUNS_ARE_SET_TO = (
    "(its first 200 s)",
    "target at 4 m the loop fails",
    "each of 60 000 milliseconds",
    "wanted tensions down to 0.3 N",
    "seed 6, with one thing changed",
    "with 0.5 s of foresight",
    "but those of force at 1000 Hz",
    "these controllers at 100 Hz",
    "worst of all seeds, 200 s each",
    "target at 4 m, with the settings",
    "*4 times softer*",
    "can rest with 2 N in every cable",
    "tensions from 0.3 N on over the 40 s of each run",
    "the bar aside at 4 m",
    "Down at 4 m the cables",
    "with tensions down to 0 N and the reference known 2 s ahead",
    "plan from 0.5 N on, at 4 m from 0.6 N, with six coordinates from 0.7 N",
    "tensions ≥ 0 exist",
    "the first 20 s of the worst case",
    "has 10 mN·m of dry and 0.1 mN·m·s of viscous friction",
    "*+20 %* and *−20 %* are what it really has",
    "with tensions down to 0 N no controller",
    "lets cables down to 0.3 N",
    "where one says 1 N too much",
    "the line with 1 N above",
    "100 s each",
)


def figures_in(page, allowed=()):
    """Return what has a digit in a page's prose: outside generated blocks, code and links."""
    text = re.sub(r"<!-- (results: \w+) -->.*?<!-- end -->", "", page, flags=re.DOTALL)
    text = re.sub(r"```.*?```|`[^`]*`|\]\([^)]*\)", "", text, flags=re.DOTALL)
    text = " ".join(text.split())
    unused = [phrase for phrase in allowed if phrase not in text]
    for phrase in allowed:
        text = text.replace(phrase, "")
    return unused + re.findall(r".{0,30}\d.{0,20}", text)


def test_measured_figures_stand_in_generated_blocks_alone():
    page = PAGE.read_text(encoding="utf-8")
    assert figures_in(page, THE_THESIS_SAYS + RUNS_ARE_SET_TO) == []
    block = "<!-- results: a -->\n0.3 mm\n<!-- end -->"
    assert figures_in(f"It takes `0.2` [long](a1.md).\n{block}\nAnd ends.") == []
    assert figures_in(f"{block}\nIt costs\n0.2 mm in heave.") == ["It costs 0.2 mm in heave."]
    assert figures_in("from 1 N on", ("from 2 N on",)) == ["from 2 N on", "from 1 N on"]
