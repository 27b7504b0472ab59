"""Cables over swivelling pulleys and in several parts, by two independent roads."""

import itertools

import mujoco
import numpy as np
import pytest
from machines import build, changed, general_content, pulley_content
from scipy.optimize import brentq
from scipy.spatial.transform import Rotation

from cspm_model.kinematics import geometry
from cspm_model.parameters import nominal_parameters
from cspm_msgs_py.errors import InputError, SingularityError

BAR = np.array([0.1, -0.05, 1.9, 0.2, 0.1, -0.3])
FRAME = np.array([0.02, 0.03, -0.04, 0.05, -0.1, 0.2])
PULLEYS = pulley_content()


def matrix(pose):
    return Rotation.from_euler("ZYX", pose[:2:-1]).as_matrix()


def ends(cable):
    """Exit, attachment and swivel axis in world axes."""
    base = matrix(FRAME)
    axis = base @ np.array(cable["pulley"]["axis"], dtype=float)
    start = FRAME[:3] + base @ cable["exit"]
    return start, BAR[:3] + matrix(BAR) @ cable["attachment"], axis / np.linalg.norm(axis)


def rim(cable):
    """The pulley's rim by the angle that the cable winds, and the side's normal, world axes."""
    start, end, axis = ends(cable)
    apart = end - start
    outward = apart - (apart @ axis) * axis
    outward /= np.linalg.norm(outward)
    side, radius = np.cross(axis, outward), cable["pulley"]["radius"]
    return (
        lambda angle: (
            start + radius * outward + Rotation.from_rotvec(angle * side).apply(-radius * outward)
        ),
        side,
    )


def by_tangency(cable):
    """Length and direction from where the line to the attachment touches the rim."""
    (_, end, axis), (point, side) = ends(cable), rim(cable)

    def off(angle):
        tangent = Rotation.from_rotvec(angle * side).apply(axis)
        return float(np.cross(tangent, end - point(angle)) @ side)

    grid = np.linspace(0.0, 2.0 * np.pi, 200)
    roots = [
        brentq(off, a, b, xtol=1e-14) for a, b in itertools.pairwise(grid) if off(a) * off(b) <= 0.0
    ]
    # Of the two tangents one runs in the sense in which the cable winds.
    for angle in roots:
        line, tangent = end - point(angle), Rotation.from_rotvec(angle * side).apply(axis)
        if line @ tangent > 0.0:
            free = np.linalg.norm(line)
            return cable["pulley"]["radius"] * angle + free, line / free
    raise AssertionError("no tangent")


def by_mujoco(cable):
    """Length by MuJoCo's tendon around a cylinder; its first millimetre enters along the axis."""
    (start, end, axis), (_, side) = ends(cable), rim(cable)
    radius = cable["pulley"]["radius"]
    outward = np.cross(side, axis)
    turn = Rotation.from_matrix(np.column_stack([outward, axis, np.cross(outward, axis)]))
    quaternion = turn.as_quat()[[3, 0, 1, 2]]
    # On the way in the cable runs a hair outside, or it would cut the rim by round-off.
    before = start - 1e-3 * axis - 1e-9 * outward

    def text(values):
        return " ".join(repr(float(v)) for v in values)

    model = mujoco.MjModel.from_xml_string(
        f"""<mujoco><worldbody>
        <site name="a" pos="{text(before)}"/><site name="b" pos="{text(end)}"/>
        <site name="side" pos="{text(start + radius * outward + 3 * radius * (axis + outward))}"/>
        <geom name="rim" type="cylinder" size="{radius} 0.01" quat="{text(quaternion)}"
          pos="{text(start + radius * outward)}"/></worldbody>
        <tendon><spatial name="cable"><site site="a"/><geom geom="rim" sidesite="side"/>
        <site site="b"/></spatial></tendon></mujoco>"""
    )
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    return float(data.ten_length[0]) - 1e-3


