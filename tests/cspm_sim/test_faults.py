"""What faults do to messages, torques and brakes, and when they begin and end."""

import numpy as np
import pytest

from cspm_msgs_py.errors import InputError
from cspm_msgs_py.scenario_keys.faults import KINDS, ONLY_IN_REAL_TIME, Fault
from cspm_msgs_py.yaml_file import validate
from cspm_sim.faults import Faults

MS = 1_000_000
POSE = np.array([0.1, 0.2, 1.5, 0.0, 0.0, 0.6, 0.8])
TENSION = "/cables/tension"


def faults(testbed, *timetable, realtime=True, **options):
    made = [validate(Fault, each, "fault") for each in timetable]
    return Faults(made, testbed, 7, realtime=realtime, **options)


def sent(board, topic, rows, begin=0):
    """Return what comes of a message a millisecond, as (instant, stamp, row)."""
    found = []
    for i, row in enumerate(rows):
        now = (begin + i) * MS
        board.advance(now)
        message = None if row is None else (now, np.asarray(row, dtype=float))
        found += [
            (now // MS, stamp // MS, made) for stamp, made in board.sensed(topic, now, message)
        ]
    return found


def rows(count):
    return [POSE + np.eye(7)[0] * i for i in range(count)]


def test_without_a_fault_everything_passes(thesis):
    found = sent(faults(thesis), "/bar/pose", rows(3))
    assert [(now, stamp) for now, stamp, _ in found] == [(0, 0), (1, 1), (2, 2)]
    assert (np.array([row for *_, row in found]) == rows(3)).all()


def test_a_frozen_sensor_repeats_its_row_with_new_stamps(thesis):
    board = faults(
        thesis, {"fault": "sensor_frozen", "on": "/bar/pose", "at": 0.002, "lasts": 0.003}
    )
    found = sent(board, "/bar/pose", rows(7))
    assert [stamp for _, stamp, _ in found] == [*range(7)]
    assert [round(row[0] - POSE[0]) for *_, row in found] == [0, 1, 2, 2, 2, 5, 6]


def test_other_topics_are_left_alone(thesis):
    board = faults(thesis, {"fault": "sensor_dropped", "on": "/bar/pose"})
    assert sent(board, "/bar/pose", rows(3)) == []
    assert len(sent(board, "/winch_frame/pose", rows(3), begin=3)) == 3


def test_a_dropped_message_is_missing_while_it_lasts(thesis):
    board = faults(
        thesis, {"fault": "sensor_dropped", "on": "/bar/pose", "at": 0.001, "lasts": 0.002}
    )
    assert [stamp for _, stamp, _ in sent(board, "/bar/pose", rows(5))] == [0, 3, 4]


def test_a_late_message_keeps_its_stamp(thesis):
    late = {"fault": "sensor_late", "on": "/bar/pose", "amount": 0.002}
    found = sent(faults(thesis, late), "/bar/pose", [*rows(3), None, None])
    assert [(now, stamp) for now, stamp, _ in found] == [(2, 0), (3, 1), (4, 2)]


def test_a_biased_pose_is_displaced_and_its_quaternion_stays_one(thesis):
    bias = {"fault": "sensor_biased", "on": "/bar/pose", "amount": -0.01}
    ((*_, row),) = sent(faults(thesis, bias), "/bar/pose", [POSE])
    assert row == pytest.approx([0.09, 0.19, 1.49, *POSE[3:]])
    bias = {"fault": "sensor_biased", "on": TENSION, "amount": 2.0}
    ((*_, row),) = sent(faults(thesis, bias), TENSION, [np.arange(8.0)])
    assert row == pytest.approx(np.arange(8.0) + 2.0)


def test_noise_has_its_deviation_and_the_runs_seed(thesis):
    noisy = {"fault": "sensor_noisy", "on": TENSION, "amount": 0.5}
    found = [
        np.array([row for *_, row in sent(faults(thesis, noisy), TENSION, [np.zeros(8)] * 500)])
        for _ in range(2)
    ]
    assert (found[0] == found[1]).all()
    assert found[0].std() == pytest.approx(0.5, rel=0.05)
    assert found[0].mean() == pytest.approx(0.0, abs=0.05)


def test_a_weak_winch_has_a_share_of_its_torque(thesis):
    board = faults(thesis, {"fault": "winch_weak", "on": "surge_2", "amount": 0.5, "at": 0.001})
    asked = np.ones(8)
    board.advance(0)
    assert (board.torque(asked) == 1.0).all()
    board.advance(MS)
    i = thesis.cable_names.index("surge_2")
    assert board.torque(asked)[i] == 0.5
    assert (np.delete(board.torque(asked), i) == 1.0).all()
    assert (asked == 1.0).all()


def test_the_brake_is_set_while_it_lasts(thesis):
    board = faults(thesis, {"fault": "brake", "at": 0.001, "lasts": 0.002})
    found = []
    for i in range(5):
        board.advance(i * MS)
        found.append(board.brake)
    assert found == [False, True, True, False, False]


def test_a_cut_is_named_once(thesis):
    board = faults(thesis, {"fault": "cable_cut", "on": "hoist_1", "at": 0.001})
    assert [board.advance(i * MS) for i in range(3)] == [[], ["hoist_1"], []]


def test_what_is_put_in_begins_at_the_next_step(thesis):
    board = faults(thesis)
    board.advance(5 * MS)
    board.put(Fault(fault="brake", lasts=0.001), "fault")
    assert not board.brake
    board.advance(6 * MS)
    assert board.brake
    board.advance(7 * MS)
    assert not board.brake
    brake = "brake, for 0.001 s"
    events = f"began at 0.006 s: {brake}; ended at 0.007 s: {brake}"
    assert board.described() == {"faults": "", "fault_events": events}
    assert board.described() == {"faults": "", "fault_events": ""}


@pytest.mark.parametrize(
    ("fault", "line"),
    [
        (
            {"fault": "sensor_frozen", "on": "/nose"},
            "on /nose, allowed: /winch_frame/pose, /bar/pose, /winches/state, /cables/tension",
        ),
        ({"fault": "brake", "on": "surge_2"}, "on surge_2, allowed for brake: nothing"),
        (
            {"fault": "winch_weak", "on": "surge_2"},
            "amount None, allowed for winch_weak: remaining share of the torque",
        ),
        (
            {"fault": "sensor_frozen", "on": "/bar/pose", "amount": 1.0},
            "amount 1.0, allowed for sensor_frozen: none",
        ),
        (
            {"fault": "winch_weak", "on": "surge_2", "amount": 1.5},
            "amount 1.5, allowed: 0 to 1, remaining share of the torque",
        ),
        (
            {"fault": "sensor_late", "on": "/bar/pose", "amount": -1.0},
            "amount -1.0, allowed: by how much messages come later than their stamps say, s, 0 or"
            " more",
        ),
    ],
)
def test_what_cannot_fail_so_is_refused(thesis, fault, line):
    with pytest.raises(InputError) as caught:
        faults(thesis, fault)
    assert str(caught.value) == f"faults[0]: {line}"
    with pytest.raises(InputError) as caught:
        faults(thesis).put(validate(Fault, fault, "fault"), "fault")
    assert str(caught.value) == f"fault: {line}"


@pytest.mark.parametrize("kind", ONLY_IN_REAL_TIME)
def test_lockstep_waits_for_every_message(thesis, kind):
    fault = {"fault": kind, "on": "/bar/pose"}
    fault |= {"amount": 0.1} if kind == "sensor_late" else {}
    faults(thesis, fault)
    with pytest.raises(InputError, match=f"^faults\\[0\\]: {kind}, allowed in lockstep, where"):
        faults(thesis, fault, realtime=False)


def test_a_plant_that_cannot_cut_says_so(thesis):
    cut = {"fault": "cable_cut", "on": "hoist_1"}
    faults(thesis, cut)
    with pytest.raises(InputError) as caught:
        faults(thesis, cut, cuts=False)
    assert str(caught.value) == "faults[0]: this plant cannot cut a cable, allowed: plant sim"


def test_an_unknown_kind_is_refused_with_all_there_are():
    with pytest.raises(InputError) as caught:
        validate(Fault, {"fault": "gremlins"}, "fault")
    assert all(kind in str(caught.value) for kind in KINDS)
