"""`cspm run --controllers`: one scenario under several motion controllers."""

import json

import pytest

from cspm_msgs_py.recording import Recording

LAWS = ("pid", "computed_wrench", "lqr", "pd_plus")


@pytest.fixture
def columns():
    return 140


def test_one_scenario_runs_under_each_controller(cspm, tmp_path):
    words = ("--controllers", ",".join(LAWS), "--duration", "0.2", "--json", "j.json")
    code, out, err = cspm("run", "calm", *words, "--out", "all")
    assert (code, err) == (0, "")
    found = json.loads((tmp_path / "j.json").read_text())
    assert tuple(found) == LAWS
    assert {summary["scenario"] for summary in found.values()} == {"calm"}
    assert {summary["seed"] for summary in found.values()} == {1}
    assert {path.name for path in (tmp_path / "all").iterdir()} == {
        *LAWS,
        "summary.json",
        "runs.png",
        "runs.svg",
    }
    for law in LAWS:
        with Recording(tmp_path / "all" / law) as recording:
            assert recording.complete
            assert recording.metadata["cspm"]["scenario"] == "calm"
    head = next(line for line in out.splitlines() if "required" in line)
    assert [word for word in head.split() if word in LAWS] == list(LAWS)
    assert "calm, seed 1: reference − pose, largest and RMS" in out
    for summary in found.values():
        assert f"{1e3 * summary['errors']['heave']['max']:.3g}, " in out
    assert len({summary["errors"]["heave"]["rms"] for summary in found.values()}) == len(LAWS)
    assert f"next: `cspm run calm --controllers {','.join(LAWS)} --seed 2`" in out


def test_the_scenario_s_own_controller_keeps_its_settings(cspm, tmp_path):
    own = ("worst_case_past_thesis", "--duration", "0.1", "--json")
    assert cspm("run", *own, "alone.json", "--no-record")[0] == 0
    laws = ("--controllers", "computed_wrench,lqr", "--no-record")
    assert cspm("run", *own, "both.json", *laws)[0] == 0
    alone = json.loads((tmp_path / "alone.json").read_text())
    both = json.loads((tmp_path / "both.json").read_text())
    assert both["computed_wrench"]["errors"] == alone["errors"]
    assert both["lqr"]["errors"] != alone["errors"]


def test_all_controllers_get_the_coordinates_that_are_set(cspm, tmp_path):
    words = ("--controllers", "pid,lqr", "--set", "control.motion.dofs=[heave, pitch]")
    code = cspm("run", "rest", *words, "--duration", "0.1", "--no-record", "--json", "j.json")[0]
    assert code == 0
    found = json.loads((tmp_path / "j.json").read_text())
    assert [found[law]["controlled"] for law in ("pid", "lqr")] == [["heave", "pitch"]] * 2


ONLY_ONE = (
    "with --controllers, which sets it too, allowed: only one of them, or control.motion.dofs and"
    " control.motion.design_pose"
)


@pytest.mark.parametrize(
    ("words", "line"),
    [
        (
            ("rest", "--controllers", "pid,lqg"),
            "--controllers lqg: allowed: pid, computed_wrench, pd_plus, lqr",
        ),
        (
            ("rest", "--controllers", "lqr,pid,lqr"),
            "--controllers lqr: named twice, allowed: once each",
        ),
        (
            ("rest", "calm", "--controllers", "pid,lqr"),
            "--controllers: with 2 scenarios, allowed: with one scenario",
        ),
        (
            ("rest", "--controllers", "pid,lqr", "--set", "control.motion.law=lqr"),
            f"--set control.motion.law=lqr: {ONLY_ONE}",
        ),
        (
            ("rest", "--controllers", "pid,lqr", "--set", "control={mode: closed_loop}"),
            f"--set control={{mode: closed_loop}}: {ONLY_ONE}",
        ),
        (
            ("one_winch", "--controllers", "pid,lqr"),
            "--controllers: scenario one_winch has none in mode torque, allowed: a scenario in"
            " mode closed_loop without controllers.motion_controller",
        ),
        (
            ("rest", "--controllers", "pid", "--set", "controllers.motion_controller=a.py:A"),
            "--controllers: scenario rest has one of its own, allowed: a scenario in mode"
            " closed_loop without controllers.motion_controller",
        ),
        (
            ("rest", "--controllers", "pid", "--mode", "graph"),
            "--mode graph: allowed with --controllers: inprocess",
        ),
        (
            ("rest", "--controllers", "pid", "--plant", "external"),
            "--plant external: allowed with one scenario, without --controllers",
        ),
        (
            ("rest", "--controllers", "pid", "--own-node", "motion_controller"),
            "--own-node motion_controller: allowed with one scenario, without --controllers",
        ),
        (
            ("rest", "calm", "--own-node", "motion_controller"),
            "--own-node motion_controller: allowed with one scenario",
        ),
    ],
)
def test_what_cannot_be_compared_is_one_line(cspm, words, line):
    code, out, err = cspm("run", *words, "--no-record", "--duration", "0.1")
    assert (code, out, err) == (2, "", f"cspm run: {line}\n")
