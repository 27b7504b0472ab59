"""Sentences of results/steep-sea.md with what was measured in them."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bench.results.result_cases import ROUGHEST
from bench.results.result_measures import LIMIT_PERIOD
from bench.results.result_tables import THESIS_TABLES, Found

Array = NDArray[np.float64]

SURGE, SWAY, HEAVE, ROLL, PITCH, YAW = range(6)
# Runs at 4 m, and the least errors that what they plan with allows.
DEEP_PLANS = {
    "worst case, 4 m, the whole 200 s": "worst case, 4 m, tensions from 0.6 N on",
    "worst case, 4 m, 200 s, tensions wanted from 0.3 N, planned from 0.5 N": (
        "worst case, 4 m, tensions from 0.5 N on"
    ),
    "worst case, 4 m, 200 s, tensions wanted from 0.3 N, planned from 0.8 N": (
        "worst case, 4 m, tensions from 0.8 N on"
    ),
}
ROUGHEST_PLAN = f"{ROUGHEST}, tensions from 0.7 N on"
ROUGHEST_SEED = "seed 9"
# Of the worst case with all six coordinates.
DURATION_MS = 200_000.0
STEPS_OF_SWAY = (
    "fastest loops, and no wave shorter than 4 s",
    "no wave shorter than 4 s, sway with 1.75 times that gain",
)


def _rms(found: Mapping[str, Any]) -> Array:
    """Return a run's RMS errors, (6,) [mm, mrad]."""
    return 1e3 * np.array(found["rms"])


def causes_said(found: Found) -> str:
    """Return what sensors and force controllers add to the errors without the governor."""
    plain = _rms(found["without the governor"])[:3]
    kinder = [
        _rms(each)[:3]
        for name, each in found.items()
        if name == "ideal sensors" or name.startswith("force controllers")
    ]
    most = max(float(np.max(plain - each)) for each in kinder)
    half = _rms(found["half the waves"])[:3]
    return (
        f"Neither ideal sensors nor faster force controllers take more than {most:.2f} mm off an"
        " RMS error; with half the waves, where tensions always exist, the errors are"
        f" {half.min():.2f} to {half.max():.2f} mm with both as they are."
    )


def beam_said(found: Found) -> str:
    """Return how far the thesis's calm sea is explained by a sea from abeam."""
    largest, thesis = THESIS_TABLES["calm"]
    fastest, stiffest = (_rms(found[name]) for name in STEPS_OF_SWAY)
    sway, heave = thesis[SWAY], thesis[HEAVE]
    return (
        f"That explains the thesis's pitch and yaw errors, of {1e6 * thesis[PITCH]:.0f} and"
        f" {1e6 * thesis[YAW]:.0f} µrad: their references hardly move. It does not explain its"
        f" surge error of {thesis[SURGE]:.2f} mm RMS. With the longest waves alone, and the gains"
        f" that its margins allow, heave is {fastest[HEAVE] / heave:.1f} times and sway"
        f" {fastest[SWAY] / sway:.0f} times as large as the thesis's. The stiff sway loop of the"
        f" worst case's last line makes them {stiffest[HEAVE] / heave:.1f} and"
        f" {stiffest[SWAY] / sway:.1f} times as large, sway below heave as in the thesis"
        f" ({sway:.3g} and {heave:.3g} mm). Why its margins allowed that is lost with its tables;"
        " here the roll pendulum limits sway.\n\n"
        f"Its roll of {1e3 * thesis[ROLL]:.0f} mrad does not follow such waves, which make"
        f" {stiffest[ROLL]:.1f}. It may be a free oscillation from the start: a roll that begins"
        f" with {1e3 * (largest[ROLL] or 0.0):.0f} mrad and is not damped leaves sway as it is"
        " ([decisions](../docs/decisions/README.md))."
    )


def deep_said(found: Found) -> str:
    """Return how near runs at 4 m come to the least errors that their plans allow."""
    ratios = [
        _rms(found[run])[: SWAY + 1] / (1e3 * np.array(found[plan])[: SWAY + 1])
        for run, plan in DEEP_PLANS.items()
    ]
    return (
        "What is above the least that tensions ≥ 0 allow ([below](#what-stops-it)) is the reserve,"
        " and nothing else: in surge and sway the closed loop has"
        f" {np.min(ratios):.2f} to {np.max(ratios):.2f} times the least error that its planned"
        " tensions allow. Wanting more of the tensions and planning less keeps cables taut at a"
        " smaller price than a reserve in the plan alone."
    )


