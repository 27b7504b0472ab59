"""The scorecard of made-up diagnoses, counted by hand."""

import numpy as np
import pytest
from scipy.stats import binom

from bench.blind.scoring.comparison import comparison
from bench.blind.scoring.floor import healthy_floors
from bench.blind.scoring.outcome import Beginning, judge, kind_of
from bench.blind.scoring.page import scorecard_page
from bench.blind.scoring.scorecard import scorecard
from bench.blind.scoring.share import share, upper_bound


def concealed(effect="winch_coulomb_friction", element="surge_1", kind="effect", multiple=2.0):
    return {
        "phenomenon": "bristles",
        "kind": kind,
        "effect": effect,
        "block": "winch",
        "elements": [element],
        "multiple": multiple,
        "parameter": "torque",
        "base": 0.0,
        "values": {element: 0.02},
    }


def item(name, *hidden, stratum="noise", absorbed_by=None):
    return {
        "name": name,
        "stratum": stratum,
        "scenario": "calm",
        "absorbed_by": absorbed_by,
        "concealed": list(hidden),
    }


def finding(effect, element="surge_1", alternatives=(), value=0.021, probability=0.9):
    return {
        "subsystem": "winch",
        "elements": [element],
        "effect": effect,
        "probability": probability,
        "parameters": [
            {"element": element, "name": "torque", "value": value, "ci95": [0.0195, 0.0225]}
        ],
        "alternatives": [{"effect": a, "elements": [element]} for a in alternatives],
    }


FIT = {"nrmse_before": 0.1, "nrmse_retuned_nominal": 0.08, "nrmse_after": 0.012}
ELSEWHERE = FIT | {"nrmse_before": 0.01, "noise_floor": 0.01}


def result(verdict, *findings):
    fit = [
        {"channel": "winches/torque/surge_1", "held_out": FIT | {"noise_floor": 0.01}},
        {"channel": "cables/tension/surge_1", "held_out": ELSEWHERE},
        {"channel": "winches/torque/surge_2", "held_out": ELSEWHERE | {"nrmse_before": 0.5}},
    ]
    diagnosis = {"verdict": verdict, "findings": list(findings), "residuals": fit}
    return {"diagnosis": diagnosis, "times": {"wall_s": 9.0, "cpu_s": 4.0}}


FRICTION = "winch_coulomb_friction"
TORQUE = "winches/torque/surge_1"
FLOORS = {("calm", TORQUE): 2.0, ("calm", "cables/tension/surge_1"): 1.0}


def judged(hidden, reported):
    return judge(hidden, reported, FLOORS)


def test_a_diagnosis_that_is_right_in_everything():
    outcome = judged(item("a", concealed()), result("effect", finding(FRICTION)))
    assert (outcome.kind, outcome.verdict, outcome.multiple) == ("effect", "effect", 2.0)
    assert outcome.detected
    assert outcome.block
    assert outcome.element
    assert outcome.first
    assert outcome.named
    assert outcome.tied
    assert outcome.tie_sizes == (1,)
    assert outcome.wrong == 0
    assert not outcome.unknown
    (estimate,) = outcome.estimates
    assert estimate.error == pytest.approx(0.05)
    assert estimate.covered
    assert outcome.probabilities == ((0.9, True),)
    assert outcome.fit == pytest.approx((5.0, 4.0, 0.6))


@pytest.mark.parametrize(
    ("interval", "covered"),
    [([0.0, 0.9], True), ([0.03, 1.0], False), (None, None)],
)
def test_an_interval_holds_the_truth_or_not_or_there_is_none(interval, covered):
    said = finding(FRICTION)
    said["parameters"][0]["ci95"] = interval
    (estimate,) = judge(item("a", concealed()), result("effect", said), FLOORS).estimates
    assert estimate.covered is covered


@pytest.mark.parametrize(
    ("said", "alternatives", "there", "tied"),
    [
        ("cable", (), False, False),
        ("cable", ("winch_load_friction",), False, True),
        ("cable", ("tension_gain",), False, False),
        ("winch", ("tension_gain",), True, True),
    ],
)
def test_a_block_may_be_tied_with_what_is_said_first(said, alternatives, there, tied):
    reported = finding("pulley_friction", alternatives=alternatives) | {"subsystem": said}
    outcome = judged(item("a", concealed()), result("tie", reported))
    assert (outcome.block, outcome.block_tied) == (there, tied)


