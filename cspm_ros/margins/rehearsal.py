"""How late commands come on this machine, measured before a run in real time begins.

The run itself is rehearsed for two seconds, with all its nodes and a simulated plant, under a
namespace of its own: no drive hears it, and no guard ends it.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

import numpy as np

from cspm_control.safety import check_real_time
from cspm_msgs_py.errors import ConvergenceError, CspmError, InputError
from cspm_msgs_py.new_folder import ScratchFolder, refuse_existing
from cspm_msgs_py.recording.reader import Recording
from cspm_msgs_py.recording.rows import Rows
from cspm_msgs_py.ros.domain_claim import refuse_claimed
from cspm_msgs_py.safety_spec import LONGEST
from cspm_msgs_py.scenario_keys.bodies import EXTERNAL, MEASURED
from cspm_msgs_py.scenario_keys.drive import TENSION_DRIVE
from cspm_msgs_py.schedule import (
    TENSION,
    TENSION_COMMAND,
    TORQUE_COMMAND,
    Schedule,
    schedule_of,
)
from cspm_msgs_py.stepping.lateness import too_busy
from cspm_ros.margins.lateness import lateness_ns
from cspm_run.bundle import Bundle
from cspm_run.run_result import RunResult

SECONDS = 2.0
_UNBOUNDED = 1e9
_LIMITS = (
    "tension_trip",
    "workspace",
    "pose_speed",
    "pose_acceleration",
    "following_error",
    "torque_mismatch",
)
# What goes over ROS where the drives close the force loops, and how often it then has to [Hz].
_OUTER = ("motion_capture", "wave_trajectory", "motion_controller", "tension_distribution")
_SLOWER = (200.0, 100.0)

Variant = Callable[[Sequence[str]], Bundle]


class Lateness(NamedTuple):
    """How old the state was that commands answered, and how old it may be [ns]."""

    topic: str
    measured_ns: int
    allowed_ns: int

    @property
    def bearable(self) -> bool:
        """Whether the loops bear it."""
        return self.measured_ns <= self.allowed_ns


def rehearsed(
    runner: Callable[..., RunResult],
    notify: Callable[[str], None],
    variant: Variant | None = None,
) -> Callable[[Bundle, Path, Callable[[float], None]], RunResult]:
    """Return a runner in real time that begins only where the machine is fast enough.

    Args:
        runner: `run_realtime` or `run_processes` in real time.
        notify: called with what is being done, in one line.
        variant: returns what is run with more values put over the scenario's, `KEY=VALUE`; None:
            no other profile is looked for.
    """

    def run(bundle: Bundle, folder: Path, progress: Callable[[float], None]) -> RunResult:
        refuse_existing(folder)
        check_machine(bundle, runner, notify, variant)
        return runner(bundle, folder, progress)

    return run


def check_machine(
    bundle: Bundle,
    runner: Callable[..., RunResult],
    notify: Callable[[str], None],
    variant: Variant | None = None,
) -> None:
    """Refuse a run whose loops do not bear this machine's lateness; arguments as `rehearsed`.

    Raises:
        InputError: with the numbers, and the fastest profile that the machine bears.
        CspmError: it was interrupted, or a node failed.
    """
    scenario, testbed = bundle.scenario, bundle.testbed.testbed
    check_real_time(scenario.safety, schedule_of(scenario, testbed))
    refuse_claimed(None)
    if os.environ.get("ROS_SECURITY_ENABLE", "").lower() == "true":
        notify("not rehearsed: a secured graph has no other namespace (ROS_SECURITY_ENABLE)")
        return
    found = measure(bundle, runner, notify)
    if found is None or found.bearable:
        return
    what = f"{found.topic} answered, in {SECONDS:g} s before the start, a state of"
    remedy = _remedy(scenario.rates.model_dump(), runner, notify, variant)
    raise InputError(too_busy(what, found.measured_ns, found.allowed_ns, remedy) or "")


def measure(
    bundle: Bundle, runner: Callable[..., RunResult], notify: Callable[[str], None]
) -> Lateness | None:
    """Rehearse a run; None where nothing says how late commands may be.

    Raises:
        CspmError: it was interrupted, or a node failed.
    """
    allowed = _allowed_ns(bundle)
    if allowed is None:
        return None
    notify(f"measures how late this machine is, for {SECONDS:g} s")
    schedule = schedule_of(bundle.scenario, bundle.testbed.testbed)
    with ScratchFolder("rehearsal") as place:
        result = runner(
            _unguarded(bundle),
            place / "run",
            lambda _: None,
            external=False,
            notify=lambda _: None,
            steps=round(SECONDS * 1e9 / schedule.period_ns),
            namespace=f"/rehearsal_{os.getpid()}",
        )
        if result.interrupted:
            raise CspmError("interrupted while the machine's lateness was measured")
        topic = TENSION_COMMAND if schedule.hosted else TORQUE_COMMAND
        with Recording(place / "run") as recording:
            rows = recording.rows_of([topic, TENSION])
    return Lateness(topic, _measured_ns(rows[topic], rows[TENSION], schedule, topic), allowed)


def worst_age_ns(commands: Rows, tensions: Rows) -> int:
    """Return how old the state was at most that the commands in force answered [ns].

    A command is in force until the next one comes, the last one until the last tension; where
    none came, it is as old as the run.
    """
    if not len(commands.log_ns):
        return int(np.ptp(tensions.log_ns)) if len(tensions.log_ns) else round(SECONDS * 1e9)
    until = np.append(commands.log_ns[1:], max(commands.log_ns[-1], tensions.log_ns[-1]))
    return int((until - commands.stamp_ns).max())


def _measured_ns(commands: Rows, tensions: Rows, schedule: Schedule, topic: str) -> int:
    """Return what the guards compare: drives count from when a command may be there first."""
    timing = schedule.topics[topic]
    steps = timing.delay if schedule.hosted else timing.divider
    return worst_age_ns(commands, tensions) - steps * schedule.period_ns


def _allowed_ns(bundle: Bundle) -> int | None:
    margin, scenario = lateness_ns(bundle), bundle.scenario
    if margin is None or scenario.drive != TENSION_DRIVE:
        return margin
    return min(margin, round(scenario.safety.stale_after * 1e9))


def _unguarded(bundle: Bundle) -> Bundle:
    """Return a run that nothing ends: its bar is simulated, whatever becomes of it."""
    scenario = bundle.scenario
    waits = dict.fromkeys(("stale_after", "watchdog", "lateness"), LONGEST)
    limits = dict.fromkeys(_LIMITS, _UNBOUNDED)
    safety = scenario.safety.model_copy(update={**waits, **limits, "stop_heartbeat": None})
    changed: dict[str, object] = {"safety": safety, "faults": (), "events": ()}
    if scenario.target.source == EXTERNAL:
        changed["target"] = scenario.target.model_copy(update={"source": MEASURED})
    return replace(bundle, scenario=scenario.model_copy(update=changed))


def _remedy(
    rates: dict[str, float],
    runner: Callable[..., RunResult],
    notify: Callable[[str], None],
    variant: Variant | None,
) -> str:
    """Return the fastest profile that holds, rehearsed as well, in words."""
    if variant is None:
        return "drive: tension, slower loops, or a machine that does less"
    for overrides in _profiles(rates):
        # What cannot be resolved at other rates is no profile.
        with suppress(InputError, ConvergenceError):
            found = measure(variant(overrides), runner, notify)
            if found is not None and found.bearable:
                words = " ".join(f"--set {each}" for each in overrides)
                times = f"{found.measured_ns * 1e-6:.1f} of {found.allowed_ns * 1e-6:.3g} ms"
                return f"fastest profile that holds here: {words} ({times})"
    return "no profile with drive: tension holds here either, end other programs"


def _profiles(rates: dict[str, float]) -> Iterator[list[str]]:
    """Yield values put over the scenario's, the fastest first."""
    drive = f"drive={TENSION_DRIVE}"
    yield [drive]
    for rate in _SLOWER:
        slower = [f"rates.{name}={rate:g}" for name in _OUTER if (rates.get(name) or 0.0) > rate]
        if slower:
            yield [drive, *slower]
