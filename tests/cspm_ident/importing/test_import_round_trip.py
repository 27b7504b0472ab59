"""Simulated, exported by other writers with odd units, names, rates and gaps, and brought back."""

import numpy as np
import pytest
from import_samples import NOETIC, imported, ros1_bag, ros1_header, table
from run_samples import run_to
from scipy.io import savemat

from cspm_msgs_py.recording import Recording

STATE, TENSION = "/winches/state", "/cables/tension"
POUND_FORCE = 4.4482216152605
CLOSE = {"rtol": 1e-13, "atol": 1e-15}


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    """Rows of a second and a half of the rig, and the folder of its recording."""
    folder = tmp_path_factory.mktemp("rig") / "bag"
    result, rows = run_to(folder, "one_winch", "duration=1.5")
    assert result.failure is None
    return folder, rows


def assert_same(found, stamps, rows):
    assert np.array_equal(found[0], stamps)
    np.testing.assert_allclose(found[1], rows, **CLOSE)


def test_text_table_with_odd_units_and_german_numbers(run, tmp_path):
    state, tension = run[1][STATE], run[1][TENSION]
    keep = np.r_[0:400, 480 : len(state.stamp_ns)]
    path = table(
        tmp_path / "lab.csv",
        {
            "Zeit ms": state.stamp_ns[keep] / 1e6,
            "Winkel": -np.degrees(state.rows[keep, 0]),
            "U/min": state.rows[keep, 1] / (2 * np.pi) * 60,
            "mNm": 1e3 * state.rows[keep, 2],
            "Kraft": (tension.rows[keep, 0] + 1.25) / POUND_FORCE,
            "Notiz": ["frei"] * len(keep),
        },
        delimiter=";",
        decimal=",",
    )
    found = imported(
        path,
        """
name: lab
csv: {decimal: ","}
clocks: {pc: {column: Zeit ms, unit: ms}}
channels:
  /winches/state:
    effort/surge: {column: mNm, unit: mN·m}
    position/surge: {column: Winkel, unit: deg, sign: -1}
    velocity/surge: {column: U/min, unit: rpm}
  /cables/tension:
    effort/surge: {column: Kraft, unit: lbf, offset: -1.25}
""",
    )
    assert found.topics[STATE].parts == ("position", "velocity", "effort")
    assert_same((found.stamps[STATE], found.rows[STATE]), state.stamp_ns[keep], state.rows[keep])
    assert np.array_equal(found.stamps[TENSION], tension.stamp_ns[keep])
    np.testing.assert_allclose(found.rows[TENSION], tension.rows[keep], rtol=1e-13, atol=1e-14)
    assert found.suspected == {(STATE, "gap"), (TENSION, "gap")}
    assert found.report.unused == ["Notiz"]
    gap = next(one for one in found.report.suspicions if one.where == STATE)
    assert gap.numbers == {
        "count": 1,
        "longest": pytest.approx(0.081),
        "at": pytest.approx(0.399),
    }


