"""What each block of results/steep-sea.md takes to be measured, and how it is written."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import NamedTuple

from bench.accuracy.tension_distribution import distribution_rows
from bench.results.result_cases import (
    AT_FOUR_METRES,
    BEYOND,
    CAUSES,
    CORNERS,
    DESIGNED_THERE,
    LIMITED,
    PAST,
    POSSIBLE,
    POSSIBLE_LOWER,
    POSSIBLE_SIX,
    PROFILES,
    ROUGH_CORNERS,
    SIX,
    SWITCHED,
    SWITCHED_4M,
    SWITCHED_CALM,
    SWITCHED_GAINS,
    THESIS,
    calm,
    seeded,
)
from bench.results.result_machines import conditions_block, fastest_block
from bench.results.result_measures import (
    bands,
    limit,
    moved_on,
    past_thesis,
    possible,
    possible_share,
    tracking,
)
from bench.results.result_ratios import (
    ROUGHEST_PLAN,
    ROUGHEST_SEED,
    beam_ratios,
    deep_ratios,
    first_limit,
    six_figures,
)
from bench.results.result_robust_cases import (
    ADAPTED,
    INFORMED,
    MASSES,
    PAYLOADS,
    changed,
    corrected,
)
from bench.results.result_store import Measurement
from bench.results.result_tables import (
    Found,
    calm_block,
    distribution_block,
    errors_block,
    extremes_block,
    limit_block,
    past_block,
    past_six_block,
    shares_block,
    thesis_block,
    tracking_block,
)
from bench.results.result_winch_cases import AHEAD, FRICTION, with_and_without, wound
from bench.results.tracking import Case

Cases = Mapping[str, Case]
LATE_S = 0.005


class Block(NamedTuple):
    """A block of the page, or its pictures.

    Attributes:
        measurements: by the name that the block's text has for each.
        write: from what was found, by the same names, to the block's text.
    """

    measurements: Mapping[str, Measurement]
    write: Callable[[Found], str]


def blocks_of(seeds: int) -> dict[str, Block]:
    """Return all blocks but that of the machine, by name."""
    return {
        "thesis": _tracked("thesis", THESIS, thesis_block),
        "switched": _tracked("switched", SWITCHED),
        "fastest": Block({}, fastest_block),
        "switched_gains": _tracked("switched gains", SWITCHED_GAINS),
        "switched_calm": _tracked("switched calm", SWITCHED_CALM, _and(beam_ratios)),
        "switched_4m": _tracked("switched 4 m", SWITCHED_4M),
        "distribution": _distribution(),
        "causes": _tracked("causes", CAUSES),
        "beyond": _tracked("beyond", BEYOND),
        "at_four_metres": _tracked("beyond", AT_FOUR_METRES),
        "planned": _planned(),
        "corners": _tracked("corners", CORNERS),
        "rough_corners": _tracked("rough corners", ROUGH_CORNERS, extremes_block),
        "designed_there": _tracked("designed there", DESIGNED_THERE, extremes_block),
        "friction": _tracked("friction", with_and_without(FRICTION, AHEAD, "fed forward")),
        "winch": _tracked("winch", wound()),
        "limit": Block({name: _limit(name, case) for name, case in LIMITED.items()}, limit_block),
        "possible": _possible(),
        "possible_six": _possible_six(),
        "kept": _kept_in_six(seeds),
        "changes": Block({"worst case": _limit("worst case", LIMITED["worst case"])}, first_limit),
        "robust": _tracked("robust", changed(PAST)),
        "moved_on": _moved_on(),
        "informed": _tracked("informed", INFORMED),
        "corrected": _tracked("corrected", corrected()),
        "adapted": _tracked(
            "adapted", with_and_without(MASSES, ADAPTED, "estimated from its heave")
        ),
        "payload": _tracked(
            "payload",
            with_and_without(PAYLOADS, ADAPTED, "estimated from its heave"),
        ),
        "robust_thesis": _tracked("robust thesis", changed("worst_case_steep")),
        "past": _past("1000 Hz", seeds),
        "past_100": _past("100 Hz", seeds),
        "conditions": Block({}, conditions_block),
        "past_six": _past_six(seeds),
        "past_calm": _tracked("past calm", calm(seeds), calm_block),
    }


def pictured() -> dict[str, Measurement]:
    """Return what the pictures show, by title, and under `limit` the worst case's."""
    return {
        "the thesis's controllers": Measurement("bands thesis", bands, (Case("worst_case_steep"),)),
        "past the thesis": Measurement("bands past", bands, (Case(PAST),)),
        "limit": _limit("worst case", LIMITED["worst case"]),
    }


def _tracked(group: str, cases: Cases, write: Callable[[Found], str] = tracking_block) -> Block:
    return Block(
        {name: Measurement(f"{group} {name}", tracking, (case,)) for name, case in cases.items()},
        write,
    )


def _and(more: Callable[[Found], str]) -> Callable[[Found], str]:
    """Return what writes a row per run, and below them a table that follows from them."""
    return lambda found: f"{tracking_block(found)}\n\n{more(found)}"


def _distribution() -> Block:
    name = "distribution"
    measurement = Measurement(name, distribution_rows, (20000, 60.0), alone=True)
    return Block({name: measurement}, lambda found: distribution_block(found[name]))


def _limit(name: str, case: Case) -> Measurement:
    return Measurement(f"limit {name}", limit, (case,))


def _possible() -> Block:
    wanted = {name: Measurement(f"possible {name}", possible, of) for name, of in POSSIBLE.items()}
    return Block(wanted, errors_block)


def _planned() -> Block:
    return Block(
        {**_tracked("beyond", AT_FOUR_METRES).measurements, **_possible().measurements}, deep_ratios
    )


def _kept_in_six(seeds: int) -> Block:
    least = {ROUGHEST_PLAN: _possible().measurements[ROUGHEST_PLAN]}
    enough = max(seeds, int(ROUGHEST_SEED.split()[1]))
    return Block({**_past_six(enough).measurements, **least}, six_figures)


def _possible_six() -> Block:
    measurements = {}
    for name, case in POSSIBLE_SIX.items():
        before = _limit(f"six {name}", case)
        for lower in POSSIBLE_LOWER:
            said = f"{name}, tensions from {lower:g} N on"
            measurements[said] = Measurement(
                f"possible six {said}", possible_share, (case, lower), needs=(before,)
            )
    return Block(measurements, shares_block)


def _moved_on() -> Block:
    case = changed(PAST)["nothing"]
    name = "what the reference moves on by in 5 ms"
    return Block({name: Measurement(name, moved_on, (case, LATE_S))}, errors_block)


def _past(profile: str, seeds: int) -> Block:
    measurements = {}
    for name, case in seeded(seeds, PROFILES[profile]).items():
        # The limit is the reference's, whatever the rates.
        before = _limit(name, seeded(seeds, ())[name])
        measurements[name] = Measurement(
            f"past {profile} {name}", past_thesis, (case,), needs=(before,)
        )
    return Block(measurements, past_block)


def _past_six(seeds: int) -> Block:
    measurements = {}
    for name, case in seeded(seeds, (), SIX).items():
        before = _limit(f"six {name}", case)
        measurements[name] = Measurement(f"past six {name}", past_thesis, (case,), needs=(before,))
    return Block(measurements, past_six_block)
