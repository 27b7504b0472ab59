"""Losses, from the numbers that senders give their messages."""

import numpy as np
import pytest

from cspm_msgs_py.stepping.sequence_numbers import SequenceNumbers


def lost(numbers):
    found = SequenceNumbers()
    for number in numbers:
        found.add(number)
    return found.lost


@pytest.mark.parametrize(
    ("numbers", "missing"),
    [
        ([], 0),
        ([1, 2, 3], 0),
        # Heard from the middle on.
        ([500, 501, 502], 0),
        ([1, 2, 5, 6], 2),
        ([1, 4, 9], 6),
        # The sender was started anew.
        ([100, 101, 1, 2, 3], 0),
        ([100, 101, 1, 2, 5], 2),
        # A stranger's messages between those of the sender.
        ([100, 1, 101, 102, 2, 103, 3], 0),
        ([100, 1, 101, 105, 2, 106], 3),
    ],
)
def test_what_is_missing(numbers, missing):
    assert lost(numbers) == missing


def test_skipping_is_adding_those_that_follow():
    skipped, added = SequenceNumbers(), SequenceNumbers()
    assert skipped.following is None
    for each in (skipped, added):
        each.add(7)
    assert skipped.following == 8
    skipped.skip(3)
    for number in (8, 9, 10):
        added.add(number)
    assert skipped.following == added.following == 11
    for each in (skipped, added):
        each.add(13)
    assert skipped.lost == added.lost == 2


def test_any_order_of_senders_far_from_each_other_loses_nothing_but_what_is_left_out():
    rng = np.random.default_rng(3)
    for _ in range(50):
        senders = [iter(range(10_000 * s + 1, 10_000 * s + 200)) for s in (2, 1, 0)]
        # Each is heard once at first, the latest number first: nobody appears ahead of another.
        numbers = [next(sender) for sender in senders]
        missing = 0
        for _ in range(300):
            sender = senders[rng.integers(3)]
            number = next(sender, None)
            if number is None:
                continue
            following = next(sender, None) if rng.random() < 0.1 else None
            missing += following is not None
            numbers.append(number if following is None else following)
        assert lost(numbers) == missing


def test_many_strangers_are_forgotten():
    found = SequenceNumbers()
    for start in range(1000, 0, -1):
        found.add(start * 100)
    assert len(found._expected) == 10
    assert found.lost == 0