def test_slow_sensor_between_empty_cells_with_its_own_time(run, tmp_path):
    """A logger that writes a line whenever anything comes: each topic keeps its own rate."""
    state, tension = run[1][STATE], run[1][TENSION]
    slow = np.arange(0, len(tension.stamp_ns), 7)
    texts = {name: [""] * len(state.stamp_ns) for name in ("t_cell", "N")}
    for i in slow:
        texts["t_cell"][i] = repr(int(tension.stamp_ns[i] // 1000) + 12_345)
        texts["N"][i] = repr(float(tension.rows[i, 0])) if i != 14 else " - "
    path = table(tmp_path / "log.csv", {"t": state.stamp_ns * 1e-9, "q": state.rows[:, 0], **texts})
    found = imported(
        path,
        """
name: log
csv: {missing: ["-"]}
clocks:
  drive: {column: t}
  cell: {column: t_cell, unit: us, offset: -0.012345}
channels:
  /winches/state:
    position/surge: {column: q, unit: rad}
  /cables/tension:
    effort/surge: {column: N, unit: N, clock: cell}
""",
    )
    kept = slow[slow != 14]
    assert_same(
        (found.stamps[TENSION], found.rows[TENSION]), tension.stamp_ns[kept], tension.rows[kept]
    )
    assert_same((found.stamps[STATE], found.rows[STATE]), state.stamp_ns, state.rows[:, :1])
    assert found.topics[STATE].fields == ("position/surge",)
    left = {topic.topic: topic.left_out for topic in found.report.topics}
    assert (left[TENSION].missing, left[TENSION].no_time) == (1, len(state.stamp_ns) - len(slow))
    assert left[STATE].total == 0


def test_matlab_file_with_encoder_counts_and_a_drifting_clock(run, tmp_path):
    state, tension = run[1][STATE], run[1][TENSION]
    counts = np.round(state.rows[:, 0] / (2 * np.pi) * 8192)
    wrapped = np.mod(-counts, 4096).astype(np.uint16)
    skewed = 5.0 + tension.stamp_ns[::3] * 1e-9 * 1.002
    path = tmp_path / "rig.mat"
    volts = np.stack([state.rows[:, 2] / 0.12, state.rows[:, 1]])
    savemat(
        path,
        {
            "rig": {
                "encoder": wrapped,
                "drive": volts,
                "load": {"t": skewed, "kg": tension.rows[::3, 0] / 9.80665},
            }
        },
    )
    found = imported(
        path,
        """
name: rig
clocks:
  adc: {rate: 1000.0}
  load: {column: rig.load.t, points: [[5.0, 0.0], [6.002, 1.0]]}
channels:
  /winches/state:
    position/surge: {column: rig.encoder, unit: counts, counts_per_turn: 8192, wrap: 4096, sign: -1}
    effort/surge: {column: "rig.drive[0]", unit: V, scale: 0.12}
  /cables/tension:
    effort/surge: {column: rig.load.kg, unit: kgf, clock: load}
""",
    )
    assert np.array_equal(found.stamps[STATE], state.stamp_ns)
    assert found.topics[STATE].fields == ("position/surge", "effort/surge")
    angle = found.rows[STATE][:, 0] - found.rows[STATE][0, 0]
    expected = 2 * np.pi / 8192 * (counts - counts[0])
    np.testing.assert_allclose(angle, expected, rtol=1e-12, atol=1e-12)
    np.testing.assert_allclose(found.rows[STATE][:, 1], state.rows[:, 2], **CLOSE)
    # A stamp of 5 s as float64 holds 1e-15 s; a nanosecond is what a stamp can hold.
    assert np.abs(found.stamps[TENSION] - tension.stamp_ns[::3]).max() <= 1
    np.testing.assert_allclose(found.rows[TENSION], tension.rows[::3], **CLOSE)
    assert found.report.unused == ["rig.drive[1]"]


def test_ros1_bag_with_other_types_and_names(run, tmp_path):
    state, tension = run[1][STATE], run[1][TENSION]
    shift = 1_700_000_000_000_000_000
    joints = NOETIC.types["sensor_msgs/msg/JointState"]
    wrench = NOETIC.types["geometry_msgs/msg/WrenchStamped"]
    vector = NOETIC.types["geometry_msgs/msg/Vector3"]
    force = NOETIC.types["geometry_msgs/msg/Wrench"]
    path = ros1_bag(
        tmp_path / "old.bag",
        {
            "/drives": (
                "sensor_msgs/msg/JointState",
                [
                    (
                        shift + stamp + 500_000,
                        joints(
                            ros1_header(shift + stamp),
                            ["spare", "m1"],
                            np.array([0.0, row[0] / (2 * np.pi)]),
                            np.array([0.0, row[1]]),
                            np.zeros(0),
                        ),
                    )
                    for stamp, row in zip(state.stamp_ns, state.rows, strict=True)
                ],
            ),
            "/cell": (
                "geometry_msgs/msg/WrenchStamped",
                [
                    (
                        shift + stamp,
                        wrench(
                            ros1_header(0), force(vector(0.0, -row[0] / 1e3, 0.0), vector(0, 0, 0))
                        ),
                    )
                    for stamp, row in list(zip(tension.stamp_ns, tension.rows, strict=True))[::4]
                ],
            ),
        },
    )
    found = imported(
        path,
        """
name: old
clocks:
  header: {stamp: header}
  log: {stamp: log}
channels:
  /winches/state:
    position/surge: {column: "/drives:position[m1]", unit: turn}
    velocity/surge: {column: "/drives:velocity[1]", unit: rad/s}
  /cables/tension:
    effort/surge: {column: "/cell:wrench.force.y", unit: kN, sign: -1, clock: log}
""",
    )
    assert_same((found.stamps[STATE], found.rows[STATE]), shift + state.stamp_ns, state.rows[:, :2])
    assert np.array_equal(found.stamps[TENSION], shift + tension.stamp_ns[::4])
    np.testing.assert_allclose(found.rows[TENSION], tension.rows[::4], **CLOSE)


def test_our_own_recording_comes_back_bit_for_bit(run):
    folder, rows = run
    found = imported(
        folder,
        """
name: again
channels:
  /winches/state:
    position/surge: {column: "/winches/state:position[0]", unit: rad}
    velocity/surge: {column: "/winches/state:velocity[surge]", unit: rad/s}
    effort/surge: {column: "/winches/state:effort[0]", unit: N·m}
  /winches/torque_command:
    effort/surge: {column: "/winches/torque_command:effort[0]", unit: N·m}
""",
    )
    for name in found.topics:
        assert np.array_equal(found.stamps[name], rows[name].stamp_ns)
        assert np.array_equal(found.rows[name], rows[name].rows)
    assert found.report.suspicions == []
    with Recording(folder) as recording:
        assert found.topics[STATE] == recording.topic(STATE)
    assert TENSION + ":…" in found.report.unused
