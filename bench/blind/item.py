"""What one recording conceals, and how it is made: the truth of the benchmark."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from bench.blind.reality.phenomena import PHENOMENA
from bench.blind.reality.phenomenon import BAR, CABLES, CAPTURE, FRAME
from bench.blind.stratum import Case, Stratum
from cspm_msgs_py.errors import InputError
from cspm_msgs_py.testbed import Testbed

NAME_DIGITS = 8


class Concealed(NamedTuple):
    """One phenomenon of a recording.

    Attributes:
        phenomenon: its name.
        multiple: of its detection limit, the sign included.
        cables: indices of those that it is on; none where it is per bar.
    """

    phenomenon: str
    multiple: float
    cables: tuple[int, ...]


class Item(NamedTuple):
    """One recording to be made.

    Attributes:
        name: of its folder; says nothing.
        stratum: its stratum's name.
        case: which of the stratum's.
        scenario: its name.
        seed: of waves, sensors and whatever else is drawn during the run.
        concealed: what is in it.
        onset: when that begins [s].
        note: what the operator's note names as the cause; drawn without regard to the truth.
    """

    name: str
    stratum: str
    case: Case
    scenario: str
    seed: int
    concealed: tuple[Concealed, ...]
    onset: float
    note: str


def draw_items(
    strata: Sequence[Stratum],
    count: int,
    seed: int,
    duration: float,
    machine_of: Callable[[str], Testbed],
) -> list[Item]:
    """Draw recordings, in the order of their names, which is none.

    Strata get numbers in proportion to their shares, cases of a stratum and amounts of a case equal
    ones as far as that goes; the rest is drawn. `machine_of` returns the machine of a scenario.
    """
    generator = np.random.default_rng([seed, 7])
    names = _names(generator, count)
    effects = sorted({p.effect for p in PHENOMENA.values() if p.effect})
    items = []
    decks = {stratum.name: _deck(stratum, generator) for stratum in strata}
    for name, stratum in zip(names, _dealt(strata, count), strict=True):
        case, multiple = next(decks[stratum.name])
        scenario = str(generator.choice(case.scenarios))
        machine = machine_of(scenario)
        cable = int(generator.integers(len(machine.cables)))
        signs = generator.choice((-1.0, 1.0), len(case.phenomena))
        concealed = tuple(
            _conceal(each, multiple, sign, cable, case, machine)
            for each, sign in zip(case.phenomena, signs, strict=True)
        )
        items.append(
            Item(
                name,
                stratum.name,
                case,
                scenario,
                int(generator.integers(1, 2**31)),
                concealed,
                round(case.onset_share * duration, 3),
                str(generator.choice(effects)),
            )
        )
    return sorted(items)


def _deck(stratum: Stratum, generator: np.random.Generator) -> Iterator[tuple[Case, float]]:
    """Yield cases, each once before any comes again, and of each its amounts in the same way."""
    amounts = [_shuffled(case.multiples, generator) for case in stratum.cases]
    for k in _shuffled(range(len(stratum.cases)), generator):
        yield stratum.cases[int(k)], float(next(amounts[int(k)]))


def _shuffled(values: Sequence[float], generator: np.random.Generator) -> Iterator[float]:
    while True:
        yield from generator.permutation(np.asarray(values)).tolist()


def _conceal(
    name: str, multiple: float, sign: float, cable: int, case: Case, machine: Testbed
) -> Concealed:
    phenomenon = PHENOMENA[name]
    signed = multiple * sign if phenomenon.signed else multiple
    if phenomenon.at != CABLES:
        return Concealed(name, signed, ())
    everywhere = tuple(range(len(machine.cables)))
    return Concealed(name, signed, everywhere if case.everywhere else (cable,))


def _names(generator: np.random.Generator, count: int) -> list[str]:
    found: set[str] = set()
    while len(found) < count:
        found.add("".join(generator.choice(list("0123456789abcdef"), NAME_DIGITS)))
    return [str(name) for name in generator.permutation(sorted(found))]


def _dealt(strata: Sequence[Stratum], count: int) -> list[Stratum]:
    """Return each item's stratum, always the one that is furthest behind its share."""
    given = dict.fromkeys(strata, 0)
    out = []
    for _ in range(count):
        behind = min(strata, key=lambda stratum: (given[stratum] + 0.5) / stratum.share)
        given[behind] += 1
        out.append(behind)
    return out


def truth_of(
    item: Item, amounts: Mapping[str, Sequence[float]], machine: Testbed
) -> dict[str, Any]:
    """Return what the truth file says of a recording; `amounts` as `amounts_of` gives them."""
    return {
        "name": item.name,
        "stratum": item.stratum,
        "scenario": item.scenario,
        "seed": item.seed,
        "onset_s": item.onset,
        "without": list(item.case.without),
        "absorbed_by": item.case.absorbed_by,
        "note": item.note,
        "concealed": [
            _revealed(each, amounts[each.phenomenon], machine) for each in item.concealed
        ],
    }


def _revealed(each: Concealed, amounts: Sequence[float], machine: Testbed) -> dict[str, Any]:
    phenomenon = PHENOMENA[each.phenomenon]
    elements = {
        CABLES: [machine.cable_names[i] for i in each.cables],
        BAR: ["bar"],
        FRAME: ["winch_frame"],
        CAPTURE: ["bar", "winch_frame"],
    }[phenomenon.at]
    used = [amounts[i] for i in each.cables] or [amounts[0]] * len(elements)
    return {
        "phenomenon": each.phenomenon,
        "kind": phenomenon.kind,
        "effect": phenomenon.effect,
        "block": phenomenon.block,
        "elements": elements,
        "multiple": abs(each.multiple),
        "parameter": phenomenon.parameter,
        "driver": phenomenon.driver,
        "base": phenomenon.base,
        "values": {
            element: phenomenon.base + float(amount)
            for element, amount in zip(elements, used, strict=True)
        },
    }


def amounts_of(
    item: Item, limits: Mapping[str, Sequence[float]], cables: int
) -> dict[str, list[float]]:
    """Return each phenomenon's amounts per cable, or the one for bar or frame.

    Raises:
        InputError: something does not show in so short a recording.
    """
    out = {}
    for each in item.concealed:
        limit = limits[each.phenomenon]
        if not all(np.isfinite(limit[i]) for i in each.cables or (0,)):
            raise InputError(
                f"--duration: {each.phenomenon} does not show in {item.scenario}, allowed: a longer"
                " one, or other --strata"
            )
        if PHENOMENA[each.phenomenon].at != CABLES:
            out[each.phenomenon] = [each.multiple * limit[0]]
            continue
        out[each.phenomenon] = [
            each.multiple * limit[i] if i in each.cables else 0.0 for i in range(cables)
        ]
    return out
