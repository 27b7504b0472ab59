"""The guided pull test: who answers when a person pulls at one cable, and with which sign.

While the drives hold, one cable after the other is pulled by hand out of its winch. Its load cell
must then show more; its motor, where it gives way, must turn to smaller angles, since positive
winds in, and where it does not, hold with more torque; the bar, where it moves, must move away from
that cable's exit.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations
from typing import NamedTuple

import numpy as np

from cspm_model.kinematics import geometry
from cspm_msgs_py.errors import InputError, SingularityError
from cspm_msgs_py.testbed import Testbed
from cspm_ros.check_drivers.driver_geometry import pose_of
from cspm_ros.check_drivers.driver_observation import Array, Finding
from cspm_ros.check_drivers.driver_relation import Verdict
from cspm_sim.parameters import plant_parameters

BAR_POSE, FRAME_POSE = "/bar/pose", "/winch_frame/pose"
LEAST_FORCE = 2.0  # N
LEAST_LENGTH = 0.002  # m
ABOVE_REST = 3.0  # times what happens without a pull
RIVAL = 0.7  # of the strongest answer
PERCENTILES = (2.0, 98.0)
FEWEST_ROWS = 10
INSTANTS = 200

# Rows (n, width) of one window by topic, in the contract's columns, all finite.
Window = Mapping[str, Array]


class _Signal(NamedTuple):
    """A signal of the winches that must grow when its cable is pulled out.

    Attributes:
        name: of the quantity.
        topic: that carries it.
        place: which of the topic's parts it is.
        least: the smallest change that counts [N or m].
        grows, shrinks: what a change is called.
        unmoved: what no change means.
    """

    name: str
    topic: str
    place: int
    least: float
    grows: str
    shrinks: str
    unmoved: str


_SIGNALS = (
    _Signal(
        "tension", "/cables/tension", 0, LEAST_FORCE, "rose by {:.3g} N", "fell by {:.3g} N",
        "no tension changed clearly: pull harder, or no load cell is on",
    ),
    _Signal(
        "angle", "/winches/state", 0, LEAST_LENGTH, "let out {:.3g} m", "wound in {:.3g} m",
        "cannot decide: no motor turned clearly, the drives hold",
    ),
    _Signal(
        "torque", "/winches/state", 2, LEAST_FORCE, "rose by {:.3g} N", "fell by {:.3g} N",
        "cannot decide: no torque changed clearly, brakes or constant torques hold",
    ),
)  # fmt: skip


class _Answer(NamedTuple):
    """How far each cable's signal went, shape (n,), and which of them answered."""

    changes: Array
    answered: list[int]


@dataclass(frozen=True)
class PullVerdict:
    """What the pull at one cable showed.

    Attributes:
        cable: which was pulled.
        answered: the cable that alone answered, by signal (tension, angle, torque); signals to
            which none or several did are absent.
        findings: one for each signal.
    """

    cable: str
    answered: Mapping[str, str]
    findings: tuple[Finding, ...]

    @property
    def ok(self) -> bool | None:
        """False if anything is wrong, True if the right load cell answered, else None."""
        if any(finding.ok is False for finding in self.findings):
            return False
        return True if self.answered.get("tension") == self.cable else None


def instruction(cable: str, seconds: float) -> str:
    """Return the text for the person at the machine."""
    return (
        f"let all drives hold and stop all controllers; then pull cable {cable} by hand, outwards"
        f" of its winch, for {seconds:g} s"
    )


def analyse_pull(testbed: Testbed, cable: str, before: Window, during: Window) -> PullVerdict:
    """Judge a pull at `cable`.

    Args:
        testbed: the machine.
        cable: the cable that was to be pulled.
        before: what was measured while nobody pulled, at least some tenths of a second.
        during: what was measured while the cable was pulled.

    Raises:
        InputError: there is no such cable.
    """
    names = testbed.cable_names
    if cable not in names:
        raise InputError(f"no cable '{cable}' in the test-bed, allowed: {', '.join(names)}")
    findings, answered = [], {}
    for signal in _SIGNALS:
        answer = _answer(testbed, signal, before, during)
        ok, text = _verdict(signal, answer, names, cable)
        findings.append(Finding(signal.topic, f"pull_{signal.name}", ok, text))
        if answer is not None and len(answer.answered) == 1:
            answered[signal.name] = names[answer.answered[0]]
    if testbed.bar is not None:
        ok, text = _bar_verdict(testbed, cable, before, during)
        findings.append(Finding(BAR_POSE, "pull_pose", ok, text))
    return PullVerdict(cable, answered, tuple(findings))


def swapped(verdicts: Sequence[PullVerdict]) -> list[Finding]:
    """Return which cables answer for each other, from the pulls at several."""
    findings = []
    for signal in _SIGNALS:
        answers = {v.cable: v.answered.get(signal.name) for v in verdicts}
        for one, other in combinations(answers, 2):
            if answers[one] == other and answers[other] == one:
                text = f"{signal.name} of {one} and {other} are swapped"
                findings.append(Finding(signal.topic, "swapped", False, text))
    return findings


