"""What methods named of what was concealed: the judgement of the blind benchmark, by case."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

from bench.blind.scoring.floor import Floors, healthy_floors
from bench.blind.scoring.outcome import FAILED, OUTSIDE, UNKNOWN, Outcome, judge, tie_set
from bench.blind.scoring.scorecard import NEAR_FLOOR
from bench.blind.scoring.share import Share, share
from bench.concealed.case import AS_IT_IS, DELETION, SPIKE
from cspm_ident.diagnosis.reporting.verdict import named_in
from cspm_msgs_py.errors import InputError
from cspm_sim.effects import catalogue

Data = Mapping[str, Any]

SCHEMA = "cspm.concealed-results/1"


class Group(NamedTuple):
    """Shares of a group of cases.

    Attributes:
        label: which cases.
        size: of spikes; 0 otherwise.
        first: the concealed effect is named first, on its element.
        tied: it is among the ties of some finding.
        false: something is named that is neither concealed nor known to be true there.
        abstained: nothing is named, and the verdict says that something is unknown or undecided.
        held: of intervals of the amount, those that hold it.
        near: held-out error within 1.5 × that of the file with all true terms.
    """

    label: str
    size: float
    first: Share
    tied: Share
    false: Share
    abstained: Share
    held: Share
    near: Share


def judged(
    items: Sequence[Data], results: Mapping[str, Data], known: Mapping[str, set[str]]
) -> list[Outcome]:
    """Return how each case did that has a result.

    Args:
        items: of cases, see `item_of`.
        results: by case, see `bench.blind.scoring.outcome.judge`.
        known: by machine, effects that may be named besides.
    """
    those = [item for item in items if item["name"] in results]
    floors: Floors = healthy_floors({"items": those}, results)
    return [judge(i, _relevant(i, results[i["name"]], known[i["scenario"]]), floors) for i in those]


def _relevant(item: Data, result: Data, known: set[str]) -> Data:
    """Return a result without what is named rightly beside what is concealed.

    That something is unknown is no statement of what it is, unless the catalogue lacks it.
    """
    diagnosis = result["diagnosis"]
    if diagnosis is None:
        return result
    wanted = {each["effect"] or UNKNOWN for each in item["concealed"]}
    named = diagnosis["findings"] if UNKNOWN in wanted else named_in(diagnosis)
    kept = [f for f in named if wanted & set(tie_set(f)) or not known & set(tie_set(f))]
    # Of when and where nothing is concealed here.
    plain = [{**f, "region": {}, "onset_s": None} for f in kept]
    return {**result, "diagnosis": {**diagnosis, "findings": plain}}


def groups(outcomes: Sequence[Outcome]) -> list[Group]:
    """Return the shares: as it is, deletions, and spikes by size."""
    found = [_group(AS_IT_IS, 0.0, [o for o in outcomes if o.stratum == AS_IT_IS])]
    found.append(_group(DELETION, 0.0, [o for o in outcomes if o.stratum == DELETION]))
    spikes = [o for o in outcomes if o.stratum == SPIKE]
    for size in sorted({o.multiple for o in spikes}):
        found.append(_group(SPIKE, size, [o for o in spikes if o.multiple == size]))
    return [each for each in found if each.false.cases]


def _group(label: str, size: float, outcomes: Sequence[Outcome]) -> Group:
    # Of what the catalogue lacks no name is wanted.
    concealed = [o for o in outcomes if o.truth and o.kind != OUTSIDE]
    estimates = [e for o in outcomes for e in o.estimates if e.covered is not None]

    def count(holds: Callable[[Outcome], bool], those: Sequence[Outcome] = outcomes) -> Share:
        return share(holds(o) for o in those)

    return Group(
        label,
        size,
        count(lambda o: o.first, concealed),
        count(lambda o: o.tied, concealed),
        count(lambda o: o.wrong > 0),
        count(is_abstained),
        share(bool(e.covered) for e in estimates),
        share(o.fit[2] <= NEAR_FLOOR for o in concealed if o.fit is not None),
    )


def is_abstained(outcome: Outcome) -> bool:
    """Return whether nothing is named, and that is said to be no answer."""
    named = [effect for effect, _ in outcome.found if effect != UNKNOWN]
    return not named and outcome.verdict in (UNKNOWN, "not_excited", FAILED)


def read_own(path: Path, names: Sequence[str]) -> tuple[str, dict[str, Data]]:
    """Return a method's name and results of a file that anybody may have written.

    It has `method`, and `results` by case: what `diagnosis.json` has, of which `verdict` and
    `findings` are needed, and of a finding `effect` and `elements`.

    Raises:
        InputError: not such a file, or of cases that there are not.
    """
    allowed = "allowed: a file with `method`, and `results` by case"
    try:
        content = json.loads(path.read_text(encoding="utf-8"))
        method, given = str(content["method"]), dict(content["results"])
        results = {name: _completed(each) for name, each in given.items()}
    except (OSError, ValueError, KeyError, TypeError, AttributeError) as err:
        raise InputError(f"{path}: not readable ({err}), {allowed}") from None
    strange = sorted(set(results) - set(names))
    if strange:
        raise InputError(f"{path}: no case {strange[0]}, allowed: those of the data that are there")
    return method, results


def _completed(diagnosis: Data) -> Data:
    findings = [
        {
            "subsystem": _block(each["effect"]),
            "probability": None,
            "parameters": [],
            "alternatives": [],
            **each,
            "elements": list(each["elements"]),
        }
        for each in diagnosis["findings"]
    ]
    rest = {"verdict": str(diagnosis["verdict"]), "residuals": diagnosis.get("residuals", [])}
    seconds = float(diagnosis.get("cpu_s", 0.0))
    return {"diagnosis": {**rest, "findings": findings}, "times": {"cpu_s": seconds}}


def _block(effect: str) -> str:
    known = catalogue()
    return known[effect].block.value if effect in known else UNKNOWN
