"""The mapping file: units and what is refused, each in one line."""

import json

import numpy as np
import pytest
from import_samples import ONE_WINCH, THESIS, imported, table
from scipy.spatial.transform import Rotation

from cspm_ident.importing.conversion import conversion_of
from cspm_ident.importing.mapping import ChannelSource
from cspm_msgs_py.errors import InputError

STATE = "/winches/state"
BASE = {
    "name": "rig",
    "clocks": {"pc": {"column": "t"}},
    "channels": {STATE: {"position/surge": {"column": "q", "unit": "rad"}}},
}


# One of each unit in SI, from the units' definitions.
@pytest.mark.parametrize(
    ("unit", "quantity", "si"),
    [
        ("deg", "rad", np.pi / 180),
        ("turn", "rad", 2 * np.pi),
        ("rpm", "rad/s", np.pi / 30),
        ("deg/s", "rad/s", 0.017453292519943295),
        ("mm", "m", 0.001),
        ("in", "m", 0.0254),
        ("m/min", "m/s", 1 / 60),
        ("g", "m/s²", 9.80665),
        ("kgf", "N", 9.80665),
        ("lbf", "N", 4.4482216152605),
        ("kN", "N", 1000.0),
        ("Ncm", "N·m", 0.01),
        ("ozf·in", "N·m", 0.00706155181422604),
        ("lbf·in", "N·m", 0.1129848290276167),
        ("%", "1", 0.01),
    ],
)
def test_units(unit, quantity, si):
    conversion = conversion_of(ChannelSource(column="a", unit=unit), quantity, "")
    assert conversion.apply(np.ones(1), None)[0] == pytest.approx(si, rel=1e-12)


def test_sign_scale_offset_counts_and_invalid():
    source = ChannelSource(column="a", unit="counts", counts_per_turn=100.0, sign=-1, offset=0.5)
    found = conversion_of(source, "rad", "")
    assert found.unwrapper() is None
    np.testing.assert_allclose(found.apply(np.array([0.0, 50.0]), None), [0.5, 0.5 - np.pi])
    assert found.formula == "-0.0628318531 rad/counts · raw + 0.5"
    source = ChannelSource(
        column="a", unit="mV", scale=3.0, offset=-1.0, invalid=(9999.0,), wrap=10000.0
    )
    found = conversion_of(source, "N", "")
    values = found.apply(np.array([9000.0, 9999.0, np.inf, 1000.0]), found.unwrapper())
    np.testing.assert_allclose(values, [26.0, np.nan, np.nan, 32.0])
    assert found.formula == "0.003 N/mV · raw − 1, unwrapped at 10000"


@pytest.mark.parametrize(
    ("source", "quantity", "text"),
    [
        (
            {"unit": "mm"},
            "rad",
            "c.unit: 'mm' is no rad, allowed: rad, mrad, deg, turn, rev, or a scale in rad per m",
        ),
        (
            {"unit": "counts"},
            "rad",
            "c.unit: 'counts' is no rad, allowed: with counts_per_turn, rad, mrad, deg, turn, rev,"
            " or a scale in rad per counts",
        ),
        ({"unit": "V"}, "1", "c.unit: 'V' is no 1, allowed: 1, %, or a scale in 1 per V"),
    ],
)
def test_a_unit_of_another_quantity_needs_a_scale(source, quantity, text):
    with pytest.raises(InputError) as caught:
        conversion_of(ChannelSource(column="a", **source), quantity, "c")
    assert str(caught.value) == text
    scaled = conversion_of(ChannelSource(column="a", scale=2.0, **source), quantity, "c")
    assert scaled.factor != 0.0


def test_an_unknown_unit_names_the_known():
    with pytest.raises(InputError) as caught:
        conversion_of(ChannelSource(column="a", unit="furlong"), "m", "c")
    assert str(caught.value).startswith("c.unit: unit 'furlong', allowed: rad, mrad, deg, ")


def refused(tmp_path, change, testbed=ONE_WINCH):
    """Import with a changed mapping; return the error without the mapping's path."""
    path = table(tmp_path / "a.csv", {"t": [0.0, 1.0], "q": [1.0, 2.0], "v": [3.0, 4.0]})
    content = json.loads(json.dumps(BASE))
    for key, value in change.items():
        node = content
        *parents, last = key.split(">")
        for parent in parents:
            node = node[parent]
        node[last] = value
    with pytest.raises(InputError) as caught:
        imported(path, json.dumps(content), testbed)
    assert "\n" not in str(caught.value)
    return str(caught.value).removeprefix(f"{tmp_path}/mapping.yaml: ").replace(f"{tmp_path}/", "")


