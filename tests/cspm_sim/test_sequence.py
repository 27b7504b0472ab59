"""The stamps of one topic in order, and who may send them."""

import pytest
from hypothesis import given
from hypothesis import strategies as st
from schedules import schedule_with

from cspm_msgs_py.errors import CspmError, InputError
from cspm_msgs_py.stepping.lockstep import Sequence

MS = 1_000_000


@given(
    first=st.integers(0, 30),
    divider=st.integers(1, 20),
    delay=st.integers(0, 30),
    n=st.integers(1, 9),
)
def test_stamps_are_taken_in_order(first, divider, delay, n):
    sequence = Sequence("/in", schedule_with(first + delay, divider, delay))
    assert sequence.complete == first + delay - 1
    for i in range(n):
        sequence.take((first + i * divider) * MS)
        # Until the next one is due nothing is missing.
        assert sequence.complete == first + delay + (i + 1) * divider - 1


@pytest.mark.parametrize(
    ("stamp", "why"),
    [
        (29 * MS, "came already: a restarted clock or a second sender"),
        (20 * MS, "came already: a restarted clock or a second sender"),
        (-1, "came already: a restarted clock or a second sender"),
        (30 * MS + 1, "is early: messages lost or a second sender"),
        (40 * MS, "is early: messages lost or a second sender"),
        (2**60, "is early: messages lost or a second sender"),
    ],
)
def test_other_stamps_are_refused_and_change_nothing(stamp, why):
    sequence = Sequence("/in", schedule_with(divider=10))
    for step in (0, 10, 20):
        sequence.take(step * MS)
    with pytest.raises(InputError) as caught:
        sequence.take(stamp)
    assert str(caught.value) == f"/in: stamp {stamp * 1e-9:.6f} s {why}, allowed: 0.030000 s"
    assert sequence.complete == 29
    sequence.take(30 * MS)
    assert sequence.complete == 39


def test_the_stamp_that_is_due_with_another_number_is_refused_and_changes_nothing():
    sequence = Sequence("/in", schedule_with(divider=10))
    for i in range(3):
        assert sequence.next_number == i + 1
        sequence.take(10 * i * MS, i + 1)
    for number in (1, 2, 3, 5):
        with pytest.raises(InputError) as caught:
            sequence.take(30 * MS, number)
        assert str(caught.value) == (
            f"/in: stamp 0.030000 s is its sender's message {number}, allowed: 4; a second sender"
        )
    assert sequence.complete == 29
    # Where the middleware gives no numbers the stamp has to do.
    sequence.take(30 * MS)
    sequence.take(40 * MS, 5)
    assert sequence.complete == 49


def taken(steps):
    sequence = Sequence("/in", schedule_with())
    for step in range(steps):
        sequence.take(step * MS, step + 1)
    return sequence


def test_a_stranger_that_cannot_be_distinguished_from_the_sender_ends_the_run():
    """If the last message was the stranger's, this one is the genuine one; if not, not."""
    with pytest.raises(CspmError) as caught:
        taken(6).take(5 * MS, 6)
    assert not isinstance(caught.value, InputError)
    assert str(caught.value) == (
        "/in: two senders sent their message 6 with the stamp 0.005000 s,"
        " allowed: one sender (ROS_DOMAIN_ID keeps runs apart)"
    )


@pytest.mark.parametrize(("stamp", "number"), [(5, 5), (5, 7), (5, None), (4, 6), (4, 5), (0, 1)])
def test_what_cannot_have_taken_the_senders_place_is_refused_only(stamp, number):
    sequence = taken(6)
    with pytest.raises(InputError, match=r"came already"):
        sequence.take(stamp * MS, number)
    sequence.take(6 * MS, 7)


def test_a_sender_that_lags_behind_its_imitator_is_noticed():
    """Of the last messages all may have been the imitator's; then the genuine ones follow."""
    sequence = taken(6)
    with pytest.raises(InputError):
        sequence.take(2 * MS, 3)
    with pytest.raises(CspmError, match="two senders"):
        sequence.take(3 * MS, 4)
