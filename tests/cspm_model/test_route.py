"""Cables along routes: by root finding, virtual work, MuJoCo's tendons and the short forms."""

import itertools

import mujoco
import numpy as np
import pytest
from machines import build, changed, general_content, pulley_content, route_content, routed, stop
from scipy.optimize import root
from scipy.spatial.transform import Rotation

from cspm_model.kinematics import geometry
from cspm_model.parameters import nominal_parameters
from cspm_msgs_py.errors import InputError, SingularityError

BAR = np.array([0.1, -0.05, 1.9, 0.2, 0.1, -0.3])
FRAME = np.array([0.02, 0.03, -0.04, 0.05, -0.1, 0.2])
GENERAL = general_content()["cables"]


def spans(content, bar=BAR, frame=FRAME):
    return geometry(nominal_parameters(build(content)).cables, bar, frame)


def with_route(*stops, **first):
    """The general machine with a route on its first cable."""
    content = general_content()
    content["cables"][0] = routed(content["cables"][0], *stops, **first)
    return content


def there(each):
    """A stop's place in the world."""
    pose = BAR if each["on"] == "bar" else FRAME
    return pose[:3] + Rotation.from_euler("ZYX", pose[:2:-1]).apply(each["at"])


def by_tangents(route):
    """Length and the bar's wrench per newton, from where lines touch the rims.

    Unknown are the two points where the cable touches each pulley: on its rim, their lines tangent,
    in the plane of its centre and what comes before and behind.
    """
    places = [there(each) for each in route]
    rims = {k: each["radius"] for k, each in enumerate(route) if "radius" in each}

    def touched(unknown):
        points = [(place, place) for place in places]
        for (k, radius), both in zip(rims.items(), unknown.reshape(-1, 2, 3), strict=True):
            points[k] = tuple(places[k] + radius * both)
        return points

    def off(unknown):
        points, left = touched(unknown), []
        for k, both in zip(rims, unknown.reshape(-1, 2, 3), strict=True):
            lines = points[k][0] - points[k - 1][1], points[k + 1][0] - points[k][1]
            normal = np.cross(points[k - 1][1] - places[k], points[k + 1][0] - places[k])
            for line, rim in zip(lines, both, strict=True):
                left += [rim @ rim - 1.0, line @ rim, rim @ normal]
        return left

    guess = []
    for k in rims:
        ways = [places[j] - places[k] for j in (k - 1, k + 1)]
        ways = [way / np.linalg.norm(way) for way in ways]
        outward = [-sum(ways) + (sum(ways) @ way) * way for way in ways]
        guess += [each / np.linalg.norm(each) for each in outward]
    found = np.zeros(0)
    if rims:
        found = root(off, np.ravel(guess), tol=1e-14).x
        assert np.abs(off(found)).max() < 1e-11
    points = touched(found)
    return _along(route, points, rims, found.reshape(-1, 2, 3))


def _along(route, points, rims, touching):
    length, wrench = 0.0, np.zeros(6)
    for (a, one), (b, other) in itertools.pairwise(zip(route, points, strict=True)):
        line = other[0] - one[1]
        free = np.linalg.norm(line)
        length += free
        for each, at, sign in ((a, one[1], 1.0), (b, other[0], -1.0)):
            if each["on"] == "bar":
                force = sign * line / free
                wrench += np.concatenate([force, np.cross(at - BAR[:3], force)])
    for radius, (first, last) in zip(rims.values(), touching, strict=True):
        length += radius * np.arctan2(np.linalg.norm(np.cross(first, last)), first @ last)
    return length, wrench