def _answer(testbed: Testbed, signal: _Signal, before: Window, during: Window) -> _Answer | None:
    """Return how the signal answered, None where one window has too few rows."""
    windows = [window.get(signal.topic) for window in (before, during)]
    rows = [each for each in windows if each is not None and len(each) >= FEWEST_ROWS]
    if len(rows) < 2:
        return None
    radii = np.array([cable.wound_radius for cable in testbed.cables])
    scale = {"tension": np.ones_like(radii), "angle": -radii, "torque": 1.0 / radii}[signal.name]
    columns = slice(signal.place * len(radii), (signal.place + 1) * len(radii))
    rest, pulled = (scale * each[:, columns] for each in rows)
    changes, usual = _farthest(pulled, rest), _farthest(rest, rest)
    sizes = np.abs(changes)
    clear = sizes > np.maximum(signal.least, ABOVE_REST * np.abs(usual))
    strong = sizes >= RIVAL * np.max(sizes, where=clear, initial=0.0)
    return _Answer(changes, np.flatnonzero(clear & strong).tolist())


def _farthest(values: Array, rest: Array) -> Array:
    """Return how far the columns of `values` (m, n) go from the medians of `rest`, with sign."""
    low, high = np.percentile(values - np.median(rest, axis=0), PERCENTILES, axis=0)
    farthest: Array = np.where(high > -low, high, low)
    return farthest


def _verdict(signal: _Signal, answer: _Answer | None, names: Sequence[str], cable: str) -> Verdict:
    if answer is None:
        return None, f"cannot decide: too few messages of {signal.topic}"
    if not answer.answered:
        return None, signal.unmoved
    if len(answer.answered) > 1:
        several = " and ".join(names[i] for i in answer.answered)
        return None, f"cannot decide: the {signal.name} of {several} answered equally; hold the bar"
    found = answer.answered[0]
    change = float(answer.changes[found])
    said = (signal.grows if change > 0 else signal.shrinks).format(abs(change))
    text = f"pulled {cable}: its {signal.name} {said}"
    if names[found] != cable:
        inverted = "" if change > 0 else " and one inverted"
        text = f"pulled {cable}, but the {signal.name} of {names[found]} {said}"
        return False, f"{text}: are two cables swapped{inverted}?"
    return (True, text) if change > 0 else (False, f"{text}: is its sign inverted?")


def _bar_verdict(testbed: Testbed, cable: str, before: Window, during: Window) -> Verdict:
    """Judge whether the bar moved away from the pulled cable's exit."""
    moving = [BAR_POSE] + [FRAME_POSE] * (testbed.winch_frame is not None)
    for name in moving:
        for window in (before, during):
            if name not in window or len(window[name]) < FEWEST_ROWS:
                return None, f"cannot decide: too few messages of {name}"
    index = testbed.cable_names.index(cable)
    try:
        rest, pulled = (_lengths(testbed, window, index) for window in (before, during))
    except SingularityError as err:
        return False, f"impossible pose: {err}"
    still, moved = (_movement(window, before) for window in (before, during))
    if moved < max(LEAST_LENGTH, ABOVE_REST * still):
        return None, "cannot decide: the bar did not move clearly"
    change = float(_farthest(pulled, rest)[0])
    if abs(change) < max(0.5 * LEAST_LENGTH, ABOVE_REST * abs(float(_farthest(rest, rest)[0]))):
        return None, f"cannot decide: the bar moved across {cable}, not along it"
    text = f"the bar moved by {moved:.3g} m"
    if change > 0:
        return True, f"{text}, {change:.3g} m away from the exit of {cable}"
    text += f", {-change:.3g} m towards the exit of {cable}"
    return False, f"{text}, expected: away from it; is the pose mirrored, or are cables swapped?"


def _movement(window: Window, rest: Window) -> float:
    """Return how far the bar's origin went from its median place at rest [m]."""
    middle = np.median(rest[BAR_POSE][:, :3], axis=0)
    distances = np.linalg.norm(window[BAR_POSE][:, :3] - middle, axis=1)
    return float(np.percentile(distances, PERCENTILES[1]))


def _lengths(testbed: Testbed, window: Window, index: int) -> Array:
    """Return one cable's length from the poses at some instants, the frame in its median place.

    Shape (m, 1) [m].
    """
    cables = plant_parameters(testbed).cables
    rows = window[BAR_POSE]
    frame = np.zeros(6)
    if testbed.winch_frame is not None:
        frame = pose_of(np.median(window[FRAME_POSE], axis=0))
    chosen = np.linspace(0, len(rows) - 1, min(INSTANTS, len(rows))).astype(int)
    lengths = [geometry(cables, pose_of(row), frame).lengths[index] for row in rows[chosen]]
    return np.array(lengths)[:, None]
