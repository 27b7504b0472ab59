"""A person is led through the pull test; the machine is made of steady numbers."""

import io

import numpy as np
import pytest
from driver_samples import TENSION, WINCHES, Feed, steady_feed
from rich.console import Console

from cspm_msgs_py.errors import InputError
from cspm_msgs_py.topics import contract_topics
from cspm_ros.check_drivers.driver_observation import Observation
from cspm_ros.check_drivers.guided_pull import REST_S, GuidedPull, pulled_cables, window_of

HAND = 12.0  # N
SECONDS = 2.0
RATE = 100


class Machine:
    """Load cells of which each answers at a pull at one cable; a signal ends what it is asked."""

    def __init__(self, testbed, answering, patience=np.inf):
        self.testbed, self.answering, self.patience = testbed, answering, patience
        self.pulled = None
        self.heard = None
        self.lengths = []

    def wait_for(self, done):
        while not done():
            self.patience -= 1
            if self.patience < 0:
                return False
        return True

    def listen(self, seconds, progress):
        progress(seconds)
        self.lengths.append(seconds)
        self.heard = steady_feed(self.testbed.topics[TENSION], RATE, seconds)
        if seconds != REST_S:
            i = self.testbed.cable_names.index(self.answering[self.pulled])
            self.heard.rows[:, i] += HAND
        self.patience -= 1
        return self.patience >= 0

    def observations(self):
        return [self.heard.observation()]


class Person:
    """Presses one key at each question; `hasty` ones press one before it, too."""

    def __init__(self, machine, presses, hasty=False):
        self.machine, self.presses = machine, list(presses)
        self.answers = [[], ["\n", "s"]] if hasty else []

    def read(self):
        if not self.answers:
            cable, key = self.presses.pop(0) if self.presses else (None, "q")
            self.machine.pulled = cable
            self.answers = [["x", key], [], []]
        return self.answers.pop()


@pytest.fixture
def guided(thesis):
    def guide(answering, presses, **options):
        machine = Machine(thesis, answering, options.pop("patience", np.inf))
        person = Person(machine, presses, **options)
        console = Console(file=io.StringIO(), width=60)
        guide = GuidedPull(thesis, machine, person, console, SECONDS)
        found = guide.run([cable for cable, _ in presses])
        return found, console.file.getvalue(), machine

    return guide


RIGHT = {"hoist_1": "hoist_1", "sway_1": "sway_1", "sway_2": "sway_2"}
SWAPPED = {**RIGHT, "sway_1": "sway_2", "sway_2": "sway_1"}


def test_each_cable_is_pulled_after_a_second_of_rest(guided):
    found, text, machine = guided(RIGHT, [("hoist_1", "\n"), ("sway_1", "\r")])
    assert [(each.cable, each.ok) for each in found.verdicts] == [
        ("hoist_1", True),
        ("sway_1", True),
    ]
    assert (found.ok, found.complete, found.swapped) == (True, True, [])
    assert machine.lengths == [REST_S, SECONDS] * 2
    assert "1 of 2: let all drives hold and stop all controllers; then pull cable hoist_1" in text
    first = text.index("hands off\n")
    assert text.index("Enter: begin") < first < text.index("pull hoist_1 now\n")
    assert "ok pulled hoist_1: its tension rose by 12" in text


def test_swapped_cables_are_named_at_the_end(guided):
    found, text, _ = guided(SWAPPED, [("sway_1", "\n"), ("hoist_1", "\n"), ("sway_2", "\n")])
    assert not found.ok
    assert [each.ok for each in found.verdicts] == [False, True, False]
    assert "error pulled sway_1, but the tension of sway_2 rose by 12" in text
    assert text.rstrip().endswith("error tension of sway_1 and sway_2 are swapped")


def test_a_cable_may_be_left_out(guided):
    found, _, machine = guided(RIGHT, [("hoist_1", "s"), ("sway_1", "\n")])
    assert [each.cable for each in found.verdicts] == ["sway_1"]
    assert found.complete
    assert machine.lengths == [REST_S, SECONDS]


def test_the_test_may_be_ended(guided):
    found, _, machine = guided(SWAPPED, [("sway_1", "\n"), ("sway_2", "q"), ("hoist_1", "\n")])
    assert [each.cable for each in found.verdicts] == ["sway_1"]
    assert (found.complete, found.ok, found.swapped) == (False, False, [])
    assert machine.lengths == [REST_S, SECONDS]


@pytest.mark.parametrize("patience", [0, 1, 2])
def test_a_signal_ends_it_wherever_it_comes(guided, patience):
    found, _, _ = guided(RIGHT, [("hoist_1", "\n"), ("sway_1", "\n")], patience=patience)
    assert (found.verdicts, found.complete, found.ok) == ([], False, True)


def test_keys_pressed_before_the_question_do_not_count(guided):
    found, _, _ = guided(RIGHT, [("hoist_1", "\n")], hasty=True)
    assert [each.cable for each in found.verdicts] == ["hoist_1"]


class TestWindow:
    def rows(self, testbed, topic, change=lambda rows: rows):
        rng = np.random.default_rng(3)
        rows = change(rng.normal(5.0, 1.0, (20, topic.width)))
        stamps = np.arange(20, dtype=np.int64) * 10_000_000
        feed = Feed(topic, stamps, stamps, rows)
        return rows, window_of(testbed, [feed.observation()])

    def test_rows_are_those_sent(self, thesis):
        rows, window = self.rows(thesis, thesis.topics[WINCHES])
        np.testing.assert_array_equal(window[WINCHES], rows)

    def test_names_in_another_order_are_put_right(self, thesis):
        names = thesis.cable_names[::-1]
        topic = contract_topics(names, has_bar=True, has_winch_frame=True)[TENSION]
        rows, window = self.rows(thesis, topic)
        np.testing.assert_array_equal(window[TENSION], rows[:, ::-1])

    def test_rows_with_a_number_that_is_not_finite_are_left_out(self, thesis):
        def spoiled(rows):
            rows[3, 1], rows[7, 0] = np.nan, np.inf
            return rows

        rows, window = self.rows(thesis, thesis.topics[TENSION], spoiled)
        np.testing.assert_array_equal(window[TENSION], np.delete(rows, [3, 7], axis=0))

    def test_parts_that_are_absent_are_zero(self, thesis):
        full = thesis.topics[WINCHES]
        topic = type(full)(
            full.name, full.ros_type, "", full.fields[:8], full.joint_names, ("position",)
        )
        rows, window = self.rows(thesis, topic)
        np.testing.assert_array_equal(window[WINCHES][:, :8], rows)
        assert not window[WINCHES][:, 8:].any()

    def test_other_topics_are_not_looked_at(self, thesis, rig):
        heard = Observation("/camera", "sensor_msgs/msg/Image", 1, [(1, b"x")])
        pose = Observation("/bar/pose", "geometry_msgs/msg/PoseStamped", 1, [(1, b"x")])
        assert window_of(thesis, [heard]) == {}
        assert window_of(rig, [pose]) == {}


def test_cables_are_named_or_all(thesis, rig):
    assert pulled_cables("all", thesis) == thesis.cable_names
    assert pulled_cables("sway_1,hoist_2", thesis) == ("sway_1", "hoist_2")
    with pytest.raises(InputError, match=r"^--pull sway_9: no such cable, allowed: all, hoist_1, "):
        pulled_cables("hoist_1,sway_9", thesis)
    with pytest.raises(InputError, match=r"^--pull : no such cable, allowed: all, only$"):
        pulled_cables("", rig)