@pytest.mark.parametrize(
    ("effect", "channel"),
    [
        ("cable_transverse_damping", "bar/wrench"),
        ("cable_hysteresis", "cables/tension/surge_1"),
        ("winch_torque_ripple", TORQUE),
        # A load cell's zero shows in several, of which the worst counts.
        ("tension_bias", "winches/torque_command/surge_1"),
    ],
)
def test_errors_are_those_of_the_residual_that_shows_the_effect(effect, channel):
    """Damping across a cable is no part of its tension's law: it pulls at the bar.

    Nor does a ripple act in what a drive says of its command, which may be worse by chance.
    """
    reported = result("effect")
    sides = {"cables/tension/surge_1": 0.3, "bar/wrench": 0.4}
    sides |= {TORQUE: 0.2, "winches/torque_command/surge_1": 0.35}
    reported["diagnosis"]["residuals"] = [
        {"channel": name, "held_out": FIT | {"nrmse_before": before, "noise_floor": 0.01}}
        for name, before in sides.items()
    ]
    floors = {("calm", name): 1.0 for name in sides}
    hidden = item("a", concealed() | {"effect": effect})
    assert judge(hidden, reported, floors).fit == pytest.approx((100 * sides[channel], 8.0, 1.2))


def test_errors_are_in_units_of_what_healthy_machines_of_the_scenario_leave():
    healthy, broken = item("healthy"), item("broken", concealed())
    other, failed = item("other") | {"scenario": "worst_case"}, item("failed")
    results = {name: result("consistent") for name in ("healthy", "broken", "other")}
    results["failed"] = {"diagnosis": None, "times": {"cpu_s": 1.0}}
    found = healthy_floors({"items": [healthy, broken, other, failed]}, results)
    assert found["calm", TORQUE] == pytest.approx(10.0)
    assert found["worst_case", TORQUE] == pytest.approx(10.0)
    assert found["calm", "winches/torque/surge_2"] == pytest.approx(50.0)
    louder = result("consistent")
    louder["diagnosis"]["residuals"][0]["held_out"] = FIT | {"noise_floor": 0.005}
    two = {"items": [healthy, item("louder")]}
    assert healthy_floors(two, {"healthy": results["healthy"], "louder": louder})[
        "calm", TORQUE
    ] == pytest.approx(15.0)
    assert judge(broken, result("consistent"), {}).fit is None
    assert healthy_floors({"items": [broken]}, results) == {}


def test_the_right_effect_on_another_element_is_not_named():
    outcome = judged(item("a", concealed()), result("effect", finding(FRICTION, "surge_2")))
    assert outcome.effect_only
    assert not outcome.named
    assert not outcome.element
    assert outcome.estimates == ()


def test_a_truth_among_the_alternatives_is_tied_and_not_named():
    reported = finding("winch_load_friction", alternatives=(FRICTION, "pulley_friction"))
    outcome = judged(item("a", concealed()), result("tie", reported))
    assert outcome.tied
    assert not outcome.named
    assert outcome.tie_sizes == (3,)
    assert outcome.wrong == 0
    assert outcome.probabilities == ((0.9, False),)


def test_a_finding_that_holds_no_truth_is_wrong():
    reported = result("effect", finding("tension_gain"), finding(FRICTION))
    outcome = judged(item("a", concealed()), reported)
    assert outcome.named
    assert not outcome.first
    assert outcome.wrong == 1


def test_combined_faults_are_named_when_all_of_them_are():
    pair = item("a", concealed(), concealed("winch_viscous_friction", "sway_1"))
    half = judged(pair, result("effect", finding(FRICTION)))
    assert not half.named
    assert not half.tied
    reported = result("effect", finding(FRICTION), finding("winch_viscous_friction", "sway_1"))
    both = judged(pair, reported)
    assert both.named


