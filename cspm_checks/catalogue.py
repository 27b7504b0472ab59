"""What an import checks: each kind of suspicion, when it is reported, and what repairs it."""

from __future__ import annotations

import sys
from typing import NamedTuple


class Check(NamedTuple):
    """One kind of suspicion.

    Attributes:
        when: what is reported, for the page.
        remedy: which key of the mapping repairs it, or where to look.
    """

    when: str
    remedy: str


CHECKS: dict[str, Check] = {
    "velocity": Check(
        "windows of position do not grow as velocity integrates (robust regression with a constant"
        " bias): factor and sign, with the usual reason (rpm, degrees, half the counts)",
        "`unit`, `scale` or `sign` of one of the two",
    ),
    "unrelated": Check(
        "velocity explains less than half of position", "the right `column`, or leave it out"
    ),
    "power": Check(
        "torque, regressed on acceleration, speed, its sign and tension in eight segments, has"
        " an inertia below 0, or friction that gives energy (over 5 % of what flows) and no inertia"
        " above 0",
        "`sign` of torque or angle",
    ),
    "torque": Check(
        "torque and tension are not tied by drum radius over gear ratio in the same regression:"
        " factor below 0.5, above 2, or negative; their means likewise, where tension has one",
        "`unit`, `scale` or `sign`, or the drum in the test-bed",
    ),
    "late": Check(
        "torque against motion and tension, velocity against position, or poses against the winches"
        " (by inverse kinematics), by more than a sample and four times the scatter of eight"
        " segments or of the winches (within 0.25 s); poses, or all load cells against torque, by"
        " any time at which they correlate above 0.95; with the drift between clocks",
        "a `clock` of its own with that `offset`, less where it is late, and `skew` for a drift",
    ),
    "stuck": Check(
        "a load cell or pose sends 50 equal values or more, 20 times more than usual and other than"
        " 0; a position stands still while its speed is not 0",
        "`drop` the stretch",
    ),
    "implausible": Check(
        "above twice the torque or tension limit, below a thousandth of it, a pushing cable, more"
        " than 20 m wound, 50 m away, more than a turn of roll; a winch or the bar accelerates by"
        " twice what torque, tension and weight allow, again and again",
        "`unit`, `sign` or `offset`, or `unit` of the clock",
    ),
    "exchanged": Check(
        "an encoder follows, by inverse kinematics, the length of another cable; a load cell, by"
        " the torques less inertia and friction, the tension of another",
        "the other's `column`",
    ),
    "reversed": Check(
        "an encoder counts the other way, all the time or from an instant on, by inverse"
        " kinematics; a load cell has the other sign, by the torques",
        "`sign: -1`",
    ),
    "factor": Check(
        "an encoder winds 1.2 to 50 times more or less than the poses say, and else fits them",
        "`counts_per_turn` or `scale`, or drum and gear ratio in the test-bed",
    ),
    "axes": Check(
        "poses contradict the encoders by more than a fifth of the motion, and by more than stretch"
        " and 5 mm of survey; read otherwise (other axes, order or inverse of the quaternion, unit,"
        " frame or origin) they fit",
        "the columns and signs that the text names",
    ),
    "kinematics": Check(
        "poses contradict encoders in that way, and no other reading that is tried fits",
        "exits, attachments and drums in the test-bed, or the columns of both",
    ),
    "attitude": Check(
        "the orientation turns by more than 30° in a frame, or by eight times the fifth largest"
        " step of the fifty around and 5°",
        "`drop` the stretches between",
    ),
    "drift": Check(
        "by the balance of forces on the bar, one load cell drifts by six standard errors, a"
        " hundredth of its tension, and 1.5 times what any other explains",
        "a zero before and after, or `drift` left to the diagnosis (`tension_drift`)",
    ),
    "limit": Check(
        "a drive is within half a percent of its torque limit in more than a hundredth of the"
        " samples",
        "ask for less, or correct `torque_limit`",
    ),
    "hum": Check(
        "a line at 50 or 60 Hz, 100 times the power beside it, with a tenth of what is faster"
        " than 10 Hz",
        "shielding and earth of the cable; a filter hides it, and delays",
    ),
    "constant": Check(
        "nothing changes, and no brake is said to hold the winch (`locked`)",
        "leave it out, or state it as `constant`",
    ),
    "empty": Check("no number at all", "leave it out"),
    "saturated": Check(
        "values pile up at the end of the range", "`invalid: [VALUE]`, or `drop` the stretch"
    ),
    "coarse": Check(
        "fewer than 64 levels, unless as fine as the sensor is said to be",
        "a finer source; noise is that of rounding",
    ),
    "resolution": Check(
        "the step of the values is not that of the test-bed's sensor",
        "`unit` or `scale`, or `resolution` in the test-bed",
    ),
    "smoothed": Check(
        "no step at all where the test-bed's sensor has one: filtered or resampled before",
        "the data before that, or `resolution: 0` in the test-bed",
    ),
    "held": Check(
        "values change only every n-th message: a slower sensor filled up; looks like delay",
        "the sensor's own file, at its own rate",
    ),
    "interpolated": Check(
        "values bend only every n-th message: a slower sensor interpolated; looks like damping",
        "the sensor's own file, at its own rate",
    ),
    "spike": Check(
        "samples, three at most, that leave and come back by steps eight times the fifth largest"
        " of the fifty around; torques and speeds beyond all their other values",
        "`spikes: mask` in the channel",
    ),
    "zero": Check(
        "samples of exactly 0, 25 at most, between others that are not, by such steps",
        "`invalid: [0]`, or `spikes: mask` in the channel",
    ),
    "jump": Check(
        "such a step of a position that stays: an encoder that was reset, a marker lost",
        "`jumps: join` in the channel takes it out; `drop` splits the recording there",
    ),
    "rollover": Check(
        "a position starts again at the other end of its range: a counter without `wrap`",
        "`wrap: PERIOD` in the channel",
    ),
    "mended": Check("samples changed by `spikes: mask` or `jumps: join`", "nothing"),
    "unset": Check(
        "stamps of 0 that nobody had set; they are taken from the time of the log, less the usual"
        " lag of the others",
        "nothing, or `stamp: log`",
    ),
    "unlike_log": Check(
        "stamps of headers that are off the times of the log, less a constant, by five steps and"
        " 20 ms in a tenth of the messages: whole seconds, or nanoseconds that hold something else",
        "`stamp: log` in the clock",
    ),
    "late_part": Check(
        "a part of a JointState that the first messages have not; they are kept without it",
        "`drop` those messages, or leave the part out",
    ),
    "unmeasured": Check("cables without load cell; their tension is NaN", "nothing"),
    "paired": Check(
        "stamps of one message that differ within the tolerance; the message has the first",
        "`pairing: 0` refuses them",
    ),
    "overlap": Check(
        "topics that have no instant in common: two clocks; refused where they lie farther apart"
        " than either lasts",
        "`stamp: log`, or `offset` or `points` of one clock",
    ),
    "gap": Check(
        "steps longer than 1.5 median steps; than 2.5 where stamps scatter",
        "`drop` one side, if much is missing",
    ),
    "irregular": Check(
        "more than 1 % of the steps differ by more than 1 %",
        "`rate` in the clock, where the device samples regularly",
    ),
    "jitter": Check(
        "stamps that scatter about an even clock: each step too long is followed by one too short"
        " (correlation below −0.25)",
        "`rate` in the clock instead of its `column`",
    ),
    "single": Check(
        "times that were stored in single precision: steps are rounded by more than 1 %",
        "`rate` in the clock, or times in double precision",
    ),
    "duplicate": Check(
        "stamps that repeat",
        "`disorder: drop` in the clock where it costs a hundredth at most; else `rate`, in a bag"
        " `stamp: log`",
    ),
    "backwards": Check(
        "time that runs backwards",
        "likewise; `wrap` of the clock; times with their zone where local time was put back",
    ),
    "rate": Check(
        "more messages than the test-bed's sensor delivers, or so few that the next smaller unit"
        " of time would do",
        "`unit` of the clock, or `rate` in the test-bed",
    ),
    "wrap": Check(
        "a counter steps by more than a quarter of its range: which way round is a guess",
        "the right `wrap`, or a higher rate",
    ),
    "quaternion": Check("lengths other than 1", "order of the columns, or all their digits"),
}


def check_table() -> str:
    """Return the catalogue as a table of Markdown."""
    lines = ["| kind | reported when | remedy |", "|---|---|---|"]
    lines += [f"| `{kind}` | {check.when} | {check.remedy} |" for kind, check in CHECKS.items()]
    return "\n".join(lines)


if __name__ == "__main__":
    sys.stdout.write(check_table() + "\n")
