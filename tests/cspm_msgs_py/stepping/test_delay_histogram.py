"""How late messages were, by classes."""

import pytest

from cspm_msgs_py.stepping.delay_histogram import UP_TO_MS, DelayHistogram

MS = 1_000_000


def counted(*delays_ms):
    found = DelayHistogram()
    for delay in delays_ms:
        found.add(round(delay * MS))
    return found


def test_a_bound_belongs_to_the_class_below_it_and_the_next_nanosecond_does_not():
    for i, bound in enumerate(UP_TO_MS):
        at, above = counted(bound), counted(bound + 1.0 / MS)
        assert at.counts.index(1) == i
        assert above.counts.index(1) == i + 1
        assert (at.share_above(bound), above.share_above(bound)) == (0.0, 1.0)


def test_nothing_is_left_out_however_late_or_early():
    found = counted(-3.0, 0.0, 1e6)
    assert (found.counts[0], found.counts[-1], found.total) == (2, 1, 3)


def test_shares_are_of_all():
    found = counted(0.1, 0.9, 1.1, 4.0)
    assert [found.share_above(bound) for bound in (0.5, 1.0, 5.0)] == [0.75, 0.5, 0.0]
    assert DelayHistogram().share_above(1.0) == 0.0
    with pytest.raises(ValueError, match="not in tuple"):
        found.share_above(0.7)


def test_it_is_read_as_it_is_written():
    found = counted(0.1, 7.0, 7.0, 80.0)
    assert DelayHistogram.from_text(str(found)).counts == found.counts
