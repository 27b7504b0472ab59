"""`cspm identify winch` on tables of laboratories: what is a result, and what is none."""

import json

import numpy as np
import pytest
from error_lines import said
from winch_samples import STEP, Winch, closed_loop

from cspm_msgs_py.testbed import load_testbed

WINCH = Winch()
TESTBED = """
name: shaft
cables:
  - {name: m, drum_radius: 0.01, rotor_inertia: 2.0e-3, torque_limit: 4.0}
effects:
  - {effect: winch_viscous_friction, elements: [m], parameters: {coefficient: 0.05}}
"""
MAPPING = """
name: shaft
clocks: {drive: {column: t}}
channels:
  /winches/state:
    position/m: {column: q, unit: rad}
    effort/m: {column: tau, unit: N·m}
"""


@pytest.fixture(scope="module")
def made():
    """Times, angles and torques of a shaft, the torque moved to the middle of its period."""
    found = closed_loop(WINCH, 8000, torque_noise=0.005, seed=21)
    times = found.angle.times
    torque = found.torque.values[:, 0]
    return times, found.angle.values[:, 0], 0.5 * (torque + np.concatenate([[0.0], torque[:-1]]))


@pytest.fixture
def identified(cspm, tmp_path):
    """Import a table and identify it; return exit code, printed text and the winch's JSON."""

    def call(times, angles, torques, *words):
        rows = np.column_stack([times, angles, torques])
        text = "t,q,tau\n" + "\n".join("{:.6f},{:.8f},{:.6f}".format(*row) for row in rows)
        for name, content in (
            ("rows.csv", text),
            ("rig.yaml", TESTBED),
            ("map.yaml", MAPPING),
        ):
            (tmp_path / name).write_text(content, encoding="utf-8")
        options = ["--mapping", "map.yaml", "--testbed", "rig.yaml", "--out", "bag"]
        assert cspm("import", "rows.csv", *options)[0] == 0
        options = ["--out", "fitted", "--json", "found.json", *words]
        code, out, err = cspm("identify", "winch", "bag", *options)
        assert err == ""
        return code, out, json.loads((tmp_path / "found.json").read_text())["winches"][0]

    return call


def is_truth(winch):
    """Whether all numbers lie within 3.5 standard deviations of what was put in."""
    found = winch["estimate"]["parameters"]
    return all(
        abs(each["value"] - truth) < 3.5 * each["sd"]
        for each, truth in zip(found, WINCH.values, strict=True)
    )


def test_a_healthy_table_is_a_result_and_is_written(identified, made, tmp_path):
    code, out, winch = identified(*made)
    assert (code, winch["objections"], winch["torque_lateness"]) == (0, [], None)
    assert "no result" not in out
    assert is_truth(winch)
    fitted = load_testbed(tmp_path / "fitted" / "fitted_testbed.yaml").testbed
    assert fitted.cables[0].rotor_inertia == pytest.approx(WINCH.inertia, rel=0.02)


def test_a_torque_with_the_other_sign_is_no_result(identified, made, tmp_path):
    times, angles, torques = made
    code, out, winch = identified(times, angles, -torques)
    assert code == 1
    assert "is below 0, which no machine has; check the signs of torque and angle" in out
    assert winch["valid"] == []
    assert not (tmp_path / "fitted" / "fitted_testbed.yaml").exists()


def test_stamps_that_scatter_give_no_inertia(identified, made):
    times, angles, torques = (each[::4] for each in made)
    apart = 4.0 * STEP * np.random.default_rng(2).uniform(-0.4, 0.4, len(times))
    code, out, winch = identified(0.01 + times + apart, angles, torques)
    assert code == 1
    assert "of what would be its accelerations is noise of the angle, as stamps that scatter" in out
    assert "inertia" not in winch["valid"]


def test_a_late_torque_is_reported_and_intervals_hold_the_truth(identified, made):
    times, angles, torques = made
    late = np.concatenate([np.full(20, torques[0]), torques[:-20]])
    code, out, winch = identified(times, angles, late)
    assert code == 0
    assert "ms before its stamp, not 0: it is late against the angle" in out
    assert winch["torque_lateness"]["age"] == pytest.approx(20 * STEP, abs=3e-4)
    assert is_truth(winch)


def test_a_stated_age_is_taken(identified, made):
    times, angles, torques = made
    late = np.concatenate([np.full(20, torques[0]), torques[:-20]])
    code, out, winch = identified(times, angles, late, "--torque-age", "0.02")
    assert (code, winch["torque_lateness"]) == (0, None)
    assert "torque taken to act 20 ms before its stamp" in out
    truth = np.array([each["value"] for each in winch["estimate"]["parameters"]])
    np.testing.assert_allclose(truth, WINCH.values, rtol=0.03)


@pytest.mark.parametrize("kind", ["spikes", "reset"])
def test_jumps_are_reported_and_left_out(identified, made, kind):
    times, angles, torques = made
    wrong = angles.copy()
    if kind == "spikes":
        wrong[[2000, 5000]] += 20.0
    else:
        wrong[4000:] -= 30.0
    code, out, winch = identified(times, wrong, torques)
    assert code == 0
    assert f"jumps {4 if kind == 'spikes' else 1} times, at " in out
    assert len(winch["jumps"][0]["at_s"]) == (4 if kind == "spikes" else 1)
    assert is_truth(winch)


def test_a_friction_that_is_none_seen_is_written_as_none(identified, tmp_path):
    """The file describes 0.05 N·m·s/rad, which the recording excludes."""
    found = closed_loop(WINCH._replace(viscous=0.0, constant=0.0), 8000, torque_noise=0.01, seed=3)
    torque = found.torque.values[:, 0]
    torque = 0.5 * (torque + np.concatenate([[0.0], torque[:-1]]))
    code, out, _ = identified(found.angle.times, found.angle.values[:, 0], torque)
    assert code == 0
    assert "none seen" in out
    fitted = load_testbed(tmp_path / "fitted" / "fitted_testbed.yaml").testbed
    effects = {entry.effect: entry.parameters for entry in fitted.effects}
    assert effects["winch_viscous_friction"] == {"coefficient": 0.0}
    assert "winch_torque_offset" not in effects


def test_a_shaft_that_stands_still_is_refused(cspm, tmp_path):
    rows = "".join(f"{0.001 * i:.3f},1.0,0.1\n" for i in range(2000))
    (tmp_path / "rows.csv").write_text("t,q,tau\n" + rows)
    (tmp_path / "rig.yaml").write_text(TESTBED)
    (tmp_path / "map.yaml").write_text(MAPPING, encoding="utf-8")
    options = ["--mapping", "map.yaml", "--testbed", "rig.yaml", "--out", "bag"]
    assert cspm("import", "rows.csv", *options)[0] == 0
    code, _, err = cspm("identify", "winch", "bag")
    assert code == 2
    assert said(err) == (
        "bag: no winch moves by more than its encoder's noise, allowed: recordings in which"
        " one does\n"
    )