def test_the_number_that_took_an_effect_over_is_no_wrong_finding():
    reported = result("effect", finding(FRICTION), finding("winch_drum_radius"))
    assert judged(item("a", concealed(), absorbed_by="radius"), reported).wrong == 0
    assert judged(item("a", concealed()), reported).wrong == 1


def test_what_the_catalogue_lacks_is_named_unknown():
    hidden = item("a", concealed(effect=None, kind="unknown"))
    assert kind_of(hidden) == "outside"
    assert judged(hidden, result("unknown", finding("unknown", probability=None))).named
    assert not judged(hidden, result("effect", finding(FRICTION))).named


@pytest.mark.parametrize(
    ("effect", "kind", "cases"), [(None, "unknown", 0), (FRICTION, "effect", 1)]
)
def test_only_what_was_named_by_an_effect_has_an_error_to_mend(effect, kind, cases):
    hidden = item("a", concealed(effect=effect, kind=kind))
    reported = result(kind, finding(effect or "unknown", probability=None))
    blank = [item(name) for name in "bc"]
    truth = {"asked": {}, "items": [hidden, *blank]}
    results = {"a": reported, "b": result("consistent"), "c": result("consistent")}
    fit = scorecard(truth, results)["fit"]
    assert (fit["cases"], fit["near_floor"][1]) == (cases, cases)


def test_a_diagnosis_that_failed_found_nothing():
    outcome = judged(item("a"), {"diagnosis": None, "times": {"cpu_s": 1.0}})
    assert (outcome.verdict, outcome.detected, outcome.fit) == ("failed", False, None)


def test_shares_carry_the_intervals_of_clopper_and_pearson():
    # None of 60: the textbook's 1 − 0.025^(1/60) and, one-sided, 1 − 0.05^(1/60).
    assert share([False] * 60)[:3] == (0, 60, 0.0)
    assert share([False] * 60).high == pytest.approx(1 - 0.025 ** (1 / 60))
    assert upper_bound(0, 60) == pytest.approx(1 - 0.05 ** (1 / 60))
    assert share([]) == (0, 0, 0.0, 1.0)
    assert upper_bound(0, 0) == 1.0


@pytest.mark.parametrize("cases", [2, 7, 60])
def test_intervals_hold_the_truth_as_often_as_they_promise(cases):
    """Exactly, by summing over all outcomes; the narrowest that do so are not much wider."""
    shares = [share([True] * hits + [False] * (cases - hits)) for hits in range(cases + 1)]
    bounds = [upper_bound(hits, cases) for hits in range(cases + 1)]
    least = {"interval": 1.0, "bound": 1.0}
    for true in np.linspace(0.002, 0.998, 250):
        chances = binom.pmf(np.arange(cases + 1), cases, true)
        held = sum(c for c, s in zip(chances, shares, strict=True) if s.low <= true <= s.high)
        below = sum(c for c, bound in zip(chances, bounds, strict=True) if true <= bound)
        least = {"interval": min(least["interval"], held), "bound": min(least["bound"], below)}
    assert 0.95 <= least["interval"] < 0.985
    assert 0.95 <= least["bound"] < 0.96


def card():
    truth = {
        "asked": {
            "seed": 1,
            "count": 6,
            "split": "dev",
            "duration": 30.0,
            "sensors": "real",
            "strata": ["noise"],
        },
        "items": [
            item("a", concealed()),
            item("b", concealed(multiple=0.5)),
            item("c", stratum="nothing"),
            item("d", stratum="nothing"),
            item("e", concealed(effect=None, kind="unknown", multiple=4.0), stratum="outside"),
            item("f", concealed(kind="parameter", multiple=4.0), stratum="parameter"),
            item("g", concealed()),
            item("h", stratum="nothing"),
        ],
    }
    results = {
        "a": result("effect", finding(FRICTION)),
        "b": result("consistent"),
        "c": result("consistent"),
        "d": result("effect", finding(FRICTION)),
        "e": result("consistent"),
        "f": result("effect", finding("tension_gain")),
        "h": {"diagnosis": None, "times": {"wall_s": 1.0, "cpu_s": 1.0}},
    }
    return scorecard(truth, results) | {"peers": [], "ablations": []}