def six_said(found: Found) -> str:
    """Return what the largest error with all six coordinates is beside the least, and slack."""
    rough, least = _rms(found[ROUGHEST_SEED])[SURGE], 1e3 * found[ROUGHEST_PLAN][SURGE]
    seeds = {name: each for name, each in found.items() if name.startswith("seed ")}
    beyond = sum(bool((_rms(each)[:3] > 2.0).any()) for each in seeds.values())
    slack = [DURATION_MS * each["slack"] for each in seeds.values() if each["slack"] > 0.0]
    return (
        "So what stops it is what its plans keep in each cable, for what is wanted at least and for"
        " what the control adds: with no tension kept the requirement could be met, with it not in"
        f" the rougher seeds. {beyond} of {len(seeds)} seeds have an RMS error above 2 mm;"
        f" {ROUGHEST_SEED}'s in surge is {rough / least:.2f} times the least that its plan's"
        f" tensions allow. Less is not kept because cables then go slack; even so one is in"
        f" {len(slack)} seeds, for {max(slack, default=0.0):.0f} ms at most."
    )


def touched_said(found: Found) -> str:
    """Return when the limit of the worst case is met for the first time."""
    (least,) = found.values()
    first = LIMIT_PERIOD * int(np.argmax(np.array(least) < 0.3))
    return (
        "The machine is changed, the controllers' model is not; the first 20 s of the worst case,"
        f" in which tensions from 0.3 N on do not exist for the first time after {first:.0f} s. The"
        " machine of the rows with friction has 10 mN·m of dry and 0.1 mN·m·s of viscous friction"
        " at every motor, fed forward as its file has it; *+20 %* and *−20 %* are what it really"
        " has. Past the thesis:"
    )


def late_said(found: Found) -> str:
    """Return what poses that come late without being known to be late cost."""
    beyond = 1.0 - found["poses 5 ms late"]["within"]
    return (
        "Poses 5 ms late without a delay in the test-bed's file take the bar beyond the requirement"
        f" for {beyond:.0%} of the time. What is measured then follows its reference, and the bar"
        " is where the reference will be 5 ms later, by as much as this line says:"
    )


def corrected_said(found: Found) -> str:
    """Return what estimating the load cells' biases costs."""
    plain = _rms(found["nothing"])[HEAVE]
    all_off = _rms(found["all load cells +1 N, dry friction 2 mN·m at every motor"])[HEAVE]
    ended = sum(bool(each["failure"]) for each in found.values())
    return (
        f"Of {len(found)} runs {ended} end early. All load cells off at once cost"
        f" {all_off - plain:.2f} mm RMS in heave while it is being estimated."
    )


def winch_said(found: Found) -> str:
    """Return what feed-forward of the winches brings, and of stretch in it."""
    slow, soft = "force controllers at 200 rad/s", "200 rad/s, cables 4 times softer"
    stepped = "200 rad/s, 100 Hz"

    def heave(name: str) -> str:
        steps = (name, f"{name}, fed forward", f"{name}, and stretch")
        return ", ".join(f"{1e3 * _rms(found[each])[HEAVE]:.0f}" for each in steps)

    def least(name: str) -> str:
        steps = (f"{name}, fed forward", f"{name}, and stretch")
        return " to ".join(f"{found[each]['tensions'][0]:.2f}" for each in steps)

    slack = found[slow]["slack"], found[f"{slow}, fed forward"]["slack"]
    return (
        "It pays where force controllers are slow. RMS errors in heave without it, with it, and"
        f" with stretch in it, in µm: {heave(slow)} at 200 rad/s, {heave('worst case')} at 800;"
        f" cables are slack for {slack[0]:.2%} and {slack[1]:.2%} of the time at 200 rad/s. Stretch"
        f" is the smallest part of it: with cables 4 times softer {heave(soft)} at 200 rad/s,"
        f" {heave('cables 4 times softer')} at 800. Where motion control is at 100 Hz it does harm:"
        " wanted tensions come in steps, of which it makes jerks, and the least tension goes from"
        f" {least(stepped)} N at 200 rad/s and from {least('100 Hz')} N at 800."
    )


def payload_said(found: Found) -> str:
    """Return where estimating a load's mass pays."""
    fixed, swinging = "0.8 kg taken up at 50 s", "0.4 kg swinging 0.3 m below"

    def steps_of(name: str, dof: int) -> str:
        steps = (name, f"{name}, estimated from its heave")
        return " to ".join(f"{_rms(found[each])[dof]:.2f}" for each in steps)

    plain, adapted = (
        f"{found[name]['not_met']:.1%}"
        for name in (swinging, f"{swinging}, estimated from its heave")
    )
    return (
        f"A load that is fixed to the bar is estimated like a mass of its own: heave goes from"
        f" {steps_of(fixed, HEAVE)} mm RMS. One that swings is not a mass: with 0.4 kg heave goes"
        f" from {steps_of(swinging, HEAVE)} mm, surge from {steps_of(swinging, SURGE)} mm. Its"
        f" pull takes the tensions that the wanted wrench needs for {plain} of the time, {adapted}"
        " where a mass is"
        " estimated: of that neither the governor's plan nor the distribution knows."
    )
