"""What the engineer guesses before the diagnosis answers."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from numpy.random import Generator

from cspm.demo.concealment import BAR, CONCEALABLE, Concealed
from cspm.testbed import Testbed

CHOICES = 5


def choices(
    testbed: Testbed,
    truth: Concealed,
    random: Generator,
    names: Sequence[str] = tuple(CONCEALABLE),
) -> list[Concealed]:
    """Return what may be guessed, in chance order: the truth, its effect elsewhere, others.

    Args:
        testbed: whose parts are offered.
        truth: what is concealed.
        random: where chance comes from.
        names: effects that are offered besides.
    """
    found = [truth]
    elsewhere = [name for name in testbed.cables if name != truth.element]
    if truth.element != BAR and elsewhere:
        found.append(Concealed(truth.effect, str(random.choice(elsewhere)), {}))
    for name in random.permutation([name for name in names if name != truth.effect]):
        element = BAR if name.startswith(BAR) else str(random.choice(testbed.cables))
        found.append(Concealed(str(name), element, {}))
    found = found[:CHOICES]
    return [found[i] for i in random.permutation(len(found))]


def guessed(
    offered: Sequence[Concealed], ask: Callable[[str], str], tell: Callable[[str], None]
) -> Concealed | None:
    """Return what was chosen; None where nothing was."""
    for number, each in enumerate(offered, start=1):
        tell(f"  {number}  {each.words}")
    while True:
        answer = ask(f"Your guess, 1 to {len(offered)}, or Enter for none: ").strip()
        if not answer:
            return None
        if answer.isdecimal() and 1 <= int(answer) <= len(offered):
            return offered[int(answer) - 1]
        tell(f"{answer}: no such number")
