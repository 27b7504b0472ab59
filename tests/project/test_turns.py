"""Slow tests of which some are left out each time: which, goes round."""

import pytest
from conftest import turned

FILES = [f"test_{i}.py" for i in range(57)]


@pytest.mark.parametrize("turn", [0, 1, 2, 497_412])
def test_a_turn_has_every_file_once_and_those_that_were_neighbours_still_are(turn):
    found = turned(FILES, turn)
    first = found.index(FILES[0])
    assert found[first:] + found[:first] == FILES


@pytest.mark.parametrize("turn", [0, 1, 7, 497_412])
@pytest.mark.parametrize(("runs", "share"), [(3, 0.40), (5, 0.25), (8, 0.16)])
def test_in_a_few_turns_in_a_row_all_files_come_early(turn, runs, share):
    early = round(share * len(FILES))
    reached = {name for run in range(runs) for name in turned(FILES, turn + run)[:early]}
    assert reached == set(FILES)


def test_without_a_turn_the_order_stays():
    assert turned(FILES, 0) == FILES
    assert turned([], 5) == []
