"""What a campaign's file may say, and what each fault is answered with."""

import io
import sys

import pytest
from rich.console import Console

import cspm.campaign
from cspm.campaign.campaign_file import load_campaign
from cspm.campaign.variants import variants_of
from cspm.commands.campaign_command import list_command, spread_table
from cspm_msgs_py.errors import InputError


def written(folder, text):
    path = folder / "sweep.yaml"
    path.write_text(text)
    return path


def test_names_of_scenarios_and_files_become_absolute(tmp_path):
    (tmp_path / "peak.py").write_text("def peak(run): return 1.0\n")
    (tmp_path / "pi.py").write_text("class PI: ...\n")
    text = (
        "scenario: calm\n"
        "testbed: thesis\n"
        "grid: {scenario: [calm, worst_case], controllers.force_controller: ['pi.py:PI']}\n"
        "metrics: ['peak.py:peak', 'math:sqrt']\n"
    )
    file = load_campaign(written(tmp_path, text))
    assert file.name == "sweep"
    assert file.scenario.endswith("/scenarios/calm.yaml")
    assert file.testbed.endswith("/testbeds/thesis.yaml")
    assert [each.rpartition("/")[2] for each in file.grid["scenario"]] == [
        "calm.yaml",
        "worst_case.yaml",
    ]
    assert file.grid["controllers.force_controller"] == [f"{tmp_path}/pi.py:PI"]
    assert file.metrics == (f"{tmp_path}/peak.py:peak", "math:sqrt")


@pytest.mark.parametrize(
    ("text", "fault"),
    [
        ("grid: {seed: [1]}", "scenario: missing"),
        ("scenario: nowhere", "nowhere: no such scenario, allowed: "),
        ("scenario: calm\nplant: clay", "plant: clay, allowed: sim, mujoco"),
        ("scenario: calm\nruns: 3", "runs: "),
        ("scenario: calm\ngrid: {seed: []}", "grid.seed: an empty list"),
        (
            "scenario: calm\ngrid: {duration: {from: 1, to: 2.5}}",
            "no count, allowed: one, or whole",
        ),
        (
            "scenario: calm\ngrid: {seed: {from: 5, to: 1}}",
            "from: 5, to: 1, allowed: from below to",
        ),
        (
            "scenario: calm\ngrid: {duration: {from: 0, to: 1, count: 3, scale: log}}",
            "allowed: a number above 0",
        ),
        ("scenario: calm\nset: {seed: 1}\ngrid: {seed: [1]}", "seed: varied or set twice"),
        ("scenario: calm\nmetrics: [peak]", "allowed: FILE.py:FUNCTION or MODULE:FUNCTION"),
        ("scenario: calm\nmetrics: ['peak.py:peak']", "peak.py:peak: no such file"),
        ("scenario: calm\nrecordings: {worst: 2}", "of: missing"),
        ("scenario: calm\nsample: {count: 0, ranges: {seed: {from: 0, to: 1}}}", "sample.count"),
    ],
)
def test_a_fault_is_one_line_that_names_file_key_and_what_is_allowed(tmp_path, text, fault):
    with pytest.raises(InputError) as caught:
        load_campaign(written(tmp_path, text))
    assert "sweep.yaml" in str(caught.value) or "scenario" in str(caught.value)
    assert fault in str(caught.value)
    assert "\n" not in str(caught.value)


def test_an_effect_without_parameter_is_refused(tmp_path):
    text = "scenario: calm\ngrid: {effects.winch_coulomb_friction@sway_3: [0.02]}"
    with pytest.raises(InputError, match=r"allowed: effects\.EFFECT@ELEMENTS:PARAMETER"):
        variants_of(load_campaign(written(tmp_path, text)))


def test_the_table_of_a_campaign_is_whole_on_a_terminal_of_60_columns():
    each = {"scale": 1e3, "unit": "mrad", "least": 1.23456e-7, "median": 0.0123456}
    row = each | {"p95": 0.123456, "largest": 12.3456}
    names = ["errors.pitch.max", "infeasible_share", "tension.min"]
    console = Console(width=60, file=io.StringIO())
    console.print(spread_table("a campaign: 3 runs", dict.fromkeys(names, row)))
    text = console.file.getvalue()
    for word in (*names, "0.000123", "12.3", "123", "1.23e+04", "mrad", "largest"):
        assert word in text
    assert "…" not in text


@pytest.mark.parametrize("absent", ["distributed", "pyarrow"])
def test_a_campaign_without_its_engine_is_one_line(tmp_path, monkeypatch, absent):
    monkeypatch.setitem(sys.modules, absent, None)
    line = (
        rf"^campaign: {absent} is not installed, allowed: after `pip install 'cspm\[campaign\]'`$"
    )
    with pytest.raises(InputError, match=line):
        list_command(written(tmp_path, "scenario: calm"), None)
    with pytest.raises(InputError, match=line):
        cspm.campaign.run_campaign  # noqa: B018