ONE = f"channels>{STATE}>position/surge"


@pytest.mark.parametrize(
    ("change", "text"),
    [
        ({"nome": 1}, "nome: unknown key"),
        ({"clocks": {}}, "clocks: missing, allowed: at least one with column or rate"),
        ({"clocks": {"pc": {}}}, "clocks.pc: no time, allowed: one of column, rate, stamp"),
        (
            {"clocks": {"pc": {"column": "t", "rate": 5.0}}},
            "column and rate, allowed: one of column, rate, stamp",
        ),
        ({"clocks": {"pc": {"column": "t", "unit": "fs"}}}, "unit: 'fs', allowed: s, ms, us"),
        ({"clocks": {"pc": {"rate": 5.0, "unit": "ms"}}}, "unit or wrap with rate, allowed"),
        (
            {"clocks": {"pc": {"column": "t", "points": [[0, 1], [0, 2]]}}},
            "points: the second is not later",
        ),
        (
            {"clocks": {"pc": {"column": "t", "points": [[0, 1], [1, 1]]}}},
            "points: time runs backwards",
        ),
        (
            {"clocks": {"pc": {"column": "t", "points": [[0, 1], [1, 2]], "skew": 0.1}}},
            "points and skew, allowed: one of them",
        ),
        (
            {"clocks": {"pc": {"stamp": "log"}}},
            "a.csv: stamp log, allowed: with bags; here column or rate",
        ),
        ({"channels": {}}, "channels"),
        (
            {"channels": {"/bar/pose": {"x": {"constant": 0}}}},
            "channels./bar/pose: no topic of test-bed one_winch that can be imported, allowed:"
            " /winches/state, /cables/tension, /tension_command, /winches/torque_command",
        ),
        (
            {"channels": {"/truth/winches/state": {"x": {"constant": 0}}}},
            "channels./truth/winches/state: no topic of test-bed one_winch",
        ),
        (
            {f"channels>{STATE}": {"position/sway": {"column": "q", "unit": "rad"}}},
            "channels./winches/state: no field 'position/sway', allowed: effort/surge,"
            " position/surge, velocity/surge",
        ),
        (
            {f"channels>{STATE}": {"position/surge": {"constant": 1.0}}},
            "channels./winches/state: constants only, allowed: at least one column",
        ),
        ({f"{ONE}>unit": "N"}, f"channels.{STATE}.position/surge.unit: 'N' is no rad, allowed:"),
        ({f"{ONE}>sign": 2}, "sign"),
        ({f"{ONE}>scale": 0.0}, "scale: 0, allowed: any other number"),
        ({f"{ONE}>counts_per_turn": 10.0}, "counts_per_turn with unit rad, allowed: with unit"),
        ({f"{ONE}>constant": 1.0}, "column and constant, allowed: one of column, constant"),
        ({ONE: {"column": "q"}}, "unit: missing, allowed: the unit of the column"),
        ({ONE: {"constant": 1.0, "unit": "rad"}}, "unit with constant, allowed: constant alone"),
        ({f"{ONE}>clock": "gps"}, f"channels.{STATE}.position/surge.clock: 'gps', allowed: pc"),
        ({f"{ONE}>column": "Q"}, "a.csv: no column 'Q', allowed: t, q, v"),
        ({f"{ONE}>column": "t"}, "a.csv: column 't' is clock and channel, allowed: one of both"),
        ({"drop": [{"start": 2, "end": 1}]}, "start 2, end 1, allowed: start < end"),
        (
            {"drop": [{"start": 1, "end": 2, "topics": ["/x"]}]},
            f"drop[0].topics: '/x', allowed: {STATE}",
        ),
        ({"csv": {"delimiter": "ab"}}, "delimiter: 'ab', allowed: one character, or blank"),
        ({"csv": {"first_line": 1}}, "first_line: 1, allowed: after names_line, 1"),
        ({"csv": {"encoding": "utf-9"}}, "encoding: 'utf-9', allowed: such as utf-8"),
        ({"csv": {"decimal": ",", "delimiter": ","}}, "csv.delimiter: ',' is the decimal mark"),
    ],
)
def test_what_a_mapping_may_not_say(tmp_path, change, text):
    assert text in refused(tmp_path, change)


