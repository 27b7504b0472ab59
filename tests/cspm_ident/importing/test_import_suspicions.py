"""What an import finds suspicious, and what it does not."""

import numpy as np
import pytest
from import_samples import ONE_WINCH, THESIS, imported, table
from scipy.signal import lfilter

from cspm_checks.robust_line import robust_line
from cspm_checks.time_suspicions import held_suspicions
from cspm_checks.value_suspicions import resolution

STATE, TENSION = "/winches/state", "/cables/tension"
RADIUS = 0.025
MAPPING = """
name: rig
clocks: {pc: {column: t}}
channels:
  /winches/state:
    position/surge: {column: q, unit: rad}
    velocity/surge: {column: v, unit: rad/s}
    effort/surge: {column: u, unit: N·m}
  /cables/tension:
    effort/surge: {column: N, unit: N}
"""


def healthy(seed=0, count=8000):
    """A winch with friction that pulls at a spring, 8 s at 1 kHz, with the test-bed's sensors."""
    rng = np.random.default_rng(seed)
    t = np.arange(count) * 1e-3
    q = 2.0 * np.sin(3.0 * t) + 0.5 * np.sin(7.1 * t)
    v = 6.0 * np.cos(3.0 * t) + 3.55 * np.cos(7.1 * t)
    tension = 40.0 + 8.0 * q
    u = RADIUS * tension + 0.03 * np.sign(v) + 0.01 * v
    step = 7.669904e-4
    return {
        "t": t,
        "q": np.round(q / step) * step,
        "v": v + rng.normal(0.0, 0.01, count),
        "u": np.round(u / 1e-4) * 1e-4,
        "N": np.round((tension + rng.normal(0.0, 0.02, count)) / 0.005) * 0.005,
    }


def found(tmp_path, **changes):
    """Import the healthy winch with changed columns."""
    columns = healthy()
    for name, change in changes.items():
        columns[name] = change(columns[name])
    return imported(table(tmp_path / "a.csv", columns), MAPPING, trial=True)


def texts(report, kind):
    return [one.text for one in report.report.suspicions if one.kind == kind]


def test_nothing_is_said_of_a_healthy_recording(tmp_path):
    assert found(tmp_path).report.suspicions == []


@pytest.mark.parametrize(
    ("factor", "reported"),
    [
        (1 / 2.03, "factor 2.03, sign +"),
        (-1 / 2.03, "factor 2.03, sign −"),
        (60 / (2 * np.pi), "factor 0.1047, sign + (velocity in rpm taken for rad/s?)"),
        (-1.0, "factor 1, sign −"),
    ],
)
def test_velocity_that_does_not_integrate_to_position(tmp_path, factor, reported):
    said = texts(found(tmp_path, v=lambda v: v * factor), "velocity")
    assert len(said) == 1
    head, _, tail = reported.partition(",")
    assert said[0].startswith("velocity does not integrate to position: factor ")
    value = float(said[0].partition("factor ")[2].partition(",")[0])
    assert value == pytest.approx(float(head.partition(" ")[2]), rel=2e-3)
    assert said[0].endswith(tail)


def test_velocity_is_judged_in_spite_of_bias_spikes_and_gaps(tmp_path):
    def spoilt(v):
        v = v + 0.3
        v[::977] += 200.0
        return v

    assert not texts(found(tmp_path, v=spoilt), "velocity")
    assert texts(found(tmp_path, v=lambda v: 1.1 * spoilt(v)), "velocity")
    gap = {"t": lambda t: t + 3.0 * (t > 4.0)}
    assert not texts(found(tmp_path, **gap), "velocity")


def test_velocity_of_something_else(tmp_path):
    said = texts(found(tmp_path, v=lambda v: 5 * np.cos(np.arange(len(v)) * 0.0177)), "unrelated")
    assert len(said) == 1
    assert said[0].startswith("velocity and position are not related (")


def test_a_bar_whose_velocity_is_in_other_axes(tmp_path):
    t = np.arange(500) * 0.01
    columns = {"t": t, "x": np.sin(t), "vx": -np.cos(t), "zero": 0.0 * t}
    rest = "\n    ".join(f"{name}: {{constant: 0}}" for name in ("y", "z", "qx", "qy", "qz"))
    mapping = f"""
name: mocap
clocks: {{pc: {{column: t}}}}
channels:
  /bar/pose:
    x: {{column: x, unit: m}}
    qw: {{constant: 1}}
    {rest}
  /bar/twist:
    vx: {{column: vx, unit: m/s}}
    vy: {{column: zero, unit: m/s}}
    vz: {{constant: 0}}
    wx: {{constant: 0}}
    wy: {{constant: 0}}
    wz: {{constant: 0}}
"""
    report = imported(table(tmp_path / "a.csv", columns), mapping, THESIS)
    assert report.suspected >= {("/bar/twist vx", "velocity"), ("/bar/twist vy", "constant")}
    columns["vx"] = np.cos(t)
    fine = imported(table(tmp_path / "b.csv", columns), mapping, THESIS)
    assert ("/bar/twist vx", "velocity") not in fine.suspected


