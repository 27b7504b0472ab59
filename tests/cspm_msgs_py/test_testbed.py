import hashlib

import numpy as np
import pytest
from machines import (
    EXPONENTIAL,
    LINEAR,
    THESIS,
    WINCH,
    build,
    cable,
    changed,
    general_content,
    point_content,
    rig_content,
)

from cspm_msgs_py.errors import InputError
from cspm_msgs_py.testbed import Inertia, load_testbed, parse_testbed
from cspm_msgs_py.yaml_file import dump_yaml
from cspm_sim.parameters import plant_parameters

RIG, GENERAL = rig_content(), general_content()
NAN, INF = float("nan"), float("inf")
C0 = "cables.0"


def refusal(content):
    with pytest.raises(InputError) as caught:
        build(content)
    line = str(caught.value)
    assert line.startswith("test.yaml: ")
    assert "\n" not in line
    return line.removeprefix("test.yaml: ")


def without(content, path):
    *parents, last = path.split(".")
    out = changed(content, path, None)
    node = out
    for key in parents:
        node = node[int(key) if key.isdigit() else key]
    del node[last]
    return out


VALUES = [
    ("bar.mass", -4.0, "bar.mass: -4.0, allowed: greater than 0"),
    ("bar.mass", 0, "bar.mass: 0, allowed: greater than 0"),
    ("bar.mass", NAN, "bar.mass: nan, allowed: a finite number"),
    ("bar.mass", INF, "bar.mass: inf, allowed: a finite number"),
    ("bar.mass", "4", "bar.mass: '4', allowed: a number"),
    ("bar.mass", True, "bar.mass: True, allowed: a number"),
    ("bar.com", [0, 0], "bar.com[2]: missing, a value is required"),
    ("bar.com", [0, 0, 0, 0], "bar.com: [0, 0, 0, 0], allowed: a list of at most 3"),
    ("bar.com", [0, NAN, 0], "bar.com[1]: nan, allowed: a finite number"),
    ("bar.dimensions", [1, 1, 0], "bar.dimensions[2]: 0, allowed: greater than 0"),
    ("bar.inertia.ixx", -0.1, "bar.inertia.ixx: -0.1, allowed: greater than 0"),
    (
        "bar.inertia",
        {"ixx": 1.0, "iyy": 1.0, "izz": 2.1},
        "bar.inertia: principal moments 1, 1, 2.1, allowed: positive and none larger than the sum"
        " of the other two",
    ),
    (
        "bar.inertia",
        {"ixx": 1.0, "iyy": 1.0, "izz": 1.0, "ixy": 1.2},
        "bar.inertia: principal moments -0.2, 1, 2.2, allowed: positive and none larger than the"
        " sum of the other two",
    ),
    ("gravity", -9.81, "gravity: -9.81, allowed: greater than or equal to 0"),
    ("name", "a b", "name: 'a b', allowed: text that matches ^[A-Za-z]"),
    ("bar", [], "bar: [], allowed: a mapping of keys to values"),
    ("cables", [], "cables: [], allowed: a list of at least 1"),
    ("cables", {}, "cables: {}, allowed: a list"),
    (f"{C0}.name", "c1", "cables[1].name: 'c1' occurs twice, allowed: each name once"),
    (f"{C0}.name", "", "cables[0].name: '', allowed: text that matches"),
    (
        f"{C0}.exit",
        [0.4, 0.15, -0.05],
        "cables[0].attachment: [0.4, 0.15, -0.05] equals the exit of c0, allowed: a point other"
        " than the exit",
    ),
    (f"{C0}.exit", [0, "0", 0], "cables[0].exit[1]: '0', allowed: a number"),
    (f"{C0}.exit", [0, 0, INF], "cables[0].exit[2]: inf, allowed: a finite number"),
    (f"{C0}.offset_length", -0.1, "cables[0].offset_length: -0.1, allowed: greater than or equal"),
    (f"{C0}.tension_limits", [5, 5], "cables[0].tension_limits: [5, 5], allowed: t_min < t_max"),
    (f"{C0}.tension_limits", [9, 5], "cables[0].tension_limits: [9, 5], allowed: t_min < t_max"),
    (f"{C0}.tension_limits", [-1, 5], "cables[0].tension_limits[0]: -1, allowed: greater than or"),
    (f"{C0}.tension_limits", [1, INF], "cables[0].tension_limits[1]: inf, allowed: a finite"),
    (f"{C0}.drum_radius", 0, "cables[0].drum_radius: 0, allowed: greater than 0"),
    (f"{C0}.gear_ratio", 0, "cables[0].gear_ratio: 0, allowed: greater than 0"),
    (f"{C0}.rotor_inertia", -1e-9, "cables[0].rotor_inertia: -1e-09, allowed: greater than 0"),
    (f"{C0}.torque_limit", 0.0, "cables[0].torque_limit: 0.0, allowed: greater than 0"),
    (f"{C0}.stiffness.law", "foo", "cables[0].stiffness.law: 'foo', allowed: 'exponential' or 'li"),
    (f"{C0}.stiffness.a", 0, "cables[0].stiffness.a: 0, allowed: greater than 0"),
    (f"{C0}.stiffness.b", -1, "cables[0].stiffness.b: -1, allowed: greater than or equal to 0"),
    (
        f"{C0}.stiffness.d",
        0.01,
        "cables[0].stiffness: c = 0.005, d = 0.01, allowed: d ≤ 0 ≤ c and d < c",
    ),
    (
        f"{C0}.stiffness.c",
        -0.01,
        "cables[0].stiffness: c = -0.01, d = -0.14, allowed: d ≤ 0 ≤ c and d < c",
    ),
    (
        f"{C0}.stiffness",
        {**EXPONENTIAL, "c": 0.0, "d": 0.0},
        "cables[0].stiffness: c = 0, d = 0, allowed: d ≤ 0 ≤ c and d < c",
    ),
    (f"{C0}.stiffness.floor_tension", 0, "cables[0].stiffness.floor_tension: 0, allowed: greater"),
    (
        f"{C0}.stiffness",
        {**LINEAR, "a": 1},
        "cables[0].stiffness.a: unknown key, allowed: law, you",
    ),
    (f"{C0}.damping.law", "foo", "cables[0].damping.law: 'foo', allowed: 'linear_in_length'"),
    (
        f"{C0}.damping.constant",
        -1,
        "cables[0].damping.constant: -1, allowed: greater than or equal",
    ),
    (f"{C0}.exit", None, "cables[0]: cable c0: without exit, allowed: all of exit, attachment,"),
    (
        C0,
        {"name": "bare", **WINCH},
        "cables[0].exit: missing for bare, allowed: a point, since a test-bed with a bar has a"
        " cable on each winch",
    ),
    (
        "sensors",
        {"/bar/pse": {"noise": [0, 0], "resolution": [0, 0], "rate": 100}},
        "sensors./bar/pse: no such sensor, allowed: /winch_frame/pose, /winch_frame/twist, /bar/"
        "pose, /bar/twist, /target/pose, /winches/state, /cables/tension",
    ),
    (
        "sensors",
        {"/bar/pose": {"noise": 0.1, "resolution": [0, 0], "rate": 100}},
        "sensors./bar/pose.noise: 1 numbers, allowed: 2 (position [m], orientation [rad])",
    ),
    (
        "sensors",
        {"/winches/state": {"noise": [0, 0, 0], "resolution": [0, 0], "rate": 100}},
        "sensors./winches/state.resolution: 2 numbers, allowed: 3 (angle [rad], speed [rad/s], tor",
    ),
    (
        "sensors",
        {"/cables/tension": {"noise": -0.1, "resolution": 0, "rate": 100}},
        "sensors./cables/tension.noise[0]: -0.1, allowed: greater than or equal to 0",
    ),
    (
        "sensors",
        {"/cables/tension": {"noise": 0, "resolution": 0, "rate": 0}},
        "sensors./cables/tension.rate: 0, allowed: greater than 0",
    ),
    (
        "sensors",
        {"/cables/tension": {"noise": 0, "resolution": 0, "rate": 100, "delay": -1e-3}},
        "sensors./cables/tension.delay: -0.001, allowed: greater than or equal to 0",
    ),
    ("effects", [{"effect": "x"}], "effects[0].parameters: missing, a value is required"),
    (
        "effects",
        [{"effect": "x", "parameters": {"a": INF}}],
        "effects[0].parameters.a: inf, allowed: a finite number",
    ),
]


