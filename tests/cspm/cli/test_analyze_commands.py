"""`cspm analyze workspace`, `design` and `manipulability` on the command line."""

import json
import re

import numpy as np
import pytest
import yaml
from machines import build, point_content
from run_samples import SCENARIOS

from cspm.analysis import workspace
from cspm.commands.analysis.analyzed_machine import read_machine
from cspm_control.analysis.cable_structure import cable_structure, structures
from cspm_control.analysis.pose_grid import GRIDS, workspace_grids

LIMITED = {"surge", "sway", "pitch", "yaw"}


@pytest.mark.slow
def test_workspace_prints_draws_and_writes(cspm, tmp_path):
    code, out, err = cspm(
        *("analyze", "workspace", "--coarse", "14", "--out", "found", "--json", "found.json"),
        *("--acceleration", "0.2,0.2,0.5,0,0.2,0.2"),
    )
    assert (code, err) == (0, "")
    data = json.loads((tmp_path / "found.json").read_text())
    assert set(data["limits"]) == {"pseudo_inverse", "general"}
    assert all(set(row) == LIMITED for row in data["limits"].values())
    assert data["limits"]["general"]["pitch"] == 1.24
    assert data["required_acceleration"] == [0.2, 0.2, 0.5, 0.0, 0.2, 0.2]
    assert data["acceleration_factor"] > 1.0
    assert data["whole"]["pseudo_inverse"]["poses"] == GRIDS["pseudo_inverse"].every(14).size
    assert sum(claim["holds"]["ours"] for claim in data["claims"]) == 8
    assert re.search(r"general, pitch +1\.24 +1\.24 +yes", out)
    # As many digits as were published, so that a reader sees why it does not hold.
    assert re.search(r"max κ, rotation +68\.8670 +68\.8725 +no", out)
    for name in ("workspace.png", "maps.png"):
        assert (tmp_path / "found" / name).stat().st_size > 30_000


def test_an_interrupted_workspace_writes_nothing(cspm, tmp_path, monkeypatch):
    monkeypatch.setattr(workspace, "analyse_workspace", lambda *_: None)
    code, out, _ = cspm("analyze", "workspace", "--out", "found", "--json", "found.json")
    assert (code, out) == (130, "")
    assert list(tmp_path.iterdir()) == []


def test_the_required_acceleration_is_what_the_scenarios_reference_has():
    machine = read_machine("worst_case", None, None)
    found = workspace.reference_acceleration(machine)
    # A sea at the peak, by its amplitudes: σ·ω² with σ about a third of the largest.
    for value, amplitude in zip(found[:3], (0.1105, 0.0865, 0.318), strict=True):
        assert value == pytest.approx(amplitude / 3.0 * 2.72**2, rel=0.6)
    assert not workspace.reference_acceleration(read_machine("rest", None, None)).any()


@pytest.mark.parametrize(
    ("arguments", "text"),
    [
        (["--coarse", "0"], "Invalid value for '--coarse'"),
        (
            ["--acceleration", "1,2"],
            "--acceleration 1,2: allowed: six numbers with commas, surge, sway, heave, roll, pitch,"
            " yaw [m/s², rad/s²], such",
        ),
        (
            ["--acceleration=-1,0,0,0,0,0"],
            "--acceleration -1,0,0,0,0,0: allowed: six numbers that are not negative",
        ),
        (["--out", "."], ".: already exists, allowed: a new folder"),
        (["--testbed", "none.yaml"], "none.yaml: "),
    ],
)
def test_bad_input_of_workspace_is_one_line(refused, arguments, text):
    assert refused("analyze", "workspace", *arguments).startswith(text)


def test_poses_inside_pulleys_are_outside_what_is_drawn(cspm, tmp_path):
    content = point_content()
    for each in content["cables"]:
        each["pulley"] = {"radius": 0.15, "axis": [0, 0, -1]}
    (tmp_path / "pulleys.yaml").write_text(yaml.safe_dump(content))
    machine = cable_structure(build(content), (0.0, 0.0, 2.0, 0.0, 0.0, 0.0))
    grid = workspace_grids("point", machine.exits, machine.axes, [0.0] * 6)["general"]
    assert np.isnan(structures(machine, grid)).any()
    for command, pictures in (
        (("workspace", "--coarse", "2"), ("workspace.png", "maps.png")),
        (("manipulability", "--pose", "0.7,-0.9,0,0,0,0"), ("manipulability.png",)),
    ):
        place = f"{command[0]}_found"
        code, _, err = cspm("analyze", *command, "--testbed", "pulleys.yaml", "--out", place)
        assert (code, err) == (0, "")
        assert {each.name for each in (tmp_path / place).glob("*.png")} == set(pictures)


@pytest.mark.slow
def test_design_prints_draws_and_writes(cspm, tmp_path):
    code, out, err = cspm("analyze", "design", "--out", "found", "--json", "found.json")
    assert (code, err) == (0, "")
    data = json.loads((tmp_path / "found.json").read_text())
    assert set(data["motion"]) == {"designed", "sampled", "cascade", "late"}
    assert data["motion"]["designed"]["heave"]["gain_margin"] is None
    assert data["timing"]["torque_delay"] == 1
    assert data["growth"]["cascade"]["frequency"] == pytest.approx(26.4, abs=0.1)
    assert "motion controller every 1 ms" in out
    assert "grows as exp(0.0008" in out
    for name in ("motion_loops.png", "force_loops.png"):
        assert (tmp_path / "found" / name).stat().st_size > 30_000


