"""What is missing, by the numbers that senders give their messages."""

from __future__ import annotations

_MOST_SENDERS = 10


class SequenceNumbers:
    """Counts what is missing from the numbers of the messages of one topic.

    Nothing says which of several senders gave a number: it counts on from the nearest that came
    before it, and one that is before all others is a new sender's.

    Attributes:
        lost: how many are missing.
    """

    def __init__(self) -> None:
        self._expected: list[int] = []
        self.lost = 0

    @property
    def following(self) -> int | None:
        """The number that follows the last one, None before the first."""
        return self._expected[0] if self._expected else None

    def skip(self, count: int) -> None:
        """Take the numbers of so many messages that followed the last one, none missing."""
        self._expected[0] += count

    def add(self, number: int) -> None:
        """Take the number of the message that came next."""
        expected = self._expected
        # Nearly always there is one sender and nothing is missing.
        if expected and number == expected[0]:
            expected[0] += 1
            return
        before = [each for each in expected if each <= number]
        if before:
            nearest = max(before)
            expected.remove(nearest)
            self.lost += number - nearest
        expected.insert(0, number + 1)
        del expected[_MOST_SENDERS:]
