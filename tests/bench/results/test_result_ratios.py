"""Whether figures that follow from several runs are what was found."""

from bench.results.result_ratios import (
    DEEP_PLANS,
    ROUGHEST_PLAN,
    STEPS_OF_SWAY,
    beam_ratios,
    deep_ratios,
    first_limit,
    six_figures,
)


def run(surge=0.0, sway=0.0, heave=0.0, slack=0.0):
    """Return a run's findings with these RMS errors [mm]."""
    return {"rms": [1e-3 * e for e in (surge, sway, heave, 0.0, 0.0, 0.0)], "slack": slack}


def cells(table):
    """Return the cells of a table's rows, without its head."""
    return [[c.strip() for c in line.split("|")[1:-1]] for line in table.splitlines()[2:]]


def test_the_calm_sea_is_beside_the_figures_of_the_thesis():
    found = {STEPS_OF_SWAY[0]: run(0.0, 0.208, 0.107), STEPS_OF_SWAY[1]: run(0.0, 0.0416, 0.0535)}
    assert cells(beam_ratios(found)) == [
        [STEPS_OF_SWAY[0], "10", "2"],
        [STEPS_OF_SWAY[1], "2", "1"],
    ]


def test_runs_at_four_metres_are_shares_of_the_least():
    found = {name: run(4.0, 3.3) for name in DEEP_PLANS}
    found |= {plan: [4e-3, 3e-3, *4 * [0.0]] for plan in DEEP_PLANS.values()}
    assert cells(deep_ratios(found)) == [["surge and sway", "1.00 to 1.10"]]


def test_six_coordinates_are_counted_by_seed():
    found = {
        "seed 1": run(1.0, slack=1e-5),
        "seed 2": run(1.9, 2.1),
        "seed 9": run(2.2, slack=5e-6),
        ROUGHEST_PLAN: [2e-3, *5 * [0.0]],
    }
    assert [row[1] for row in cells(six_figures(found))] == ["2 of 3", "1.10", "2 of 3", "2"]
    assert cells(six_figures(found | {"seed 1": run(), "seed 9": run(2.2)}))[-1][1] == "0"


def test_the_limit_is_met_at_its_first_instant():
    table = first_limit({"worst case": [0.9] * 5 + [0.29, 0.8]})
    assert cells(table) == [["first instant without tensions from 0.3 N on [s]", "1"]]
