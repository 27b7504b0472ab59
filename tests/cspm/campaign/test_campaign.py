"""A campaign on this computer, from its file to its table, page and recordings."""

import json
import os
import signal
import subprocess

import campaigns
import numpy as np
import pandas
import pytest
from accessibility import serious_findings
from driven_browser import driven_browser
from waiting import PATIENCE_S, until

import cspm

pytestmark = [pytest.mark.compiled, pytest.mark.slow]

METRICS = '''\
"""What one laboratory looks at."""

import os
import threading
from pathlib import Path


def peak(run):
    return {"tension": run.tension.values.max(), "nothing": float("nan")}


def troubled(run):
    seed, mark = run.summary["seed"], Path(os.environ["MARK"])
    if seed == 2:
        raise ValueError("no settling")
    if seed == 3:
        os._exit(9)
    if seed == 5 and not mark.exists():
        mark.touch()
        os._exit(9)
    if seed == 4:
        threading.Event().wait()
    return 1.0
'''


@pytest.fixture(scope="module")
def sweep(tmp_path_factory):
    """A campaign with axes of each kind, an own metric, and recordings."""
    folder = tmp_path_factory.mktemp("sweep")
    campaigns.written(folder, METRICS, "metrics.py")
    text = """\
scenario: calm
set: {duration: 0.5}
grid:
  seed: [1, 2]
  testbed.bar.mass: [4.06, 4.4]
  effects.winch_coulomb_friction@sway_3:torque: [null, 0.02]
metrics: ['metrics.py:peak']
recordings: {worst: 1, of: errors.surge.max, runs: [0]}
"""
    code, out, err = campaigns.run(campaigns.written(folder, text), "--json", "found.json")
    assert (code, err) == (0, "")
    return folder, out


def test_a_row_is_the_run_that_simulate_makes(sweep):
    rows = campaigns.rows(sweep[0] / "campaigns/sweep")
    assert [row["run"] for row in rows] == [*range(8)]
    for row in rows:
        assert row["status"] == "done"
        machine = cspm.load_scenario("calm").testbed.with_parameter(
            "bar.mass", row["testbed.bar.mass"]
        )
        torque = row["effects.winch_coulomb_friction@sway_3:torque"]
        if torque is not None:
            machine = machine.with_effect("winch_coulomb_friction", "sway_3", torque=torque)
        run = cspm.simulate("calm", testbed=machine, seed=row["seed"], duration=0.5)
        assert row["errors.surge.max"] == run.errors["surge"]["max"]
        assert row["tension.max"] == run.summary["tension"]["max"]
        assert row["testbed_sha256"] == machine.sha256
        assert row["peak.tension"] == run.tension.values.max()
        assert row["peak.nothing"] is None


def test_recordings_are_those_of_the_chosen_runs(sweep):
    folder = sweep[0] / "campaigns/sweep"
    rows = campaigns.rows(folder)
    worst = max(rows, key=lambda row: row["errors.surge.max"])["run"]
    assert {each.name for each in (folder / "recordings").iterdir()} == {
        "run_0",
        f"run_{worst}",
    }
    for number in (0, worst):
        recording = cspm.open(folder / f"recordings/run_{number}")
        assert recording.tension.values.max() == rows[number]["peak.tension"]
        assert (folder / f"recordings/run_{number}/run.png").exists()


def test_the_command_on_the_page_repeats_the_run(sweep):
    found = json.loads((sweep[0] / "found.json").read_text())
    worst = found["worst"][0]
    words = worst["command"].split()
    assert words[:2] == ["cspm", "run"]
    subprocess.run(
        [campaigns.CSPM, *words[1:], "--no-record", "--json", "again.json"],
        cwd=sweep[0],
        check=True,
        capture_output=True,
    )
    again = json.loads((sweep[0] / "again.json").read_text())
    assert again["errors"]["surge"]["max"] == worst["value"]
    page = (sweep[0] / "campaigns/sweep/campaign.html").read_text()
    assert worst["command"] in page
    assert "8 of 8 runs: 8 done" in page


def test_the_page_is_drawn_for_everybody(sweep, tmp_path):
    page = (sweep[0] / "campaigns/sweep/campaign.html").as_uri()
    drawn = "return document.querySelectorAll('.main-svg').length;"
    with driven_browser(tmp_path / "profile") as browser:
        for width in (1200, 400):
            browser.open(page, width=width)
            until(lambda: browser.run(drawn) > 2, "the plots")
            assert browser.run("return document.documentElement.scrollWidth;") <= width
            assert serious_findings(browser) == []
        assert browser.errors() == []


def test_pandas_reads_the_table(sweep):
    frame = pandas.read_parquet(sweep[0] / "campaigns/sweep/runs.parquet")
    assert len(frame) == 8
    assert frame.groupby("seed")["tension.max"].count().to_dict() == {1: 4, 2: 4}


def test_what_is_there_is_not_run_again(sweep):
    folder = sweep[0] / "campaigns/sweep"
    before = (folder / "runs.jsonl").read_bytes()
    code, out, _ = campaigns.run(sweep[0] / "sweep.yaml")
    assert code == 0
    assert "dashboard" not in out
    assert (folder / "runs.jsonl").read_bytes() == before


def test_another_campaign_in_its_folder_is_refused(sweep, tmp_path):
    other = campaigns.written(tmp_path)
    code, _, err = campaigns.run(other, "--out", sweep[0] / "campaigns/sweep")
    assert code == 2
    assert "begun with another file, allowed: a new folder, by --out" in err


