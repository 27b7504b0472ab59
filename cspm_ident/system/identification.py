"""Output error of bar pose and tensions over windows of several recordings."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from cspm_ident.estimation import Profile, Solution, find_profile, fit
from cspm_ident.estimation.estimate import Interval
from cspm_ident.estimation.noise import unit_noise
from cspm_ident.estimation.objection import Objection, error_objections, sign_objections
from cspm_ident.estimation.problem import Problem
from cspm_ident.recording_roles import check_roles
from cspm_ident.signals.clock_drift import ClockDrift, on_one_clock
from cspm_ident.signals.measurement import Measurement
from cspm_ident.signals.timeline import Timeline
from cspm_ident.system.choice import Chosen
from cspm_ident.system.machine import machine_with
from cspm_ident.system.noise_scatter import (
    DRAWS,
    PAIRS,
    Bias,
    noise_bias,
    noise_changes,
    noise_scatter,
    widened,
    without_bias,
)
from cspm_ident.system.prediction_test import FITTED, Judgement, judge
from cspm_ident.system.search import search
from cspm_ident.system.shooting import Shooting, make_shooting
from cspm_msgs_py.errors import InputError
from cspm_msgs_py.testbed import Testbed

Array = NDArray[np.float64]
Progress = Callable[[str], None]

HORIZON = 4.0  # s
MOST_WINDOWS = 12
# Of a scale: below it rounding of the simulation shows in the differences.
_STEP = 1e-4


@dataclass(frozen=True, eq=False)
class SystemResult:
    """A machine identified from recordings.

    Attributes:
        chosen: what was fitted.
        solution: values, intervals, directions that were not excited.
        bias: what noise on the signals that drive the model does to the values; taken out.
        machine: the one that was found.
        horizon: of the windows [s].
        windows: how many of each recording were used.
        searched: recordings that were fitted, in order.
        judgements: how well both machines predict each recording, searched first, then held out.
        profiles: those requested.
        settled: whether parameters and initial states came to stand still.
        drifts: of motion capture's clocks, by recording, taken out.
    """

    chosen: tuple[Chosen, ...]
    solution: Solution
    bias: Bias
    machine: Testbed
    horizon: float
    windows: tuple[int, ...]
    searched: tuple[Measurement, ...]
    judgements: tuple[Judgement, ...]
    profiles: tuple[Profile, ...]
    settled: bool
    drifts: dict[str, list[ClockDrift]]

    @property
    def objections(self) -> tuple[Objection, ...]:
        """Why values are no result; none where all are."""
        estimate, given = self.solution.estimate, [each.parameter for each in self.chosen]
        errors = [
            (each.measurement.path.name, error)
            for each in self.judgements
            if not each.held_out and (error := each.error(FITTED)) is not None
        ]
        return (
            *sign_objections(
                estimate,
                {each.name for each in given if each.lower > 0.0},
                {each.name for each in given if each.lower == 0.0},
                "check the signs of poses, angles and tensions",
            ),
            *error_objections(estimate, errors, "bar's motion"),
        )

    def data(self) -> dict[str, Any]:
        """Return everything as plain data for JSON."""
        return {
            "recordings": [{"path": str(m.path), "sha256": m.sha256} for m in self.searched],
            "horizon_s": self.horizon,
            "windows": list(self.windows),
            "settled": self.settled,
            "clock_drifts": {
                name: [drift.data() for drift in found] for name, found in self.drifts.items()
            },
            "nominal": {each.name: each.nominal for each in self.chosen},
            "estimate": self.solution.estimate.data(),
            "bias_taken_out": {
                each.name: float(bias)
                for each, bias in zip(self.chosen, self.bias.values, strict=True)
            },
            "judgements": [each.data() for each in self.judgements],
            "profiles": [
                {
                    "name": p.name,
                    "ci95": [end if np.isfinite(end) else None for end in p.ci95],
                    "values": p.values.tolist(),
                    "deviance": p.deviance.tolist(),
                    "threshold": p.threshold,
                }
                for p in self.profiles
            ],
        }


def identify_system(
    searched: Sequence[Measurement],
    chosen: Sequence[Chosen],
    *,
    held_out: Sequence[Measurement] = (),
    profiled: Sequence[str] = (),
    horizon: float = HORIZON,
    most_windows: int = MOST_WINDOWS,
    delays: Mapping[str, float] | None = None,
    progress: Progress = lambda _: None,
) -> SystemResult:
    """Fit a machine's numbers to recordings and judge what was found.

    Bar and cables are simulated window by window from measured motor angles and frame pose. Each
    window's initial state is free: its effect on the residuals is projected out to first order
    (variable projection, Golub and Pereyra 1973), about the best known state.

    Args:
        searched: to fit, at least one, all of one machine.
        chosen: what to fit, as from `choose` for that machine.
        held_out: to judge only.
        profiled: parameters whose profile likelihood is wanted.
        horizon: length of a window [s].
        most_windows: of each recording, evenly spread.
        delays: of the sensors, by topic [s], the same in all recordings; None: those found in each,
            see `delays_to_remove`.
        progress: called with what is being done.

    Raises:
        InputError: no recording, a sensor or a long enough window is missing, nothing is free, or
            a recording is both searched and held out.
    """
    check_roles(searched, held_out)
    if not 0.1 <= horizon <= 60.0:
        raise InputError(f"--horizon {horizon:g}: allowed: 0.1 to 60 s")
    machine = searched[0].machine
    drifts: dict[str, list[ClockDrift]] = {}
    if delays is None:
        progress("clocks")
        searched = [_on_one_clock(each, drifts) for each in searched]
        held_out = [_on_one_clock(each, drifts) for each in held_out]
    solved = solve(searched, chosen, horizon, most_windows, delays, progress)
    estimate, shootings = solved.solution.estimate, solved.shootings
    profiles = []
    for name in profiled:
        progress(f"profile of {name}")
        profiles.append(_profile(solved, name))
    found = machine_with(machine, chosen, estimate.values)
    return SystemResult(
        tuple(chosen),
        solved.solution,
        solved.bias,
        found,
        horizon,
        tuple(len(shooting.windows) for shooting in shootings),
        tuple(searched),
        _judged(shootings, held_out, {"nominal": machine, FITTED: found}, delays, progress),
        tuple(profiles),
        solved.settled,
        drifts,
    )


def _on_one_clock(measurement: Measurement, drifts: dict[str, list[ClockDrift]]) -> Measurement:
    """Return the measurement without drifts; those that were taken out are put into `drifts`."""
    line, found = on_one_clock(Timeline(measurement), measurement.machine)
    if found:
        drifts[measurement.path.name] = found
    return line.measurement


class Solved(NamedTuple):
    """What the fit alone gives.

    Attributes:
        problem: what was solved.
        optimum: of it.
        solution: the same less its bias.
        bias: that was taken out.
        shootings: the windows of each recording.
        settled: whether parameters and initial states came to stand still.
    """

    problem: Problem
    optimum: Solution
    solution: Solution
    bias: Bias
    shootings: list[Shooting]
    settled: bool


def solve(
    searched: Sequence[Measurement],
    chosen: Sequence[Chosen],
    horizon: float = HORIZON,
    most_windows: int = MOST_WINDOWS,
    delays: Mapping[str, float] | None = None,
    progress: Progress = lambda _: None,
    seed: int = 0,
) -> Solved:
    """Fit alone, without judging what was found; see `identify_system`.

    `seed` is that of the noise that is drawn for the intervals.
    """
    machine = searched[0].machine
    progress("signals")
    shootings = [make_shooting(each, horizon, most_windows, delays) for each in searched]
    theta = np.array([each.nominal for each in chosen])
    problem = make_problem(machine, chosen, shootings)
    theta, settled = search(problem, machine, chosen, shootings, theta, progress)
    progress("noise, drawn anew")

    def redrawn(draw: int, sign: float = 1.0) -> Problem:
        noisy = [s.redrawn([seed, draw, i], sign) for i, s in enumerate(shootings)]
        return make_problem(machine, chosen, noisy)

    # One at a time: each keeps all signals of all recordings.
    changes = noise_changes(problem, (redrawn(draw) for draw in range(DRAWS)), theta)
    progress("intervals")
    # Weighted by the sensors' own noise. Whitened, or decorrelated, the channels in which the noise
    # on the frame's pose cancels would outweigh the rest, and there it biases most.
    solution = fit(
        problem,
        list(theta),
        whiten=False,
        interval=Interval.SANDWICH,
        noise=unit_noise(changes[0], tuple(problem.groups or ())),
    )
    scatter = noise_scatter(problem, solution, changes, _window_numbers(shootings))
    optimum = solution._replace(estimate=widened(problem, solution.estimate, scatter))
    progress("bias of noise")
    pairs = ((redrawn(draw), redrawn(draw, -1.0)) for draw in range(PAIRS))
    bias = noise_bias(problem, optimum, pairs)
    unbiased = optimum._replace(estimate=without_bias(problem, optimum.estimate, bias))
    return Solved(problem, optimum, unbiased, bias, shootings, settled)


def _profile(solved: Solved, name: str) -> Profile:
    """Return a parameter's profile about its optimum, moved by the bias that was taken out."""
    found = find_profile(solved.problem, solved.optimum, name)
    shift = solved.solution.estimate.value(name) - solved.optimum.estimate.value(name)
    low, high = found.ci95
    return found._replace(values=found.values + shift, ci95=(low + shift, high + shift))


