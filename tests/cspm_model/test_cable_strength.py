"""Breaking force and safety factor: what a cable may carry, and who says when it is more."""

import json

import numpy as np
import pytest
from machines import WINCH, build, changed, general_content, rig_content
from run_samples import SCENARIOS, bundle_of

from cspm.simulation import simulate
from cspm_model.cable_strength import allowed_tensions, limit_warnings, load_warnings
from cspm_msgs_py.errors import InputError
from cspm_run.recorded_run import run

ROPED = "cables.0.breaking_force"


def rig(breaking=None, factor=None, machine=3.0, limit=60.0):
    content = changed(rig_content(), "cables.0.tension_limits", [0.0, limit])
    content["safety_factor"] = machine
    content["cables"][0] |= {"breaking_force": breaking, "safety_factor": factor}
    return build(content)


@pytest.mark.parametrize(
    ("arguments", "allowed"),
    [
        ({}, np.inf),
        ({"breaking": 150.0}, 50.0),
        ({"breaking": 150.0, "machine": 5.0}, 30.0),
        ({"breaking": 150.0, "factor": 2.0, "machine": 5.0}, 75.0),
    ],
)
def test_what_a_cable_may_carry(arguments, allowed):
    assert allowed_tensions(rig(**arguments)).tolist() == [allowed]


def test_the_factor_is_three_where_nobody_says():
    assert build(changed(rig_content(), ROPED, 150.0)).safety_factor == 3.0


def test_a_limit_beyond_the_strength_is_one_line_that_says_all():
    assert limit_warnings(rig(breaking=179.0)) == (
        "cables.only.tension_limits: up to 60 N, allowed: at most 59.67 N, its breaking force of"
        " 179 N over the safety factor 3; lower the limit",
    )


@pytest.mark.parametrize("arguments", [{}, {"breaking": 180.0}, {"breaking": 500.0}])
def test_a_limit_within_the_strength_is_no_matter(arguments):
    assert limit_warnings(rig(**arguments)) == ()


def test_what_was_carried_counts_by_cable():
    content = changed(general_content(), "cables.2.breaking_force", 90.0)
    machine = build(changed(content, "cables.5.breaking_force", 90.0))
    highest = np.full(8, 200.0)
    highest[5] = 30.0
    (line,) = load_warnings(machine, highest)
    assert line == (
        "c2 carried 200 N, allowed: at most 30 N, its breaking force of 90 N over the safety factor"
        " 3; move less, or take a stronger cable"
    )


@pytest.mark.parametrize(
    ("path", "value", "text"),
    [
        (ROPED, 0.0, "cables[0].breaking_force: 0.0, allowed: greater than 0"),
        ("cables.0.safety_factor", 0.9, "cables[0].safety_factor: 0.9, allowed: greater than or"),
        ("safety_factor", 0.0, "safety_factor: 0.0, allowed: greater than or equal to 1"),
    ],
)
def test_each_fault_of_the_file_is_one_line(path, value, text):
    with pytest.raises(InputError) as caught:
        build(changed(rig_content(), path, value))
    assert str(caught.value).startswith(f"test.yaml: {text}")


def test_a_winch_without_cable_has_nothing_that_breaks():
    with pytest.raises(InputError) as caught:
        build({"name": "bare", "cables": [{"name": "w", **WINCH, "breaking_force": 9.0}]})
    assert str(caught.value) == (
        "test.yaml: cables[0].breaking_force: 9 N of w, a winch without cable, allowed: none"
    )


def test_the_thesis_has_a_factor_and_no_breaking_force():
    file = bundle_of("rest").testbed
    assert file.provenance["safety_factor"].provenance == "thesis"
    assert not np.isfinite(allowed_tensions(file.testbed)).any()


@pytest.fixture
def weak(tmp_path):
    """One winch, whose cable of 99 N carries 33 to 35 N and may carry 33 N."""
    text = (SCENARIOS / "testbeds" / "one_winch.yaml").read_text()
    path = tmp_path / "weak.yaml"
    path.write_text(
        text.replace("    offset_length:", "    breaking_force: 99.0\n    offset_length:")
    )
    return path


def test_a_run_says_so_on_its_way_and_in_its_summary(cspm, weak, tmp_path):
    arguments = ("--testbed", weak, "--duration", "0.02", "--out", "bag")
    code, out, err = cspm("run", "one_winch", *arguments)
    first = "cables.surge.tension_limits: up to 100 N, allowed: at most 33 N, its breaking force"
    second = "surge carried 34.54 N, allowed: at most 33 N, its breaking force of 99 N over"
    assert code == 0
    assert err.count("\n") == 1
    assert err.startswith(f"warning: {first}")
    assert f"warning: {second}" in out
    reported = json.loads((tmp_path / "bag" / "summary.json").read_text())["warnings"]
    assert len(reported) == 2
    assert reported[0].startswith(first)
    assert reported[1].startswith(second)


def test_runs_side_by_side_say_whose_cable_it_is(cspm, weak, tmp_path):
    text = (SCENARIOS / "one_winch.yaml").read_text()
    for name in ("left", "right"):
        (tmp_path / f"{name}.yaml").write_text(text.replace("name: one_winch", f"name: {name}"))
    options = ("--testbed", weak, "--duration", "0.02", "--no-record")
    code, out, _ = cspm("run", "left.yaml", "right.yaml", *options)
    assert code == 0
    for name in ("left", "right"):
        assert f"warning: {name}: surge carried 34.54 N, allowed: at most 33 N" in out


def test_a_script_is_warned(weak):
    with pytest.warns(UserWarning, match="its breaking force of 99 N") as caught:
        found = simulate("one_winch", testbed=weak, duration=0.02)
    reported = [str(each.message) for each in caught]
    assert reported == [f"one_winch: {line}" for line in found.summary["warnings"]]
    assert len(reported) == 2


def test_without_a_breaking_force_nobody_warns():
    result = run(bundle_of("one_winch"), None, steps=20)
    assert result.warnings == ()
    assert result.statistics.highest_tensions == pytest.approx([34.54], abs=0.005)
    assert result.statistics.highest_tensions[0] == result.statistics.tension_range[1]