@pytest.mark.parametrize(("path", "value", "text"), VALUES)
def test_implausible_values_are_refused(path, value, text):
    assert refusal(changed(GENERAL, path, value)).startswith(text)


@pytest.mark.parametrize(
    ("path", "text"),
    [
        ("name", "name: missing, a value is required"),
        ("cables", "cables: missing, a value is required"),
        ("bar.mass", "bar.mass: missing, a value is required"),
        ("bar.inertia.izz", "bar.inertia.izz: missing, a value is required"),
        (f"{C0}.drum_radius", "cables[0].drum_radius: missing, a value is required"),
        (f"{C0}.stiffness.law", "cables[0].stiffness.law: missing, allowed: 'exponential' or 'lin"),
        (f"{C0}.stiffness.a", "cables[0].stiffness.a: missing, a value is required"),
        (
            f"{C0}.damping",
            "cables[0]: cable c0: without damping, allowed: all of exit, attachment, stiffness,"
            " damping, tension_limits, or none for a winch without cable",
        ),
    ],
)
def test_missing_values_are_refused(path, text):
    assert refusal(without(GENERAL, path)).startswith(text)


@pytest.mark.parametrize(
    ("path", "text"),
    [
        (
            "gravty",
            "gravty: unknown key, allowed: name, gravity, bar, winch_frame, cables, sensors",
        ),
        ("bar.weight", "bar.weight: unknown key, allowed: mass, inertia, com, dimensions"),
        ("bar.inertia.iyx", "bar.inertia.iyx: unknown key, allowed: ixx, iyy, izz, ixy, ixz, iyz"),
        ("winch_frame.mass", "winch_frame.mass: unknown key, allowed: dimensions"),
        (
            f"{C0}.radius",
            "cables[0].radius: unknown key, allowed: name, exit, attachment, pulley",
        ),
        (
            f"{C0}.stiffness.e",
            "cables[0].stiffness.e: unknown key, allowed: law, a, b, c, d, youngs",
        ),
        (
            f"{C0}.damping.k",
            "cables[0].damping.k: unknown key, allowed: law, constant, slope, fact",
        ),
    ],
)
def test_unknown_keys_are_refused(path, text):
    assert refusal(changed(GENERAL, path, 1.0)).startswith(text)