ROUTES = {
    "dead end on the frame": [stop("bar", (0.4, 0.15, -0.05)), stop("frame", (0.6, 0.9, -0.3))],
    "dead end on the bar": [
        stop("bar", (0.4, 0.15, -0.05), radius=0.05),
        stop("frame", (0.6, 0.9, -0.3), radius=0.04),
        stop("bar", (0.3, 0.2, 0.0)),
    ],
    "in a row on the frame": [
        stop("frame", (0.3, 0.6, -0.35), radius=0.06),
        stop("bar", (0.4, 0.15, -0.05)),
    ],
    "tackle": [
        stop("bar", (0.4, 0.15, -0.05), radius=0.05),
        stop("frame", (0.6, 0.9, -0.3), radius=0.04),
        stop("bar", (0.1, 0.2, 0.0), radius=0.08),
        stop("frame", (0.2, 0.9, -0.35)),
    ],
    "in a row on the bar": [
        stop("bar", (0.4, 0.15, -0.05), radius=0.05),
        stop("bar", (-0.1, 0.1, -0.02), radius=0.05),
        stop("frame", (-0.3, 0.9, -0.3)),
    ],
}


@pytest.mark.parametrize("name", ROUTES)
def test_length_and_wrench_are_those_of_lines_that_touch_the_rims(name):
    found = spans(with_route(*ROUTES[name]))
    length, wrench = by_tangents([stop("frame", GENERAL[0]["exit"]), *ROUTES[name]])
    assert found.lengths[0] == pytest.approx(length, abs=1e-11)
    assert -found.bar[0] == pytest.approx(wrench, abs=1e-10)


def moved(pose, axis, step):
    """A pose a little further along x, y, z or turned about them, world axes."""
    place, turn = np.zeros(3), np.zeros(3)
    (place if axis < 3 else turn)[axis % 3] = step
    turned = Rotation.from_rotvec(turn) * Rotation.from_euler("ZYX", pose[:2:-1])
    return np.concatenate([pose[:3] + place, turned.as_euler("ZYX")[::-1]])


def test_virtual_work_of_both_bodies_is_that_of_the_tension():
    content, step = route_content(), 1e-5
    found = spans(content)
    for axis in range(6):
        by_bar = [spans(content, moved(BAR, axis, s), FRAME).lengths for s in (step, -step)]
        by_frame = [spans(content, BAR, moved(FRAME, axis, s)).lengths for s in (step, -step)]
        for rows, (after, before) in ((found.bar, by_bar), (found.frame, by_frame)):
            assert rows[:, axis] == pytest.approx((after - before) / (2.0 * step), abs=1e-9)


def by_mujoco(route):
    """Length of MuJoCo's tendon: spheres between sites, each with a site on its far side."""
    bodies, path = [], []
    places = [there(each) for each in route]
    for k, (each, place) in enumerate(zip(route, places, strict=True)):
        at = " ".join(repr(float(v)) for v in place)
        if "radius" not in each:
            bodies.append(f'<site name="s{k}" pos="{at}"/>')
            path.append(f'<site site="s{k}"/>')
            continue
        far = 2.0 * place - 0.5 * (places[k - 1] + places[k + 1])
        beside = " ".join(repr(float(v)) for v in far)
        bodies.append(f'<geom name="g{k}" type="sphere" size="{each["radius"]}" pos="{at}"/>')
        bodies.append(f'<site name="f{k}" pos="{beside}"/>')
        path.append(f'<geom geom="g{k}" sidesite="f{k}"/>')
    model = mujoco.MjModel.from_xml_string(
        f"<mujoco><worldbody>{''.join(bodies)}</worldbody><tendon><spatial>{''.join(path)}"
        "</spatial></tendon></mujoco>"
    )
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    return float(data.ten_length[0])


def test_length_is_that_of_a_tendon_between_sites_around_spheres():
    stops = [
        stop("bar", (0.4, 0.15, -0.05), radius=0.05),
        stop("frame", (0.6, 0.9, -0.3)),
        stop("bar", (0.1, 0.2, 0.0), radius=0.08),
        stop("frame", (0.2, 0.9, -0.35)),
    ]
    length = by_mujoco([stop("frame", GENERAL[0]["exit"]), *stops])
    assert spans(with_route(*stops)).lengths[0] == pytest.approx(length, abs=1e-11)


