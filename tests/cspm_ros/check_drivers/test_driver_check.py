"""Healthy signals of the simulator raise no finding; each corruption raises its own."""

from dataclasses import replace

import numpy as np
import pytest
from driver_samples import (
    BAR,
    BAR_TWIST,
    FRAME,
    FRAME_TWIST,
    TENSION,
    WINCHES,
    lab_of,
    refitted_with_twists,
    said,
    undecided,
    wrong,
)

ANGLES, SPEEDS, TORQUES = slice(0, 8), slice(8, 16), slice(16, 24)
HOISTS = [0, 1]
SURGE_2 = 3
DEGREES = 180.0 / np.pi
NEWTONS = 9.80665
SHORT_RAMP = ("duration=4.0", "winch_frame.motion.ramp=1.0", "target.motion.ramp=1.0")


@pytest.fixture(scope="module")
def rest(tmp_path_factory):
    return lab_of(tmp_path_factory.mktemp("rest") / "r", "rest", "duration=2.0")


@pytest.fixture(scope="module")
def sea(tmp_path_factory):
    folder = tmp_path_factory.mktemp("sea") / "r"
    return lab_of(folder, "worst_case", *SHORT_RAMP).window(1.0, 4.0)


@pytest.fixture(scope="module")
def rig(tmp_path_factory):
    return lab_of(tmp_path_factory.mktemp("rig") / "r", "one_winch", "duration=2.0")


@pytest.fixture(scope="module")
def twists(tmp_path_factory):
    folder = tmp_path_factory.mktemp("twists")
    lab = lab_of(folder / "r", refitted_with_twists(folder), *SHORT_RAMP)
    return lab.window(1.0, 4.0)


@pytest.fixture
def lab(request):
    return request.getfixturevalue(request.param)


class TestSoundSignals:
    def test_at_rest_nothing_is_wrong_and_only_what_needs_motion_is_open(self, rest):
        findings = rest.findings()
        assert wrong(findings) == set()
        assert undecided(findings) <= {(WINCHES, "length"), (WINCHES, "speed")}

    def test_in_motion_nothing_is_wrong_and_nothing_open(self, sea):
        findings = sea.findings()
        assert wrong(findings) == set()
        assert undecided(findings) == set()

    def test_a_rig_without_bar_has_nothing_wrong(self, rig):
        findings = rig.findings()
        assert wrong(findings) == undecided(findings) == set()

    def test_measured_twists_have_nothing_wrong(self, twists):
        findings = twists.findings()
        assert wrong(findings) == set()
        assert {ok for ok, _ in said(findings, BAR_TWIST, "speed")} <= {True, None}

    @pytest.mark.slow
    @pytest.mark.parametrize(
        ("scenario", "seconds", "overrides"),
        [
            ("worst_case", 24.0, ["seed=2"]),
            ("worst_case", 12.0, ["sensors=ideal"]),
            ("worst_case", 12.0, ["rates.motion_capture=100"]),
            ("calm", 24.0, ["seed=3"]),
            ("verification_long", 12.0, []),
        ],
    )
    def test_no_window_of_a_healthy_run_has_anything_wrong(
        self, tmp_path, scenario, seconds, overrides
    ):
        lab = lab_of(tmp_path / "r", scenario, f"duration={seconds}", *overrides)
        for start in np.arange(0.0, seconds, 2.0):
            assert wrong(lab.window(start, start + 2.0).findings()) == set(), start

    def test_what_is_healthy_is_said_with_numbers(self, rest):
        findings = rest.findings()
        assert said(findings, TENSION, "rate") == [(True, "1000.0 Hz (interval 1.000 ms)")]
        assert said(findings, BAR, "rate") == [(True, "100.0 Hz (interval 10.000 ms)")]
        weight = rest.testbed.bar.mass * rest.testbed.gravity
        [(ok, text)] = said(findings, TENSION, "balance")
        assert ok
        assert float(text.split()[3]) == pytest.approx(weight, rel=0.01)
        [(ok, text)] = said(findings, BAR, "axes")
        assert (ok, text) == (True, "z points down: the bar is 2.25 m below the exits")


def tensions(factor, columns=slice(None)):
    return TENSION, lambda feed: feed.scaled(factor, columns)


def winches(factor, columns):
    return WINCHES, lambda feed: feed.scaled(factor, columns)


def pose(factor, columns, name=BAR):
    return name, lambda feed: feed.scaled(factor, columns)


def rows(name, change):
    return name, lambda feed: replace(feed, rows=change(feed.rows.copy()))


def counted(numbers):
    numbers[:, ANGLES] = np.round(numbers[:, ANGLES] * 8192 / (2.0 * np.pi))
    return numbers


def wrapped(numbers):
    numbers[:, ANGLES] %= 2.0 * np.pi
    return numbers


def w_first(numbers):
    numbers[:, 3:] = np.roll(numbers[:, 3:], 1, axis=1)
    return numbers


def swapped_hoists(numbers):
    numbers[:, [0, 1, 8, 9]] = numbers[:, [1, 0, 9, 8]]
    return numbers


