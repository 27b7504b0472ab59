"""What the bench of separating experiments counts."""

from bench.blind.separating import SeparationCase, separating_table

CONCEALED = {"effect": "winch_coulomb_friction", "elements": ["sway_1"]}
ITEM = {"name": "0a1b2c3d", "concealed": [CONCEALED], "absorbed_by": None}


def reported(effect, *others, element="sway_1"):
    rivals = [{"effect": other} for other in others]
    finding = {"effect": effect, "elements": [element], "alternatives": rivals}
    return {"verdict": "tie" if others else "effect", "findings": [finding]}


def counts(before, after):
    case = SeparationCase(ITEM, before, ("quick_sea",), after)
    lines = separating_table([case], "ab" * 32, 7).splitlines()
    rows = [line for line in lines if line.startswith(("| before", "| with the"))]
    return [["1 of 1" in cell for cell in row.split("|")[2:6]] for row in rows]


def test_a_tie_is_right_when_it_is_decided_for_the_truth():
    """Right without a tie, right first, among the ties, something else without a tie."""
    tie = reported("pulley_friction", "winch_coulomb_friction")
    right, wrong = reported("winch_coulomb_friction"), reported("pulley_friction")
    assert counts(tie, right) == [[False, False, True, False], [True, True, True, False]]
    assert counts(tie, wrong)[1] == [False, False, False, True]
    elsewhere = reported("winch_coulomb_friction", element="sway_2")
    assert counts(tie, elsewhere)[1] == [False, False, True, True]


def test_what_is_unknown_or_consistent_misleads_nobody():
    tie = reported("winch_coulomb_friction", "pulley_friction")
    assert counts(tie, tie)[1] == [False, True, True, False]
    assert counts(tie, reported("unknown"))[1] == [False, False, False, False]
    assert counts(tie, {"verdict": "consistent", "findings": []})[1] == [False] * 4


def test_a_tie_without_an_experiment_is_reported_and_not_counted():
    case = SeparationCase(ITEM, reported("pulley_friction", "winch_coulomb_friction"), (), None)
    table = separating_table([case], "ab" * 32, 7)
    assert "1 are tied in what is found first; for 0 an experiment" in table
    assert (
        "| pulley_friction on sway_1 (or winch_coulomb_friction) | none | no experiment |" in table
    )
    assert table.count("no cases") == 8