@pytest.mark.parametrize("i", [0, 2, 4, 6])
def test_length_and_direction_are_those_of_the_tangent(i):
    cable = PULLEYS["cables"][i]
    found = geometry(nominal_parameters(build(PULLEYS)).cables, BAR, FRAME)
    length, direction = by_tangency(cable)
    parts = cable.get("parts", 1)
    assert found.lengths[i] == pytest.approx(parts * length, abs=1e-12)
    assert found.bar[i, :3] == pytest.approx(parts * direction, abs=1e-11)


@pytest.mark.parametrize("i", [0, 2, 4, 6])
def test_length_is_that_of_a_tendon_around_a_cylinder(i):
    cable = PULLEYS["cables"][i]
    found = geometry(nominal_parameters(build(PULLEYS)).cables, BAR, FRAME).lengths[i]
    assert found / cable.get("parts", 1) == pytest.approx(by_mujoco(cable), abs=1e-11)


def test_a_small_pulley_is_an_exit_and_a_large_one_is_not():
    straight = geometry(nominal_parameters(build(general_content())).cables, BAR, FRAME)

    def lengths(radius):
        content = changed(
            general_content(), "cables.0.pulley", {"radius": radius, "axis": [0, 0, -1]}
        )
        return geometry(nominal_parameters(build(content)).cables, BAR, FRAME).lengths

    assert lengths(1e-4) == pytest.approx(straight.lengths, abs=3e-4)
    assert lengths(0.05)[0] - straight.lengths[0] > 0.05
    assert lengths(0.05)[1:] == pytest.approx(straight.lengths[1:], abs=0.0)


def test_several_parts_are_that_many_times_the_length_and_the_pull():
    one = geometry(nominal_parameters(build(general_content())).cables, BAR, FRAME)
    content = changed(general_content(), "cables.3.parts", 4)
    four = geometry(nominal_parameters(build(content)).cables, BAR, FRAME)
    factor = np.array([1, 1, 1, 4, 1, 1, 1, 1])
    for found, single in zip(four, one, strict=True):
        np.testing.assert_allclose(found.T, single.T * factor, atol=1e-14)


def test_an_attachment_inside_its_pulley_is_refused():
    content = changed(general_content(), "cables.1.pulley", {"radius": 3.0, "axis": [1, 0, 0]})
    with pytest.raises(SingularityError) as caught:
        geometry(nominal_parameters(build(content)).cables, BAR, FRAME)
    place = ", ".join(f"{value:.4g}" for value in BAR)
    assert str(caught.value) == (
        f"cable 1: its attachment lies inside its pulley with the bar at [{place}] (m, rad),"
        " allowed: outside its radius of 3 m"
    )


@pytest.mark.parametrize(
    ("path", "value", "message"),
    [
        ("cables.0.pulley", {"radius": 0.02, "axis": [0, 0, 0]}, "allowed: three finite numbers"),
        ("cables.0.pulley", {"radius": 0.0, "axis": [0, 0, 1]}, "radius: 0.0, allowed: "),
        ("cables.0.parts", 0, "parts: 0, allowed: "),
        ("cables.0.parts", 17, "parts: 17, allowed: "),
    ],
)
def test_what_is_no_pulley_is_refused(path, value, message):
    with pytest.raises(InputError) as caught:
        build(changed(general_content(), path, value))
    assert str(caught.value).startswith("test.yaml: cables[0].p")
    assert message in str(caught.value)


@pytest.mark.parametrize("extra", [{"pulley": {"radius": 0.02, "axis": [0, 0, 1]}}, {"parts": 2}])
def test_a_winch_without_cable_has_neither(extra):
    winch = {"name": "w", "drum_radius": 0.02, "rotor_inertia": 1e-4, "torque_limit": 1.0}
    with pytest.raises(InputError, match=r"of w, a winch without cable, allowed: none$"):
        build({"name": "bare", "cables": [{**winch, **extra}]})