def test_a_scorecard_counts():
    found = card()
    assert (found["drawn"], found["scored"]) == (8, 7)
    shares = {key: value[:2] for key, value in found["shares"].items() if isinstance(value, tuple)}
    assert shares == {
        "detected": (2, 2),
        "block": (2, 2),
        "block_tied": (2, 2),
        "element": (2, 2),
        "first": (1, 2),
        "named": (1, 2),
        "effect_only": (1, 2),
        "tied": (1, 2),
        "nothing_wrong_beside": (1, 2),
        "false_alarm": (1, 2),
        "parameter_called_effect": (1, 1),
        "unknown_recognised": (0, 1),
        "driver": (0, 0),
        "false_unknown": (0, 6),
        "failed": (1, 7),
        "region_reported": (0, 1),
        "region": (0, 0),
    }
    assert [(r["multiple"], r["detected"][:2]) for r in found["by_multiple"]] == [
        (0.5, (0, 1)),
        (2.0, (1, 1)),
        (4.0, (1, 1)),
    ]
    assert found["confusion"]["nothing"] == {"consistent": 1, "effect": 1, "failed": 1}
    assert found["fit"]["below_retuned"][:2] == (1, 1)
    (row,) = found["parameters"]["by_effect"]
    assert (row["effect"], row["estimates"], row["covered"][:2]) == (FRICTION, 1, (1, 1))
    assert row["median_signed_error"] == pytest.approx(0.05)
    # Of the findings reported with 0.9, one is right.
    assert [row["right"][:2] for row in found["calibration"]] == [(0, 0), (0, 0), (1, 3), (0, 0)]


def test_the_page_says_what_split_it_is_of_and_tells_every_miss():
    text = scorecard_page(card(), "ab" * 32, "today on two processors")
    assert (
        "7 of 8 recordings; drawn with seed 1, count 6, split dev, duration 30.0, sensors real"
        in text
    )
    assert "Scored today on two processors. This is the development split" in text
    assert "under development" in text
    assert "| d | nothing |  | 0 | effect | winch_coulomb_friction: surge_1 |" in text
    assert "| winch_coulomb_friction | 1 | +5.0 % | 100 % (1 of 1; 3 to 100) |" in text
    assert "| alarm where there is nothing | 50 % (1 of 2; 1 to 99) | ≤ 3 % |" in text


def test_the_seed_of_a_sealed_split_is_kept_back_while_recordings_are_left():
    sealed = card() | {"asked": card()["asked"] | {"split": "sealed"}}
    assert "7 of 8 recordings; drawn with count 6" in scorecard_page(sealed, "ab" * 32, "today")
    whole = sealed | {"scored": 8}
    assert "8 of 8 recordings; drawn with seed 1" in scorecard_page(whole, "ab" * 32, "today")


def begun(onset, reported, interval):
    hidden = item("a", concealed()) | {"onset_s": onset}
    said = finding(FRICTION) | {"onset_s": reported, "onset_ci95_s": interval}
    (found,) = judged(hidden, result("effect", said)).beginnings
    return found


def test_a_beginning_is_held_against_the_truth():
    assert begun(12.0, 12.5, [11.0, 13.0]) == Beginning(12.0, 12.5, True)
    assert begun(12.0, 12.5, [12.2, 13.0]) == Beginning(12.0, 12.5, False)
    assert begun(12.0, None, None) == Beginning(12.0, None, None)
    hidden = item("a", concealed()) | {"onset_s": 12.0}
    assert judged(hidden, result("effect", finding("tension_gain"))).beginnings == ()


def test_onsets_are_counted_late_and_false():
    truth = {
        "asked": {},
        "items": [
            item(name, concealed()) | {"onset_s": onset}
            for name, onset in (("a", 12.0), ("b", 12.0), ("c", 0.0), ("d", 0.0))
        ],
    }
    said = {"a": (12.5, [12.0, 13.0]), "b": (None, None), "c": (None, None), "d": (4.0, [3.0, 5.0])}
    results = {
        name: result("effect", finding(FRICTION) | {"onset_s": at, "onset_ci95_s": interval})
        for name, (at, interval) in said.items()
    }
    onsets = scorecard(truth, results)["onsets"]
    assert onsets["reported"][:2] == (1, 2)
    assert onsets["held"][:2] == (1, 1)
    assert onsets["median_error_s"] == pytest.approx(0.5)
    assert onsets["false"][:2] == (1, 2)
    assert onsets["right"][:2] == (2, 4)