def _window_numbers(shootings: Sequence[Shooting]) -> list[int]:
    """Return the number of each residual's window, counted through all recordings."""
    kinds = [len(shooting.kinds) for shooting in shootings for _ in shooting.windows]
    return [number for number, count in enumerate(kinds) for _ in range(count)]


def _judged(
    shootings: Sequence[Shooting],
    held_out: Sequence[Measurement],
    machines: Mapping[str, Testbed],
    delays: Mapping[str, float] | None,
    progress: Progress,
) -> tuple[Judgement, ...]:
    found = []
    for shooting in shootings:
        measurement = shooting.timeline.measurement
        progress(f"prediction of {measurement.path.name}")
        found.append(judge(measurement, machines, False, shooting.timeline.delays))
    for each in held_out:
        progress(f"prediction of {each.path.name}")
        found.append(judge(each, machines, True, delays))
    return tuple(found)


def make_problem(
    machine: Testbed, chosen: Sequence[Chosen], shootings: Sequence[Shooting]
) -> Problem:
    """Return what is to be solved: per recording, window and kind of channel a residual."""

    def residual(theta: Array) -> list[Array]:
        moved = machine_with(machine, chosen, theta)
        return [
            part[kind]
            for shooting in shootings
            for part in shooting.residuals(moved)
            for kind in shooting.kinds
        ]

    groups = [
        f"{i} {kind}"
        for i, shooting in enumerate(shootings)
        for _ in shooting.windows
        for kind in shooting.kinds
    ]
    return Problem(residual, [each.parameter for each in chosen], groups, step=_STEP)
