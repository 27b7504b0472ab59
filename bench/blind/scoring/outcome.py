"""One diagnosis against the truth of its recording."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from bench.blind.scoring.floor import Floors
from bench.blind.scoring.operating_region import region_right
from cspm_sim.effects import Channel, catalogue

NOTHING, PARAMETER, EFFECT, OUTSIDE = "nothing", "parameter", "effect", "outside"
KINDS = (NOTHING, PARAMETER, EFFECT, OUTSIDE)
UNKNOWN = "unknown"
FAILED = "failed"
_STAGES = ("nrmse_before", "nrmse_retuned_nominal", "nrmse_after")
# Numbers that an absorbed effect has made wrong, by the truth's name, as effects of the catalogue.
ABSORBING = {
    "damper": "cable_axial_damping",
    "stiffness": "cable_stiffness",
    "radius": "winch_drum_radius",
}

Data = Mapping[str, Any]


@dataclass(frozen=True)
class Estimate:
    """A parameter that was found, against what it is.

    Attributes:
        effect: whose parameter it is.
        error: relative to what the value differs by from a machine without it.
        covered: whether its 95 % interval holds the truth; None without an interval, or with one
            that is all that the catalogue allows, as where there are too few data for any.
    """

    effect: str
    error: float
    covered: bool | None


@dataclass(frozen=True)
class Beginning:
    """When something that was named began.

    Attributes:
        true: [s]; 0: it was there from the start.
        reported: [s]; None: as of something that acts all the time.
        held: whether the reported 95 % interval holds the truth; None without one.
    """

    true: float
    reported: float | None
    held: bool | None


@dataclass(frozen=True)
class Outcome:
    """How one diagnosis did.

    Attributes:
        name: the recording's.
        stratum: its way of concealing.
        kind: one of `KINDS`.
        multiple: of the detection limit; 0 where nothing is concealed.
        truth: what is concealed, effect and elements; the phenomenon's name where there is no id.
        verdict: in one word; `FAILED` where there is none.
        found: the findings' effects and elements, the first first.
        detected: whether anything was found.
        block: whether a finding is in a block of the truth.
        block_tied: whether that finding, or what is tied with it, is.
        element: whether a finding is on just the elements of a truth.
        first: whether the first finding names something concealed on its elements.
        named: whether all concealed effects are named, not as alternatives, each on its elements.
        effect_only: whether they are, on whatever elements.
        tied: whether each is in some finding's tie set, by effect.
        tie_sizes: of the sets that hold a truth.
        wrong: number of findings whose tie set holds no truth.
        unknown: whether something unknown was reported.
        driver: whether what the catalogue lacks was reported as a function of the right signal, on
            its elements; None where none is right, or nothing unknown was reported.
        beginnings: of what was named.
        regions: of what was named, unknown or not, whether all that was reported of where in the
            machine's range it acts is right; None: nothing was reported of that.
        estimates: of the parameters named.
        probabilities: of the findings named, with whether they are right.
        fit: held-out errors in units of the noise floor: before, re-tuned, after, of the concealed
            elements' residual that was worst before; None without residuals that have a floor.
        seconds: processor time.
    """

    name: str
    stratum: str
    kind: str
    multiple: float
    truth: tuple[tuple[str, tuple[str, ...]], ...]
    verdict: str
    found: tuple[tuple[str, tuple[str, ...]], ...]
    detected: bool
    block: bool
    block_tied: bool
    element: bool
    first: bool
    named: bool
    effect_only: bool
    tied: bool
    tie_sizes: tuple[int, ...]
    wrong: int
    unknown: bool
    driver: bool | None
    beginnings: tuple[Beginning, ...]
    regions: tuple[bool | None, ...]
    estimates: tuple[Estimate, ...]
    probabilities: tuple[tuple[float, bool], ...]
    fit: tuple[float, float, float] | None
    seconds: float


def judge(item: Data, result: Data, floors: Floors) -> Outcome:
    """Return how a diagnosis did.

    Args:
        item: of the truth file.
        result: `diagnosis`, as `diagnosis.json` has it or None, and `times`.
        floors: of the residuals, see `healthy_floors`.
    """
    diagnosis: Data = result["diagnosis"] or {"verdict": FAILED, "findings": [], "residuals": []}
    findings: Sequence[Data] = diagnosis["findings"]
    concealed: Sequence[Data] = item["concealed"]
    kind = kind_of(item)
    right = {each["effect"] or UNKNOWN for each in concealed}
    if item["absorbed_by"]:
        right.add(ABSORBING[item["absorbed_by"]])
    holding = [f for f in findings if right & set(tie_set(f))]
    return Outcome(
        name=item["name"],
        stratum=item["stratum"],
        kind=kind,
        multiple=max((each["multiple"] for each in concealed), default=0.0),
        truth=tuple((c["effect"] or c["phenomenon"], tuple(c["elements"])) for c in concealed),
        verdict=diagnosis["verdict"],
        found=tuple((f["effect"], tuple(f["elements"])) for f in findings),
        detected=bool(findings),
        block=any(f["subsystem"] in {c["block"] for c in concealed} for f in findings[:1]),
        block_tied=any(_blocks(f) & {c["block"] for c in concealed} for f in findings[:1]),
        element=any(_same_elements(f, c) for f in findings[:1] for c in concealed),
        first=any(_is_named(c, findings[:1]) for c in concealed),
        named=bool(concealed) and all(_is_named(c, findings) for c in concealed),
        effect_only=bool(concealed)
        and all(any(f["effect"] == (c["effect"] or UNKNOWN) for f in findings) for c in concealed),
        tied=bool(concealed)
        and all(any((c["effect"] or UNKNOWN) in tie_set(f) for f in findings) for c in concealed),
        tie_sizes=tuple(len(tie_set(f)) for f in holding),
        wrong=len(findings) - len(holding),
        unknown=any(f["effect"] == UNKNOWN for f in findings),
        driver=_driver(concealed, findings),
        beginnings=tuple(b for c in concealed for b in _beginnings(item, c, findings)),
        regions=tuple(
            region_right(c["phenomenon"], _onset(item), f)
            for c in concealed
            for f in findings
            if _names(f, c)
        ),
        estimates=tuple(e for c in concealed for e in _estimates(c, findings)),
        probabilities=tuple(
            (f["probability"], f["effect"] in right)
            for f in findings
            if f["probability"] is not None
        ),
        fit=_fit(diagnosis["residuals"], item, floors),
        seconds=float(result["times"]["cpu_s"]),
    )


def kind_of(item: Data) -> str:
    """Return what a recording conceals at most: nothing, a parameter, an effect, one outside."""
    kinds = {each["kind"] for each in item["concealed"]}
    if UNKNOWN in kinds:
        return OUTSIDE
    if EFFECT in kinds:
        return EFFECT
    return PARAMETER if kinds else NOTHING


def tie_set(finding: Data) -> list[str]:
    """Return the effects of a finding, named and alternative, each once."""
    return list(dict.fromkeys([finding["effect"], *(a["effect"] for a in finding["alternatives"])]))


def _blocks(finding: Data) -> set[str]:
    """Return the blocks of a finding and of its alternatives."""
    known = catalogue()
    tied = {known[a["effect"]].block.value for a in finding["alternatives"] if a["effect"] in known}
    return {finding["subsystem"], *tied}


def _same_elements(finding: Data, concealed: Data) -> bool:
    return set(finding["elements"]) == set(concealed["elements"])


def _is_named(concealed: Data, findings: Sequence[Data]) -> bool:
    return any(_names(f, concealed) for f in findings)


def _names(finding: Data, concealed: Data) -> bool:
    named = finding["effect"] == (concealed["effect"] or UNKNOWN)
    return named and _same_elements(finding, concealed)


def _driver(concealed: Sequence[Data], findings: Sequence[Data]) -> bool | None:
    unknown = [f for f in findings if f["effect"] == UNKNOWN]
    drivers = [(c["driver"], c) for c in concealed if c.get("driver")]
    if not unknown or not drivers:
        return None
    return any(
        str(f["region"].get("driver", "")).startswith(driver) and _same_elements(f, c)
        for f in unknown
        for driver, c in drivers
    )


def _beginnings(item: Data, concealed: Data, findings: Sequence[Data]) -> list[Beginning]:
    """Return when a concealed effect was reported to begin, where it was named."""
    true, found = _onset(item), []
    for finding in findings:
        if concealed["effect"] and _names(finding, concealed):
            reported, interval = finding.get("onset_s"), finding.get("onset_ci95_s")
            held = None if interval is None else interval[0] <= true <= interval[1]
            found.append(Beginning(true, reported, held))
    return found


def _onset(item: Data) -> float:
    return float(item.get("onset_s", 0.0))


def _estimates(concealed: Data, findings: Sequence[Data]) -> list[Estimate]:
    """Return estimates of the concealed parameter on the elements where it was found."""
    name, amounts = concealed["parameter"], concealed["values"]
    base = concealed["base"]
    found = []
    for finding in findings:
        if name is None or finding["effect"] != concealed["effect"]:
            continue
        for parameter in finding["parameters"]:
            element = parameter["element"]
            if parameter["name"] != name or element not in amounts:
                continue
            true, interval = amounts[element], parameter["ci95"]
            error = (parameter["value"] - true) / (true - base)
            covered = None if interval is None else interval[0] <= true <= interval[1]
            found.append(Estimate(finding["effect"], error, covered))
    return found


def _fit(
    residuals: Sequence[Data], item: Data, floors: Floors
) -> tuple[float, float, float] | None:
    """Return the held-out errors of the residual that was worst before of those that show it.

    Others are not what is to be mended.
    """
    shown = [place for each in item["concealed"] for place in _shown_in(each)]
    own = [r for r in residuals if any(_is_of(r["channel"], *place) for place in shown)]
    found = []
    for residual in own or residuals:
        stages, floor = residual["held_out"], floors.get((item["scenario"], residual["channel"]))
        if floor is not None and stages["noise_floor"] > 0.0:
            unit = stages["noise_floor"] * floor
            before, retuned, after = (float(stages[key] / unit) for key in _STAGES)
            found.append((before, retuned, after))
    return max(found, default=None)


# How residuals begin in which effects show, where it is one; a sensor's fault shows in several.
_RESIDUALS = {Channel.SHAFT: "winches/torque/", Channel.TENSION: "cables/tension/"}


def _shown_in(concealed: Data) -> list[tuple[str, str]]:
    """Return the residuals that show something: how they begin, and whose they are."""
    effect = catalogue().get(concealed["effect"] or "")
    channel = None if effect is None else effect.signature.regression.channel
    if channel is Channel.WRENCH:
        return [("bar/", "bar")]
    elements = {"bar" if element == "winch_frame" else element for element in concealed["elements"]}
    begins = _RESIDUALS.get(channel, "") if channel is not None else ""
    return [(begins, element) for element in elements]


def _is_of(channel: str, begins: str, element: str) -> bool:
    return channel.startswith(begins) and element in channel.split("/")