def test_each_arc_counts_once():
    """A pulley of radius r hangs h below two points 2r apart: 2h + πr, pulled twice."""
    level = [0.0] * 6
    content = with_route(stop("bar", (0.0, 0.0, 0.0), radius=0.1), stop("frame", (1.0, 0.8, -0.4)))
    content = changed(content, "cables.0.route.0.at", [0.8, 0.8, -0.4])
    found = spans(content, np.array([0.9, 0.8, 1.6, 0.0, 0.0, 0.0]), np.array(level))
    assert found.lengths[0] == pytest.approx(4.0 + 0.1 * np.pi, abs=1e-12)
    assert found.bar[0] == pytest.approx([0.0, 0.0, 2.0, 0.0, 0.0, 0.0], abs=1e-12)


def test_a_route_of_exit_and_attachment_is_a_cable_without_one():
    straight, pulleys = spans(general_content()), spans(pulley_content())
    end = stop("bar", GENERAL[0]["attachment"])
    for found, wanted in zip(spans(with_route(end)), straight, strict=True):
        np.testing.assert_array_equal(found, wanted)
    content = pulley_content()
    cable = {k: v for k, v in content["cables"][2].items() if k != "pulley"}
    end = stop("bar", cable["attachment"])
    content["cables"][2] = routed(cable, end, **content["cables"][2]["pulley"])
    for found, wanted in zip(spans(content), pulleys, strict=True):
        np.testing.assert_array_equal(found, wanted)


@pytest.mark.parametrize("parts", [2, 3, 4])
def test_parts_are_the_short_form_of_a_route_to_and_fro(parts):
    short = spans(changed(general_content(), "cables.0.parts", parts))
    ends = itertools.cycle(
        [stop("bar", GENERAL[0]["attachment"]), stop("frame", GENERAL[0]["exit"])]
    )
    long = spans(with_route(*itertools.islice(ends, parts)))
    for found, wanted in zip(long, short, strict=True):
        np.testing.assert_allclose(found, wanted, atol=1e-14)


def test_a_route_through_a_pulley_is_refused():
    content = with_route(stop("bar", (0.4, 0.1, 0.0), radius=3.0), stop("frame", (0.6, 0.9, -0.3)))
    with pytest.raises(SingularityError) as caught:
        spans(content)
    place = ", ".join(f"{value:.4g}" for value in BAR)
    assert str(caught.value) == (
        f"cable 0: its route leads through a pulley with the bar at [{place}] (m, rad), allowed:"
        " stops outside of pulleys"
    )


BLOCK = [
    stop("frame", (0.9, 0.8, -0.4)),
    stop("bar", (0.4, 0.1, 0.0)),
    stop("frame", (0.6, 0.9, 0)),
]


@pytest.mark.parametrize(
    ("path", "value", "message"),
    [
        ("route.0.on", "bar", "route[0].on: bar, of c0, allowed: frame, where its winch is"),
        ("route.1.on", "frame", "on the frame alone, allowed: at least one stop on bar"),
        ("route.1.on", "mast", "'mast', allowed: 'frame' or 'bar'"),
        ("route.2.radius", 0.1, "route[2].radius: 0.1 m of c0, allowed: none at its dead end"),
        ("route.1.axis", [0, 0, 1], "route[1].axis: of c0, allowed: of a pulley at the exit alone"),
        ("route.0.radius", 0.1, "route[0].axis: missing for c0, allowed: the direction in which"),
        ("route.0.axis", [0, 0, 0], "allowed: three finite numbers, not all 0"),
        ("route", BLOCK[:1], "route: "),
        (
            "route",
            [BLOCK[0], BLOCK[1], BLOCK[1]],
            "0 m from the stop before it, allowed: more than",
        ),
        ("parts", 2, "parts: of c0, which has a route, allowed: its stops say it"),
        ("exit", [0, 0, 1], "exit: of c0, which has a route, allowed: none"),
    ],
)
def test_what_is_no_route_is_refused_in_one_line(path, value, message):
    content = with_route(*BLOCK[1:])
    build(content)
    with pytest.raises(InputError) as caught:
        build(changed(content, f"cables.0.{path}", value))
    assert str(caught.value).startswith("test.yaml: cables[0]")
    assert message in str(caught.value)
    assert "\n" not in str(caught.value)
