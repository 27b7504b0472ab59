"""Whether sentences of docs/results.md say what was found."""

from bench.results.result_sentences import (
    DEEP_PLANS,
    ROUGHEST_PLAN,
    STEPS_OF_SWAY,
    beam_said,
    causes_said,
    corrected_said,
    deep_said,
    late_said,
    payload_said,
    six_said,
    touched_said,
    winch_said,
)
from bench.results.result_winch_cases import wound


def run(surge=0.0, sway=0.0, heave=0.0, roll=0.0, **more):
    """Return a run's findings with these RMS errors [mm, mrad]."""
    found = {"rms": [1e-3 * e for e in (surge, sway, heave, roll, 0.0, 0.0)], "slack": 0.0}
    return found | {"tensions": [0.2, 9.0], "within": 1.0, "failure": ""} | more


def test_causes_are_stated_by_the_largest_gain_and_the_range_that_is_left():
    found = {
        "without the governor": run(9.0, 6.0, 2.0),
        "ideal sensors": run(8.9, 6.1, 2.0),
        "force controllers at 1000 instead of 800 rad/s": run(9.0, 5.75, 2.0),
        "half the waves": run(0.02, 0.01, 0.04),
    }
    assert "more than 0.25 mm off" in causes_said(found)
    assert "errors are 0.01 to 0.04 mm with" in causes_said(found)


def test_the_calm_sea_is_stated_beside_the_figures_of_the_thesis():
    found = {
        STEPS_OF_SWAY[0]: run(0.0, 0.208, 0.107),
        STEPS_OF_SWAY[1]: run(0.0, 0.0416, 0.0535, 2.0),
    }
    said = beam_said(found)
    assert "of 4 and 15 µrad" in said
    assert "heave is 2.0 times and sway 10 times as large" in said
    assert "makes them 1.0 and 2.0 times as large" in said
    assert "roll of 23 mrad does not follow such waves, which make 2.0. " in said
    assert "begins with 68 mrad" in said


def test_what_is_planned_and_what_is_kept_are_stated_as_shares_of_the_least():
    found = {run_: run(4.0, 3.3) for run_ in DEEP_PLANS}
    found |= {plan: [4e-3, 3e-3, *4 * [0.0]] for plan in DEEP_PLANS.values()}
    assert "has 1.00 to 1.10 times the least error" in deep_said(found)
    found = {
        "seed 1": run(1.0, slack=1e-5),
        "seed 2": run(1.9, 2.1),
        "seed 9": run(2.2, slack=5e-6),
        ROUGHEST_PLAN: [2e-3, *5 * [0.0]],
    }
    said = six_said(found)
    assert "2 of 3 seeds have an RMS error above 2 mm; seed 9's in surge is 1.10 times" in said
    assert said.endswith("one is in 2 seeds, for 2 ms at most.")


def test_robustness_is_stated_by_time_share_and_difference():
    assert "first time after 1 s." in touched_said({"worst case": [0.9] * 5 + [0.29, 0.8]})
    assert "requirement for 12% of" in late_said({"poses 5 ms late": run(within=0.88)})
    found = {
        "nothing": run(heave=0.04),
        "all load cells +1 N, dry friction 2 mN·m at every motor": run(heave=0.2),
        "another": run(failure="fell"),
    }
    said = "Of 3 runs 1 end early. All load cells off at once cost 0.16 mm RMS in heave"
    assert corrected_said(found).startswith(said)


def test_feed_forward_is_stated_for_each_of_its_steps():
    found = {name: run(heave=0.5) for name in wound()}
    for name, heave in (("", 0.4), (", fed forward", 0.03), (", and stretch", 0.012)):
        found[f"force controllers at 200 rad/s{name}"] = run(heave=heave, slack=heave / 100)
    found["200 rad/s, 100 Hz, and stretch"] = run(tensions=[0.0, 9.0])
    said = winch_said(found)
    assert "in µm: 400, 30, 12 at 200 rad/s, 500, 500, 500 at 800" in said
    assert "slack for 0.40% and 0.03% of the time" in said
    assert "from 0.20 to 0.00 N at 200 rad/s" in said


def test_payloads_are_stated_with_and_without():
    fixed, swinging = "0.8 kg taken up at 50 s", "0.4 kg swinging 0.3 m below"
    found = {fixed: run(heave=0.3), swinging: run(2.0, heave=0.7, not_met=0.04)}
    found[f"{fixed}, estimated from its heave"] = run(heave=0.1)
    found[f"{swinging}, estimated from its heave"] = run(2.5, heave=0.6, not_met=0.03)
    said = payload_said(found)
    assert "heave goes from 0.30 to 0.10 mm" in said
    assert "from 0.70 to 0.60 mm, surge from 2.00 to 2.50 mm" in said
    assert "for 4.0% of the time, 3.0% where a mass is estimated" in said