def test_friction_that_gives_energy(tmp_path):
    said = found(tmp_path, u=lambda u: -u)
    assert said.suspected == {
        (f"{STATE} effort/surge", "power"),
        (f"{STATE} effort/surge", "torque"),
    }
    assert texts(said, "torque")[0].endswith("sign −")
    assert "friction takes energy: sign of torque or angle?" in texts(said, "power")[0]


def test_torque_and_tension_by_the_drum(tmp_path):
    said = texts(found(tmp_path, N=lambda n: n / 9.80665), "torque")
    assert len(said) == 1
    factor = float(said[0].partition("factor ")[2].partition(",")[0])
    assert factor == pytest.approx(9.81, rel=0.02)
    assert not texts(found(tmp_path, N=lambda n: 1.5 * n), "torque")


def test_constant_saturated_and_coarse_channels(tmp_path):
    said = found(tmp_path, N=lambda n: 0 * n + 3.0)
    assert (f"{TENSION} effort/surge", "constant") in said.suspected
    clipped = texts(found(tmp_path, u=lambda u: np.minimum(u, 1.2)), "saturated")
    assert len(clipped) == 1
    assert "values are exactly 1.2 N·m, the end of its range: saturated?" in clipped[0]
    coarse = found(tmp_path, N=lambda n: np.round(n / 5.0) * 5.0)
    assert "9 levels, 5 N apart" in texts(coarse, "coarse")[0]
    assert texts(coarse, "resolution") == ["resolution 5 N, the test-bed says 0.005: factor 1000"]


def test_a_winch_that_its_brake_holds_may_stay_where_it_is(tmp_path):
    still = {name: lambda values: 0.0 * values for name in "qvu"}
    parts = [f"{STATE} {part}/surge" for part in ("position", "velocity", "effort")]
    assert {(part, "constant") for part in parts} <= found(tmp_path, **still).suspected
    text = ONE_WINCH.read_text(encoding="utf-8")
    held = tmp_path / "held.yaml"
    held.write_text(text.replace("  - name: surge\n", "  - name: surge\n    locked: true\n"))
    columns = healthy() | {"N": np.full(len(healthy()["t"]), 3.0)}
    columns |= {name: np.zeros(len(columns["t"])) for name in "qvu"}
    path = table(tmp_path / "a.csv", columns)
    said = imported(path, MAPPING, held, trial=True)
    assert {one.where for one in said.report.suspicions if one.kind == "constant"} == {
        f"{TENSION} effort/surge"
    }


def test_a_channel_that_was_filtered_has_no_grid(tmp_path):
    smooth = {"q": lambda q: lfilter([0.1], [1.0, -0.9], q)}
    said = texts(found(tmp_path, **smooth), "smoothed")
    assert said == [
        "on no grid, where the test-bed's resolution is 0.000767 rad: filtered or resampled before?"
    ]


@pytest.mark.parametrize(
    ("changes", "where", "text"),
    [
        (
            {"u": lambda u: 1e3 * u},
            f"{STATE} effort/surge",
            "the torque limit is 3: unit?",
        ),
        ({"u": lambda u: 1e-4 * u}, f"{STATE} effort/surge", "never above 0.000"),
        ({"N": lambda n: -n}, f"{TENSION} effort/surge", "a cable that pushes with"),
        ({"N": lambda n: 10 * n}, f"{TENSION} effort/surge", "the tension limit is 100: unit?"),
        ({"q": lambda q: 180 * q}, f"{STATE} position/surge", "m of cable: unit or counts"),
        ({"v": lambda v: 180 * v}, f"{STATE} velocity/surge", "more than 1000: unit?"),
    ],
)
def test_implausible_units(tmp_path, changes, where, text):
    report = found(tmp_path, **changes).report.suspicions
    assert any(
        one.where == where and one.kind == "implausible" and text in one.text for one in report
    )


def test_irregular_steps_and_a_rate_that_the_sensor_has_not(tmp_path):
    rng = np.random.default_rng(1)
    said = found(tmp_path, t=lambda t: t + np.cumsum(rng.uniform(0.0, 2e-4, len(t))))
    assert "irregular" in said.kinds
    assert "jitter" not in said.kinds
    said = found(tmp_path, t=lambda t: t / 2, v=lambda v: 2 * v)
    assert (
        texts(said, "rate")
        == ["comes at 2000 Hz, the test-bed's sensor delivers 1000 Hz at most"] * 2
    )