def test_exit_and_attachment_may_have_equal_coordinates_in_different_frames():
    moving = {**RIG, "winch_frame": {}, "cables": [cable("c", (0, 0, 1), (0, 0, 1))]}
    assert build(moving).cables[0].exit == (0.0, 0.0, 1.0)
    text = refusal({**moving, "winch_frame": None})
    assert text.startswith("cables[0].attachment: [0.0, 0.0, 1.0] equals the exit of c, allowed: a")


@pytest.mark.parametrize("count", [1, 2, 3, 5, 13])
def test_any_number_of_cables_is_a_machine(count):
    cables = [cable(f"c{i}", (0.1 * i, 0, 0), (0, 0, 2)) for i in range(count)]
    testbed = build({"name": "many", "cables": cables})
    assert testbed.cable_names == tuple(f"c{i}" for i in range(count))
    assert plant_parameters(testbed).cables.shape[0] == count


@pytest.mark.parametrize("content", [RIG, point_content(), GENERAL])
def test_bar_winch_frame_and_sensors_may_be_absent(content):
    testbed = build(content)
    topics = testbed.topics
    assert ("/bar/pose" in topics) == ("bar" in content)
    assert ("/winch_frame/pose" in topics) == ("winch_frame" in content)
    assert testbed.sensors == {}


def test_a_winch_may_have_no_cable_where_there_is_no_bar():
    testbed = build({"name": "bench", "cables": [{"name": "w", **WINCH}]})
    assert not testbed.cables[0].has_cable
    assert build(RIG).cables[0].has_cable


def test_one_number_means_a_list_of_one():
    sensor = {"noise": 0.1, "resolution": [0.2], "rate": 100}
    testbed = build({**RIG, "sensors": {"/cables/tension": sensor}})
    assert testbed.sensors["/cables/tension"].noise == (0.1,)
    assert testbed.sensors["/cables/tension"].resolution == (0.2,)


@pytest.mark.parametrize("izz", [1.9, 2.0])
def test_a_flat_body_is_the_limit_of_inertia(izz):
    assert Inertia(ixx=1.0, iyy=1.0, izz=izz).matrix[2, 2] == izz


def test_products_of_inertia_fill_both_halves():
    matrix = build(GENERAL).bar.inertia.matrix
    assert (matrix == matrix.T).all()
    assert matrix[0].tolist() == [0.08, 0.015, -0.02]
    assert matrix[1, 2] == 0.01


def test_axial_rigidity_is_that_of_a_round_cable():
    law = build(RIG).cables[0].stiffness
    assert law.axial_rigidity == pytest.approx(8.721e9 * np.pi * (0.5e-3) ** 2, rel=1e-14)


def test_the_thesis_machine():
    file = load_testbed(THESIS)
    testbed = file.testbed
    assert testbed.cable_names == (
        *("hoist_1", "hoist_2", "surge_1", "surge_2"),
        *("sway_1", "sway_2", "sway_3", "sway_4"),
    )
    assert testbed.bar.mass == 4.06
    assert [cable.gear_ratio for cable in testbed.cables] == [10.0] * 2 + [1.0] * 6
    assert [cable.tension_limits for cable in testbed.cables] == (
        [(2.0, 60.0)] * 2 + [(2.0, 35.0)] * 2 + [(2.0, 15.0)] * 4
    )
    assert testbed.cables[7].exit == (-0.379, -0.398, -0.25)
    assert file.text == THESIS.read_text(encoding="utf-8")
    assert file.sha256 == hashlib.sha256(THESIS.read_bytes()).hexdigest()


def test_a_test_bed_that_is_written_and_read_is_the_same():
    again = parse_testbed(dump_yaml(GENERAL), "again.yaml").testbed
    assert again == build(GENERAL)


def test_files_that_cannot_be_read(tmp_path):
    empty, binary = tmp_path / "empty.yaml", tmp_path / "binary.yaml"
    empty.write_text("")
    binary.write_bytes(b"\xff\xfe\x00name")
    for path, fault in [
        (tmp_path / "none.yaml", "no such file, allowed: a YAML file"),
        (tmp_path, "unreadable"),
        (binary, "unreadable"),
        (empty, "an empty file, allowed: a mapping of keys to values"),
    ]:
        with pytest.raises(InputError) as caught:
            load_testbed(path)
        assert str(caught.value).startswith(f"{path}: {fault}")
        assert "\n" not in str(caught.value)
