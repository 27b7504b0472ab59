"""Calls side by side: order, number at once, errors."""

import os
import threading

import pytest

from cspm_ident.side_by_side import side_by_side

PATIENCE_S = 60.0


def meeting(count):
    """Return a call that waits until so many are made at once."""
    barrier = threading.Barrier(count)

    def call(item):
        barrier.wait(PATIENCE_S)
        return 2 * item

    return call


def test_results_are_in_the_order_of_the_items(monkeypatch):
    monkeypatch.setattr(os, "cpu_count", lambda: 4)
    assert side_by_side(meeting(4), range(4)) == [0, 2, 4, 6]
    assert side_by_side(meeting(2), range(4), most=2) == [0, 2, 4, 6]


@pytest.mark.parametrize(("processors", "most", "expected"), [(4, 2, 2), (1, 2, 1), (None, 2, 1)])
def test_no_more_at_once_than_allowed_and_than_there_are_processors(
    monkeypatch, processors, most, expected
):
    monkeypatch.setattr(os, "cpu_count", lambda: processors)
    threads = set()
    side_by_side(lambda _: threads.add(threading.get_ident()), range(50), most)
    assert 1 <= len(threads) <= expected


def test_an_error_of_a_call_is_raised():
    with pytest.raises(ZeroDivisionError):
        side_by_side(lambda item: 1 / item, [1, 0])