def constant(columns):
    def change(numbers):
        numbers[:, columns] = numbers[0, columns]
        return numbers

    return change


def held_from(index):
    return lambda numbers: numbers[np.minimum(np.arange(len(numbers)), index)]


def repeated(numbers):
    return numbers[np.arange(len(numbers)) // 2 * 2]


def nan_at(index, column):
    def change(numbers):
        numbers[index, column] = np.nan
        return numbers

    return change


# Lab, corruption, check that finds it, verdict, words in it, and what else follows from it.
VALUES = {
    "grams": ("rest", tensions(1e3 / NEWTONS), "units", False, "looks in grams: 4105 in total"
              " where gravity gives 39.83 N or more", {"balance"}),
    "grams at sea": ("sea", tensions(1e3 / NEWTONS), "balance", False, "in grams", {"units"}),
    "kilograms": ("rest", tensions(1 / NEWTONS), "units", False, "looks in kilograms",
                  {"balance"}),
    "millinewtons": ("sea", tensions(1e3), "units", False, "looks in millinewtons", {"balance"}),
    "pounds": ("rest", tensions(1 / 4.448222), "balance", False, "in pounds", {"units"}),
    "kilonewtons": ("rest", tensions(1e-3), "units", None, "does the bar hang, and is this in N?",
                    set()),
    "a gain of 1.3": ("sea", tensions(1.3), "balance", False, "times 1.3", set()),
    "load cell inverted": ("sea", tensions(-1.0, SURGE_2), "units", False,
                           "surge_2: negative, median -5.", set()),
    "all load cells inverted": ("rest", tensions(-1.0), "balance", False, "its sign inverted",
                                {"units"}),
    "raw counts": ("rest", rows(TENSION, lambda t: np.round(4321.0 * t)), "units", False,
                   "whole numbers only: looks like raw counts, expected N", {"balance"}),
    "grams on a rig": ("rig", tensions(1e3 / NEWTONS), "units", False,
                       "N (the test-bed's limit is 100)", {"holding"}),
    "bar in mm": ("rest", pose(1e3, slice(0, 3)), "units", False, "looks in millimetres: 2000"
                  " from the origin", set()),
    "bar in cm": ("sea", pose(1e2, slice(0, 3)), "units", False, "looks in centimetres", set()),
    "moving frame in mm": ("sea", pose(1e3, slice(0, 3), FRAME), "units", False,
                           "looks in millimetres: ", set()),
    "still frame in mm": ("rest", pose(1e3, slice(0, 3), FRAME), "noise", None,
                          "where the test-bed says 5e-05 m: in millimetres?", set()),
    "z up": ("rest", pose(-1.0, [1, 2, 4, 5]), "axes", False,
             "the bar seems 1.75 m above the exits: z points up, expected: down", set()),
    "w first": ("sea", rows(BAR, w_first), "quaternion", False, "looks like w first", set()),
    "not of unit length": ("sea", pose(1.1, slice(3, 7)), "quaternion", False,
                           "quaternion of length 1.1, expected 1", set()),
    "no quaternion": ("sea", pose(0.0, slice(3, 7)), "quaternion", False,
                      "length 0, expected 1: it is not filled", set()),
    "angles in degrees": ("sea", winches(DEGREES, ANGLES), "speed", False,
                          "all: is the derivative of the angle, but with the angle in degrees",
                          {"length"}),
    "all in degrees": ("sea", winches(DEGREES, slice(0, 16)), "length", False,
                       "all: is the angle that the poses give, but in degrees", set()),
    "speeds in degrees": ("sea", winches(DEGREES, SPEEDS), "speed", False,
                          "all: is the derivative of the angle, but in degrees per second", set()),
    "speeds in rpm": ("rest", winches(30 / np.pi, SPEEDS), "speed", False,
                      "in revolutions per minute", set()),
    "one speed inverted": ("sea", winches(-1.0, 8 + SURGE_2), "speed", False,
                           "surge_2: is the derivative of the angle, but its sign inverted",
                           set()),
    "one winch inverted": ("sea", winches(-1.0, [SURGE_2, 8 + SURGE_2]), "length", False,
                           "surge_2: is the angle that the poses give, but its sign inverted",
                           set()),
    "counts": ("sea", rows(WINCHES, counted), "units", False, "all: whole numbers only: looks like"
               " encoder counts, expected rad at the motor shaft", {"length"}),
    "single turns": ("sea", rows(WINCHES, wrapped), "units", False,
                     "the angle jumps by 2π, expected: turns are counted", set()),
    "drum angles": ("sea", winches(0.1, [0, 1, 8, 9]), "length", False,
                    "hoist_1, hoist_2: is the angle that the poses give, but at the drum, not the"
                    " motor shaft", set()),
    "drum torques": ("rest", winches(10.0, [16, 17]), "holding", False, "hoist_1, hoist_2: the"
                     " torque that holds the tension, but at the drum, not the motor shaft",
                     set()),
    "swapped motors": ("sea", rows(WINCHES, swapped_hoists), "length", False, "hoist_1, hoist_2:"
                       " is not the angle that the poses give: swapped cables, or poses in other"
                       " axes?", set()),
    "torques in mN·m": ("sea", winches(1e3, TORQUES), "holding", False,
                        "all: the torque that holds the tension, but in millinewton metres",
                        {"torque"}),
    "torques inverted": ("rest", winches(-1.0, TORQUES), "holding", False,
                         "all: the torque that holds the tension, but its sign inverted", set()),
    "no torques": ("sea", winches(0.0, TORQUES), "torque", None,
                   "always 0: is the torque filled, and are the drives on?", set()),
    "NaN": ("sea", rows(BAR, nan_at(7, 1)), "finite", False,
            "y: NaN, infinite or beyond 1e+12 in 1 of 3000 messages", set()),
    "frozen pose": ("sea", rows(BAR, constant(slice(None))), "changes", None,
                    "does not change: is the sensor on?", set()),
    "frozen load cell": ("sea", rows(TENSION, constant(4)), "changes", None,
                         "effort/sway_1 does not change: is the sensor on?", set()),
    "lost tracking": ("sea", rows(BAR, held_from(1800)), "changes", None,
                      "the same numbers for 1.20 s: is tracking lost, or does the sensor hang?",
                      set()),
    "slower sensor": ("sea", rows(BAR, repeated), "changes", None,
                      "only 50% of the messages bring new numbers: is a slower sensor repeated?",
                      set()),
}  # fmt: skip


@pytest.mark.parametrize(
    ("lab", "corruption", "check", "ok", "words", "follows"),
    VALUES.values(),
    ids=VALUES.keys(),
    indirect=["lab"],
)
def test_wrong_numbers_raise_their_finding_and_no_other(lab, corruption, check, ok, words, follows):
    name, change = corruption
    findings = lab.but(name, change).findings()
    found = said(findings, name, check)
    assert any(verdict is ok and words in text for verdict, text in found), found
    topics = (name, WINCHES) if "holding" in follows else (name,)
    allowed = {(topic, each) for topic in topics for each in follows}
    assert wrong(findings) - {(name, check)} <= allowed


@pytest.mark.parametrize(
    ("factor", "words"),
    [
        (1e3 / NEWTONS, "but with the tension in grams"),
        (1 / NEWTONS, "but with the tension in kilograms"),
        (1e3, "but with the tension in millinewtons"),
        (-1.0, None),
    ],
)
def test_where_no_weight_shows_the_unit_of_a_tension_the_torque_does(rig, factor, words):
    findings = rig.but(TENSION, lambda feed: feed.scaled(factor)).findings()
    [(ok, text)] = said(findings, WINCHES, "holding")
    if words is None:
        expected = "surge: cannot decide the torque's unit: the cable carries hardly anything"
        assert (ok, text) == (None, expected)
    else:
        assert (ok, text) == (False, f"surge: the torque that holds the tension, {words}")


def test_torques_that_a_brake_replaces_are_left_open(sea):
    braked = sea.but(WINCHES, lambda feed: feed.scaled(0.01, TORQUES)).findings()
    assert said(braked, WINCHES, "holding") == [
        (None, "all: 0.0 × the torque that holds the tension: do friction or a brake hold it?")
    ]


def test_a_fast_drum_over_a_lost_message_is_no_jump_of_a_turn(sea):
    feed = sea.feeds[WINCHES]
    turning = feed.rows.copy()
    # 60 rad/s: over a gap of 105 ms the angle goes on by 2π.
    turning[:, 0] = 60.0 * (feed.stamps - feed.stamps[0]) * 1e-9
    turning[:, 8] = 60.0
    lab = sea.but(WINCHES, lambda feed: replace(feed, rows=turning).only(np.r_[0:500, 604:3000]))
    findings = lab.findings()
    assert [ok for ok, _ in said(findings, WINCHES, "units")] == [True]
    assert [ok for ok, _ in said(findings, WINCHES, "speed")] == [True]


TWISTS = {
    "healthy": (BAR_TWIST, 1.0, slice(0, 6), True, "all: is the derivative of the pose"),
    "degrees": (BAR_TWIST, DEGREES, slice(3, 6), False, "but in degrees per second"),
    "millimetres": (FRAME_TWIST, 1e3, slice(0, 3), False, "but in millimetres"),
    "one inverted": (BAR_TWIST, -1.0, 2, False, "vz: is the derivative of the pose, but its sign"),
}


@pytest.mark.parametrize(
    ("name", "factor", "columns", "ok", "words"), TWISTS.values(), ids=TWISTS.keys()
)
def test_a_twist_is_held_against_its_pose(twists, name, factor, columns, ok, words):
    findings = twists.but(name, lambda feed: feed.scaled(factor, columns)).findings()
    found = said(findings, name, "speed")
    assert any(verdict is ok and words in text for verdict, text in found), found
    assert wrong(findings) == (set() if ok else {(name, "speed")})