def test_each_cable_of_the_machine_is_needed(tmp_path):
    channels = {STATE: {"effort/hoist_1": {"column": "q", "unit": "Nm"}}}
    found = refused(tmp_path, {"channels": channels}, THESIS)
    assert found.startswith("channels./winches/state: without effort/hoist_2, effort/surge_1, ")
    assert found.endswith("`constant` gives what is known without a sensor")


POSE = """
name: mocap
clocks: {pc: {rate: 100}}
channels:
  /bar/pose:
    x: {column: x, unit: mm}
    y: {column: y, unit: mm, sign: -1}
    z: {constant: 2.0}
    %s
"""


def test_angles_become_the_quaternion_of_the_conventions(tmp_path):
    angles = np.random.default_rng(3).uniform(-1.0, 1.0, (20, 3))
    columns = dict(zip(("roll", "pitch", "yaw"), np.degrees(angles).T, strict=True))
    path = table(tmp_path / "a.csv", {"x": np.arange(20.0), "y": np.arange(20.0), **columns})
    fields = "\n    ".join(f"{name}: {{column: {name}, unit: deg}}" for name in columns)
    rows = imported(path, POSE % fields, THESIS).rows["/bar/pose"]
    np.testing.assert_allclose(rows[:, 0], np.arange(20) * 1e-3)
    np.testing.assert_allclose(rows[:, 1], np.arange(20) * -1e-3)
    assert (rows[:, 2] == 2.0).all()
    # R = Rz(ψ)Ry(θ)Rx(φ), from three elementary rotations.
    x, y, z = (
        Rotation.from_rotvec(np.outer(angle, axis))
        for angle, axis in zip(angles.T, np.eye(3), strict=True)
    )
    np.testing.assert_allclose(Rotation.from_quat(rows[:, 3:]).as_matrix(), (z * y * x).as_matrix())


def test_a_pose_comes_whole_with_angles_or_a_quaternion(tmp_path):
    path = table(tmp_path / "a.csv", {"x": [1.0], "y": [1.0], "a": [0.0]})
    with pytest.raises(InputError, match=r"without qx, qy, qz, qw, allowed: all of x, y, z, qx, "):
        imported(path, POSE % "", THESIS)
    with pytest.raises(InputError, match=r"without pitch, yaw, allowed: all of x, y, z, roll, "):
        imported(path, POSE % "roll: {constant: 0}", THESIS)
    with pytest.raises(InputError, match="angles and quaternion, allowed: one of both"):
        imported(path, POSE % "roll: {constant: 0}\n    qw: {constant: 1}", THESIS)


FIXED = """
name: lab
clocks: {pc: {rate: 100}, slow: {rate: 20}}
channels:
  /winch_frame/pose: {x: {constant: 0.1}, y: {constant: 0}, z: {constant: -0.2},
    roll: {constant: 0}, pitch: {constant: 0}, yaw: {constant: 0.5}}
  /bar/twist: {vx: {column: v, unit: m/s}, vy: {constant: 0}, vz: {constant: 0},
    wx: {constant: 0}, wy: {constant: 0}, wz: {constant: 0}}
  /bar/pose: {x: {column: x, unit: m, clock: slow}, y: {constant: 0}, z: {constant: 2},
    roll: {constant: 0}, pitch: {constant: 0}, yaw: {constant: 0}}
"""


def test_a_winch_frame_that_is_fixed_may_be_all_constants(tmp_path):
    path = table(tmp_path / "a.csv", {"v": np.zeros(50), "x": np.linspace(0.0, 1.0, 50)})
    found = imported(path, FIXED, THESIS)
    assert list(found.topics)[-1] == "/winch_frame/pose"
    np.testing.assert_array_equal(found.stamps["/winch_frame/pose"], found.stamps["/bar/pose"])
    assert len(found.stamps["/bar/twist"]) == 50
    pose = [0.1, 0.0, -0.2, 0.0, 0.0, np.sin(0.25), np.cos(0.25)]
    np.testing.assert_allclose(found.rows["/winch_frame/pose"], np.tile(pose, (50, 1)), atol=1e-15)


def test_constants_alone_are_no_recording(tmp_path):
    text = FIXED.split("  /bar/twist")[0]
    path = table(tmp_path / "a.csv", {"v": np.zeros(50)})
    with pytest.raises(InputError, match="channels: constants only, allowed: at least one column"):
        imported(path, text, THESIS)