@pytest.fixture(scope="module")
def troubled(tmp_path_factory):
    """Seeds of which 2 raises, 3 kills its worker, 4 hangs, and 5 kills its worker once."""
    folder = tmp_path_factory.mktemp("troubled")
    campaigns.written(folder, METRICS, "metrics.py")
    text = campaigns.SWEEP.replace("to: 4", "to: 6") + "metrics: ['metrics.py:troubled']\n"
    environment = os.environ | {"MARK": str(folder / "mark")}
    options = ("--workers", 2, "--time-limit", 25)
    file = campaigns.written(folder, text)
    code, out, err = campaigns.run(file, *options, env=environment)
    rows = {row["seed"]: row for row in campaigns.rows(folder / "campaigns/sweep")}
    assert [*rows] == [1, 2, 3, 4, 5, 6]
    return rows, code, out, err


def test_all_other_runs_are_complete_and_the_command_says_that_some_are_not(troubled):
    rows, code, _, err = troubled
    assert {seed: row["status"] for seed, row in rows.items()} == {
        1: "done",
        2: "refused",
        3: "lost",
        4: "lost",
        5: "done",
        6: "done",
    }
    assert (code, err) == (1, "")


def test_what_one_run_gets_wrong_is_in_its_row(troubled):
    rows, _, out, _ = troubled
    assert rows[2]["failure"].endswith("metrics.py:troubled: ValueError: no settling")
    assert "run 1 refused" in out


@pytest.mark.parametrize("seed", [3, 4])
def test_a_run_that_kills_or_stops_its_worker_is_given_up_after_three_tries(troubled, seed):
    rows, _, out, _ = troubled
    assert f"run {seed - 1}: its worker was lost 3 times, given up" in out
    assert "died, ran out of memory or took too long" in rows[seed]["failure"]


def test_a_worker_that_dies_costs_its_run_once_more(troubled):
    _, _, out, _ = troubled
    assert "run 4: its worker was lost, try 2 of 3" in out
    assert "run 4: its worker was lost, try 3 of 3" not in out


@pytest.mark.parametrize("how", [signal.SIGINT, signal.SIGKILL])
def test_an_interrupted_campaign_goes_on_where_it_was(tmp_path, how):
    text = campaigns.SWEEP.replace("to: 4", "to: 200")
    file, folder = campaigns.written(tmp_path, text), tmp_path / "campaigns/sweep"
    program = campaigns.begun(file, "--workers", 1, start_new_session=True)
    until(lambda: campaigns.journalled(folder) >= 2, "two runs")
    # A terminal sends Ctrl-C to the workers as well.
    os.killpg(program.pid, how) if how == signal.SIGINT else program.send_signal(how)
    out, err = program.communicate(timeout=PATIENCE_S)
    kept = campaigns.journalled(folder)
    assert 2 <= kept < 200
    if how == signal.SIGINT:
        assert program.returncode == 1
        assert err == ""
        assert f"interrupted: {kept} of 200 runs are kept; the same command goes on" in out
        assert len(campaigns.rows(folder)) == kept
    first = (folder / "runs.jsonl").read_text().splitlines()[:kept]
    again = campaigns.begun(file, "--workers", 1)
    until(lambda: campaigns.journalled(folder) > kept, "one more run")
    again.send_signal(signal.SIGINT)
    again.communicate(timeout=PATIENCE_S)
    lines = (folder / "runs.jsonl").read_text().splitlines()
    assert lines[:kept] == first
    numbers = [json.loads(line)["run"] for line in lines]
    assert len({*numbers}) == len(numbers)


def test_a_fault_of_a_value_ends_it_before_anything_runs(tmp_path):
    text = "scenario: calm\ngrid: {testbed.bar.mass: [4.06, -1]}\n"
    code, _, err = campaigns.run(campaigns.written(tmp_path, text))
    assert code == 2
    assert "bar.mass: -1" in err
    assert "dashboard" not in err
    assert len(err.splitlines()) == 1


def test_each_run_may_be_diagnosed_by_the_machine_before_its_effects(tmp_path):
    text = """\
scenario: one_winch
set: {duration: 15}
grid: {effects: [null, 'winch_coulomb_friction@surge:torque=0.03']}
diagnose: true
"""
    code, out, _ = campaigns.run(campaigns.written(tmp_path, text))
    healthy, worn = campaigns.rows(tmp_path / "campaigns/sweep")
    assert code == 0, out
    assert healthy["diagnosis.verdict"] == "consistent"
    assert worn["diagnosis.effect"] == "winch_coulomb_friction"
    assert worn["diagnosis.elements"] == "surge"


def test_the_runs_are_listed_as_commands(tmp_path):
    code, out, _ = campaigns.run(campaigns.written(tmp_path), "--list")
    assert code == 0
    assert out.splitlines() == [
        f"cspm run calm --set duration=0.5 --set seed={seed}" for seed in (1, 2, 3, 4)
    ]


def test_correlations_show_what_moves_a_metric():
    from cspm.campaign.summary import _sensitivities

    random = np.random.default_rng(1)
    mass, noise = random.uniform(3, 5, 40), random.normal(size=40)
    rows = [
        {"testbed.bar.mass": m, "seed": i, "tension.max": 2 * m, "slack_share": s}
        for i, (m, s) in enumerate(zip(mass, noise, strict=True))
    ]
    metrics = ["tension.max", "slack_share"]
    found = _sensitivities(rows, ["testbed.bar.mass", "seed"], metrics)
    assert [*found] == ["testbed.bar.mass"]
    assert found["testbed.bar.mass"]["tension.max"]["rho"] == pytest.approx(1.0)
    assert found["testbed.bar.mass"]["slack_share"]["p"] > 0.01
