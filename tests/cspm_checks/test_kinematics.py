"""Poses and encoders that tell of different motions, and what brings them together."""

import numpy as np
import pytest
from machine_logs import BAR, STATE, changed, healthy, later, read_as, told
from scipy.spatial.transform import Rotation

OFFSET = np.array([0.3, -0.2, 0.5])
AXES = {
    "y points up": np.array([[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]]),
    "z points up": np.diag([1.0, -1.0, -1.0]),
    "left-handed": np.diag([1.0, 1.0, -1.0]),
}


@pytest.fixture(scope="module")
def log():
    return healthy()[0]


def said(log):
    found = told(log, healthy()[1])
    return found[0] if len(found) == 1 else pytest.fail(f"{[one.text for one in found]}")


def test_a_healthy_machine_is_not_suspected(log):
    assert told(log, healthy()[1]) == []


@pytest.mark.parametrize("words", AXES)
def test_other_axes_are_named_with_the_columns_that_mend_them(log, words):
    axes = AXES[words]
    found = said(
        read_as(
            log,
            lambda places: places @ axes.T,
            lambda turns: Rotation.from_matrix(axes @ turns.as_matrix() @ axes.T),
        )
    )
    assert (found.where, found.kind) == (BAR, "axes")
    assert words in found.text
    back = found.mend["/bar/pose z"]
    assert back.get("of", "/bar/pose z") == ("/bar/pose y" if "y" in words[:1] else "/bar/pose z")
    assert back["sign"] == -1.0


def test_a_mirrored_axis_is_named(log):
    found = said(read_as(log, lambda places: places * [1.0, -1.0, 1.0], lambda turns: turns))
    assert "if y is mirrored" in found.text
    assert found.mend == {"/bar/pose y": {"sign": -1.0}}


def test_a_quaternion_with_w_first_is_named(log):
    def rolled(fields):
        x, y, z, w = (fields[name].copy() for name in ("qx", "qy", "qz", "qw"))
        for name, column in zip(("qx", "qy", "qz", "qw"), (w, x, y, z), strict=True):
            fields[name][:] = column

    found = said(changed(log, BAR, rolled))
    assert "if the quaternion's columns are in the order w, x, y, z" in found.text
    assert found.mend["/bar/pose qw"] == {"of": "/bar/pose qx"}


def test_an_inverse_quaternion_and_a_moved_origin_are_named(log):
    inverse = said(read_as(log, lambda places: places, lambda turns: turns.inv()))
    assert "(its inverse)" in inverse.text
    turn = Rotation.from_euler("z", 25.0, degrees=True)
    moved = said(read_as(log, lambda at: turn.apply(at) + OFFSET, lambda one: turn * one))
    assert "another origin?" in moved.text
    assert moved.numbers["angle"] == pytest.approx(25.0, abs=1.0)


def test_exchanged_encoders_are_named_and_those_of_a_survey_are_not(log):
    names = [f"position/{name}" for name in healthy()[1].cable_names]

    def exchange(fields):
        fields[names[0]][:], fields[names[2]][:] = (
            fields[names[2]].copy(),
            fields[names[0]].copy(),
        )

    found = said(changed(log, STATE, exchange))
    assert found.kind == "exchanged"
    assert found.mend[f"{STATE} {names[0]}"] == {"of": f"{STATE} {names[2]}"}

    def drum(fields):
        fields[names[1]] *= 1.02

    assert told(changed(log, STATE, drum), healthy()[1]) == []
    place = {axis: 0.005 for axis in "xyz"}

    def survey(fields):
        for axis, off in place.items():
            fields[axis] += off

    assert told(changed(log, BAR, survey), healthy()[1]) == []


@pytest.mark.parametrize("since", [0.0, 0.3, 0.9])
def test_an_encoder_that_counts_backwards_is_named_with_its_instant(log, since):
    field = f"position/{healthy()[1].cable_names[2]}"

    def backwards(fields):
        at = round(since * len(fields[field]))
        fields[field][at:] = 2.0 * fields[field][at] - fields[field][at:]

    found = said(changed(log, STATE, backwards))
    assert (found.where, found.kind) == (f"{STATE} {field}", "reversed")
    if since:
        assert found.numbers["from"] == pytest.approx(14.0 * since, abs=0.1)
    else:
        assert found.mend == {f"{STATE} {field}": {"sign": -1.0}}


def test_an_encoder_off_by_a_factor_is_named(log):
    field = f"position/{healthy()[1].cable_names[1]}"

    def double(fields):
        fields[field] *= 2.0

    found = said(changed(log, STATE, double))
    assert (found.where, found.kind) == (f"{STATE} {field}", "factor")
    assert found.numbers["factor"] == pytest.approx(2.0, rel=0.02)


@pytest.mark.parametrize("late", [5.0, -3.3, 0.6])
def test_poses_seconds_late_are_named(log, late):
    found = said(later(log, BAR, late))
    assert found.kind == "late"
    assert found.numbers["seconds"] == pytest.approx(late, abs=0.01)
    assert found.mend[BAR]["offset_s"] == -found.numbers["seconds"]


def test_poses_of_another_motion_are_told_as_contradicting(log):
    def other(fields):
        for name in "xyz":
            fields[name][:] = fields[name][::-1]

    found = said(changed(log, BAR, other))
    assert found.kind == "kinematics"
    assert "no other axes, order or sign fit" in found.text