def test_counters_that_jump_too_far(tmp_path):
    mapping = MAPPING.replace("column: q, unit: rad", "column: q, unit: rad, wrap: 6.25")
    columns = healthy(count=400)
    columns["q"] = np.mod(np.arange(400) * 2.0, 6.25)
    report = imported(table(tmp_path / "a.csv", columns), mapping)
    assert (f"{STATE} position/surge", "wrap") in report.suspected
    columns["q"] = np.mod(np.arange(400) * 1.0, 6.25)
    report = imported(table(tmp_path / "b.csv", columns), mapping)
    assert (f"{STATE} position/surge", "wrap") not in report.suspected
    assert report.report.topics[0].fields[0].turns == 63


def test_slow_sensors_held_or_interpolated():
    t = np.arange(3000) * 1e-3
    slow = np.stack([np.sin(5.0 * t[::10]), np.cos(4.0 * t[::10])], axis=1)
    held = held_suspicions("/bar/pose", np.repeat(slow, 10, axis=0))
    assert [(one.kind, one.numbers["messages"]) for one in held] == [("held", 10.0)]
    lines = np.stack([np.interp(t, t[::10], column) for column in slow.T], axis=1)
    filled = held_suspicions("/bar/pose", lines)
    assert [(one.kind, one.numbers["messages"]) for one in filled] == [("interpolated", 10.0)]
    smooth = np.stack([np.sin(5.0 * t), np.cos(4.0 * t)], axis=1)
    assert held_suspicions("/bar/pose", smooth) == []
    ramp = np.floor(np.arange(3000)[:, None] / 4.0) * 0.01
    assert held_suspicions("/winches/state", ramp) == []
    coarse = np.round(smooth / 0.01) * 0.01
    assert held_suspicions("/bar/pose", coarse) == []
    assert held_suspicions("/bar/pose", smooth[:50]) == []


def test_quaternions_of_another_length(tmp_path):
    t = np.arange(100) * 0.01
    fields = "".join(f"    {name}: {{constant: 0}}\n" for name in ("y", "z", "qx", "qy", "qz"))
    mapping = f"""
name: mocap
clocks: {{pc: {{column: t}}}}
channels:
  /bar/pose:
{fields}
    x: {{column: x, unit: m}}
    qw: {{constant: %s}}
"""
    path = table(tmp_path / "a.csv", {"t": t, "x": np.sin(t)})
    assert "quaternion" in imported(path, mapping % 0.9, THESIS).kinds
    assert "quaternion" not in imported(path, mapping % 1, THESIS).kinds


def test_resolution():
    rng = np.random.default_rng(0)
    signal = np.cumsum(rng.normal(size=5000))
    assert resolution(np.round(signal / 0.25) * 0.25) == pytest.approx(0.25)
    assert resolution(np.round(signal / 1e-3) * 1e-3 * np.pi / 180) in (
        None,
        pytest.approx(1e-3 * np.pi / 180, rel=1e-3),
    )
    assert resolution(signal) is None
    assert resolution(np.ones(5)) is None


def test_robust_line_passes_over_what_is_wrong():
    rng = np.random.default_rng(0)
    x, ones = rng.normal(size=400), np.ones(400)
    y = 3.0 * x - 2.0 + 0.01 * rng.normal(size=400)
    y[::9] += 50.0
    line = robust_line(x, y, ones)
    assert line.slope == pytest.approx(3.0, abs=0.02)
    assert robust_line(ones, y, ones) is None
    assert robust_line(0 * x, y, ones) is None
    assert robust_line(x, 2.0 * x, ones).explained == pytest.approx(1.0)


def test_a_gap_is_where_the_source_has_it_whatever_is_dropped_before(tmp_path):
    columns = healthy()
    columns["t"] = columns["t"] + 3.0 * (columns["t"] > 4.0)
    dropped = MAPPING + "drop:\n  - {start: 0, end: 1.5, reason: not yet hung}\n"
    report = imported(table(tmp_path / "a.csv", columns), dropped).report
    places = [one.numbers["at"] for one in report.suspicions if one.kind == "gap"]
    assert places == pytest.approx([4.0, 4.0], abs=0.01)


def test_missing_numbers_that_are_kept_disturb_no_check(tmp_path):
    columns = healthy()
    for name in ("q", "v", "u", "N"):
        columns[name][100:140] = np.nan
    path = table(tmp_path / "a.csv", columns)
    assert imported(path, "nan: keep" + MAPPING).report.suspicions == []
    assert imported(path, MAPPING).kinds == {"gap"}
    columns["v"][:] = np.nan
    path = table(tmp_path / "b.csv", columns)
    found = imported(path, "nan: keep" + MAPPING)
    assert found.suspected == {(f"{STATE} velocity/surge", "empty")}
    assert found.report.data()["topics"][0]["fields"][1]["low"] is None