@pytest.mark.parametrize(
    ("arguments", "text"),
    [
        (
            ["verification_mid"],
            "scenario verification_mid: control.mode locked_winches, allowed: closed_loop",
        ),
        (
            ["--computing", "0.0005"],
            "computing: 0.0005 s, allowed: a whole number of the plant's periods of 0.001 s",
        ),
        (["--computing", "-1"], "Invalid value for '--computing'"),
    ],
)
def test_bad_input_of_design_is_one_line(refused, arguments, text):
    assert refused("analyze", "design", *arguments).startswith(text)


@pytest.mark.slow
def test_manipulability_prints_draws_and_writes(cspm, tmp_path):
    code, out, err = cspm("analyze", "manipulability", "--out", "found", "--json", "found.json")
    assert (code, err) == (0, "")
    data = json.loads((tmp_path / "found.json").read_text())
    assert data["available_acceleration"]["heave"][1] == pytest.approx(5.911, abs=1e-3)
    assert data["force_ellipsoids"][0]["dofs"] == ["surge", "sway", "heave"]
    assert "heave         51.33 m/s²       5.911 m/s²" in out
    assert "thesis_refitted at [0, 0, 2, 0, 0, 0] (m, rad); rank of Jᵀ 5\n" in out
    assert data["rank"] == 5
    assert (tmp_path / "found" / "manipulability.png").stat().st_size > 30_000


def test_where_the_bar_cannot_rest_no_acceleration_is_reported(cspm, tmp_path):
    code, out, _ = cspm(
        *("analyze", "manipulability", "--pose", "0.34,0,2,0,0,0", "--json", "found.json")
    )
    assert code == 0
    assert json.loads((tmp_path / "found.json").read_text())["available_acceleration"]["yaw"] == [
        None,
        None,
    ]
    assert "none" in out


def test_reference_prints_draws_and_writes_what_it_needs(cspm, tmp_path):
    code, out, err = cspm(
        *("analyze", "reference", "worst_case_steep", "--set", "duration=20"),
        *("--out", "asked", "--json", "asked.json"),
    )
    assert (code, err) == (0, "")
    data = json.loads((tmp_path / "asked.json").read_text())
    assert f"wrench infeasible {data['unmet_share']:.1%} of the time, most in" in out
    assert data["unmet_share"] > 0.0
    assert f"at {data['worst']['time']:.4g} s" in out
    assert "motor torque within limits" in out
    assert (tmp_path / "asked" / "reference.png").stat().st_size > 20_000


def test_a_motor_that_the_reference_overloads_is_named(cspm):
    code, out, _ = cspm(
        *("analyze", "reference", "ipanema", "--set", "testbed.cables.c3.torque_limit=2.0")
    )
    assert code == 0
    assert "the wrench is feasible within the tension limits all the time" in out
    assert re.search(r"motor torque over its limit: c3 \d{3}%", out)


def test_a_run_without_a_reference_for_its_bar_is_refused(refused):
    assert refused("analyze", "reference", "one_winch").startswith(
        "one_winch: no bar follows a reference, allowed: control.mode closed_loop"
    )


def test_a_run_says_before_it_starts_where_its_reference_is_infeasible(cspm):
    arguments = ("--duration", "20", "--no-record")
    code, out, _ = cspm("run", "worst_case_steep", *arguments)
    assert code == 0
    assert re.search(r"reference infeasible within the tension limits, as at 1\d\.\d* s;", out)
    _, within, _ = cspm("run", "ipanema", "--no-record")
    assert "reference infeasible" not in within


def test_sag_prints_and_writes_what_heavy_cables_do(cspm, tmp_path):
    code, out, err = cspm(
        *("analyze", "sag", "cogiro", "--linear-density", "0.05", "--json", "sag.json")
    )
    assert (code, err) == (0, "")
    data = json.loads((tmp_path / "sag.json").read_text())
    worst = max(data["cables"], key=lambda each: each["sag"])
    assert f"largest sag {1e3 * worst['sag']:.3g} mm, of {worst['name']}\n" in out
    assert 0.01 < worst["sag"] < 0.03
    assert {each["linear_density"] for each in data["cables"]} == {0.05}


@pytest.mark.parametrize(
    ("arguments", "text"),
    [
        ([], "thesis_refitted: no linear density of hoist_1, allowed: --linear-density KG_PER_M"),
        (["--linear-density", "0"], "linear density 0 kg/m: allowed: above 0"),
    ],
)
def test_sag_without_a_density_is_refused(refused, arguments, text):
    assert refused("analyze", "sag", *arguments).startswith(text)


def test_sag_takes_the_density_of_the_testbeds_effect(cspm, tmp_path):
    text = (SCENARIOS / "testbeds" / "cogiro.yaml").read_text()
    effect = "effects: [{effect: cable_sag, parameters: {linear_density: 0.03}}]\n"
    (tmp_path / "heavy.yaml").write_text(text + effect)
    code, _, err = cspm(
        *("analyze", "sag", "cogiro", "--testbed", "heavy.yaml", "--json", "sag.json")
    )
    assert (code, err) == (0, "")
    data = json.loads((tmp_path / "sag.json").read_text())
    assert {each["linear_density"] for each in data["cables"]} == {0.03}


def test_commands_of_analyze_are_listed(cspm):
    code, out, _ = cspm("analyze", "--help")
    assert code == 0
    for name in ("linear", "workspace", "design", "manipulability", "sag", "reference"):
        assert name in out