def test_regions_of_what_was_named_are_counted_and_what_tells_nothing_apart():
    said = {
        "a": {"driver": "speed [rad/s]", "low": -1.0, "high": 2.0},
        "b": {"driver": "time [s]", "low": 3.0, "high": 9.0},
        "c": {},
    }
    truth = {"asked": {}, "items": [item(name, concealed()) for name in said]}
    results = {
        name: result("effect", finding(FRICTION) | {"region": region}, finding("tension_gain"))
        for name, region in said.items()
    }
    found = scorecard(truth, results)
    assert [o["regions"] for o in found["outcomes"]] == [(True,), (False,), (None,)]
    assert found["shares"]["region_reported"][:2] == (2, 3)
    assert found["shares"]["region"][:2] == (1, 2)
    (row,) = found["by_stratum"]
    assert row["region"][:2] == (1, 2)
    page = card() | {key: found[key] for key in ("shares", "by_stratum")}
    text = scorecard_page(page, "ab" * 32, "today")
    assert "where one was given | 50 % (1 of 2; 1 to 99); none given for 1 |" in text
    assert "| noise | 3 | 3 | 3 | 3 | 3 | 3 | 1 of 2 | 3 | 0 |" in text


def test_the_region_of_something_unknown_counts_and_is_no_beginning():
    hidden = item("a", concealed(effect=None, kind="unknown") | {"phenomenon": "eddy currents"})
    said = finding("unknown", probability=None) | {"region": {"driver": "speed [rad/s]"}}
    outcome = judged(hidden, result("unknown", said))
    assert outcome.regions == (True,)
    assert outcome.beginnings == ()
    elsewhere = said | {"elements": ["sway_1"]}
    assert judged(hidden, result("unknown", elsewhere)).regions == ()


def test_the_signal_of_the_unknown_has_to_be_the_right_one_on_the_right_element():
    hidden = item("a", concealed(effect=None, kind="unknown") | {"driver": "speed"})

    def reported(driver, element="surge_1"):
        said = finding("unknown", element, probability=None) | {"region": {"driver": driver}}
        return judged(hidden, result("unknown", said)).driver

    assert reported("speed [rad/s]") is True
    assert reported("time [s]") is False
    assert reported("speed [rad/s]", "sway_1") is False
    assert judged(hidden, result("consistent")).driver is None
    assert judged(item("a", concealed()), result("unknown", finding("unknown"))).driver is None


def test_methods_are_compared_on_the_recordings_that_all_have():
    truth = {"asked": {}, "items": [item("a", concealed()), item("b", concealed()), item("c")]}
    right = result("effect", finding(FRICTION))
    wrong = result("effect", finding("tension_gain"), finding("bar_mass"))
    rows = comparison(
        truth,
        {"cspm": {"a": right, "b": right, "c": right}, "lasso": {"a": wrong, "c": wrong}},
    )
    assert [(row["method"], row["scored"]) for row in rows] == [("cspm", 2), ("lasso", 2)]
    assert [row["first"][:2] for row in rows] == [(1, 1), (0, 1)]
    assert [row["false_alarm"][:2] for row in rows] == [(1, 1), (1, 1)]
    assert [row["wrong_per_recording"] for row in rows] == [0.5, 2.0]
    # The healthy machine's residuals are as large before.
    assert (rows[0]["before"], rows[0]["after"]) == pytest.approx((1.0, 0.12))
    text = scorecard_page(card() | {"peers": rows}, "ab" * 32, "today")
    assert "2 recordings, the same for all" in text
    found = "1 of 1 | 1 of 1 | 1 of 1 | — | 0 of 1 | 0 of 1 | 0 of 1 | 1 of 1 | — | — | 0 of 2 |"
    assert f"| lasso | {found} 0 of 2 | — | 100 % | 2.0 |" in text
    assert "| lasso | — | — | — | — | 1 → 0.8 → 0.12 | 4 |" in text
    assert "## Without one safeguard" not in text
