"""The command line, called in this process."""

import json
from importlib.metadata import version
from pathlib import Path

import pytest
from error_lines import said
from loops import WILD
from matplotlib.image import imread
from recording_samples import write_sample
from run_samples import SCENARIOS, bundle_of

from cspm.cli import main as cli
from cspm_msgs_py.recording import Recording, overview
from cspm_run.recorded_run import run

PNG = b"\x89PNG\r\n\x1a\n"


@pytest.fixture
def columns():
    return 100


def squeezed(text):
    """Text without line breaks, frames and repeated blanks."""
    return " ".join(text.replace("│", " ").split())


def test_run_leaves_recording_summary_and_picture(cspm, tmp_path):
    code, out, err = cspm("run", "rest", "--duration", "0.3", "--seed", "7", "--out", "bag")
    assert (code, err) == (0, "")
    files = {path.name for path in (tmp_path / "bag").iterdir()}
    assert files == {"bag_0.mcap", "metadata.yaml", "summary.json", "run.png", "run.svg"}
    summary = json.loads((tmp_path / "bag" / "summary.json").read_text())
    assert (summary["scenario"], summary["seed"], summary["mode"]) == ("rest", 7, "inprocess")
    assert summary["duration_s"] == pytest.approx(0.3)
    assert summary["real_time_factor"] > 0.0
    assert set(summary["errors"]["yaw"]) == {"max", "rms"}
    assert set(summary["tension"]) == {"min", "max"}
    assert summary["slack_share"] == summary["infeasible_share"] == 0.0
    assert summary["messages"]["/clock"] == 300
    assert (tmp_path / "bag" / "run.png").read_bytes().startswith(PNG)
    picture = imread(tmp_path / "bag" / "run.png")
    assert picture.shape[0] > 500
    assert picture.std() > 0.05
    with Recording(tmp_path / "bag") as recording:
        assert recording.complete
        assert recording.metadata["cspm"]["seed"] == "7"
        assert recording.topics["/clock"].count == 300
    assert "rest, seed 7" in out
    assert "simulated 0.3 s at " in out
    assert f"recording {tmp_path}/bag, picture bag/run.png" in out


def test_json_says_what_is_printed_and_nothing_is_recorded(cspm, tmp_path):
    code, _, err = cspm(
        *("run", "one_winch", "--duration", "0.05", "--no-record", "--json", "found.json"),
        *("--set", "seed=3", "--set", "control.torque.surge.offset=0.5"),
    )
    assert (code, err) == (0, "")
    assert [path.name for path in tmp_path.iterdir()] == ["found.json"]
    found = json.loads((tmp_path / "found.json").read_text())
    assert (found["seed"], found["messages"]) == (3, {})
    assert found["tension"]["max"] < 30.0  # 0.5 N·m at 0.025 m, and sines


def test_without_out_the_folder_names_scenario_and_time(cspm, tmp_path):
    code, *_ = cspm("run", "one_winch", "--duration", "0.01")
    assert code == 0
    [folder] = (tmp_path / "recordings").iterdir()
    assert folder.name.startswith("one_winch-20")


def test_a_scenario_file_of_ones_own(cspm, tmp_path):
    text = (SCENARIOS / "one_winch.yaml").read_text()
    place = SCENARIOS / "testbeds" / "one_winch.yaml"
    (tmp_path / "mine.yaml").write_text(text.replace("testbeds/one_winch.yaml", str(place)))
    code, _, err = cspm("run", "mine.yaml", "--duration", "0.01", "--out", "bag")
    assert (code, err) == (0, "")


@pytest.mark.parametrize(
    ("arguments", "text"),
    [
        (["run"], "Missing argument 'SCENARIO...'; see `cspm run --help`"),
        (["run", "rest", "--bogus"], "--bogus"),
        (["run", "rest", "--duration", "long"], "--duration"),
        (["run", "rest", "--seed", "1.5"], "--seed"),
        (["run", "rest", "--out"], "--out"),
        (["info", "bag", "twice"], "twice"),
        (["fly"], "fly"),
        (["--bogus"], "--bogus"),
        (["info"], "REC"),
    ],
)
def test_wrong_usage_is_one_line(refused, arguments, text):
    line = refused(*arguments)
    assert text in line
    assert "; see `cspm " in line
    assert line.endswith("--help`")


REST = f"{SCENARIOS}/rest.yaml"


@pytest.mark.parametrize(
    ("arguments", "line"),
    [
        (
            ["--mode", "fast"],
            "--mode fast: allowed: inprocess, graph, processes, realtime",
        ),
        (
            ["--mode", "graph", "--plant", "external"],
            "--plant external --mode graph: allowed: --mode realtime",
        ),
        (
            ["--mode", "graph", "--process-per-node"],
            "--process-per-node --mode graph: allowed: --mode realtime",
        ),
        (
            ["--own-node", "motion_controller"],
            "--own-node --mode inprocess: allowed: --mode processes",
        ),
        (
            ["--mode", "processes", "--own-node", "rudder"],
            "--own-node rudder: allowed: wave_trajectory, motion_controller, ",
        ),
        (["--anyway"], "--anyway in mode inprocess: allowed: mode realtime"),
        (
            ["--mode", "realtime", "--plant", "external", "--anyway"],
            "--anyway with plant external: allowed: sim, mujoco",
        ),
        (
            ["--patience", "5"],
            "--patience --mode inprocess: allowed: --mode graph, processes or re",
        ),
        *[
            (
                ["--mode", "processes", "--patience", seconds],
                f"--patience {seconds}: allowed: 0.1 s or more, finite",
            )
            for seconds in ("0", "-2", "nan", "inf")
        ],
        (["--one-process"], "--one-process --mode inprocess: allowed: --mode realtime"),
        (["--duration", "-1"], f"{REST}: duration: -1.0, allowed: greater than 0"),
        (["--duration", "0"], f"{REST}: duration: 0.0, allowed: greater than 0"),
        (
            ["--duration", "0.0015"],
            f"{REST}: duration: 0.0015 s, allowed: a whole number of the plant's periods of 1/1000"
            " s",
        ),
        (["--set", "seed"], "--set seed: allowed: key.path=value, such as seed=2"),
        (["--json", "nowhere/a.json"], "--json nowhere/a.json: allowed: a file in a folder that"),
        (["--json", "."], "--json .: allowed: a file in a folder that exists"),
    ],
)
def test_unusable_input_is_one_line(refused, tmp_path, arguments, line):
    assert refused("run", "rest", *arguments).startswith(line)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("arguments", [["--duration", "nan"], ["--seed", "-1"], ["--set", "a=1"]])
def test_unusable_values_name_file_and_key(refused, arguments):
    key = arguments[0].lstrip("-") if arguments[0] != "--set" else "a"
    line = refused("run", "rest", *arguments)
    assert line.startswith(f"{REST}: {key}: ")
    assert "allowed: " in line


def test_unknown_scenarios_list_the_known(refused):
    line = refused("run", "storm")
    assert line.startswith("storm: no such scenario, allowed: calm, ")
    assert line.endswith(" or a file")
    assert refused("run", "clam").endswith(" or a file; did you mean calm?")


def test_a_value_is_set_once(refused):
    for name, setting in (("duration", "duration=-1"), ("seed", "seed=3")):
        line = refused("run", "rest", "calm", f"--{name}", "1", "--set", setting)
        assert line == f"--set {setting}: --{name} sets it as well, allowed: one of both"
    assert refused("run", "rest", "--set", "duration=-1").startswith(f"{REST}: duration: ")


def test_folders_that_cannot_be_had(refused, tmp_path):
    (tmp_path / "taken").mkdir()
    (tmp_path / "file").write_text("")
    line = refused("run", "one_winch", "--duration", "0.01", "--out", "taken")
    assert line == "taken: already exists, allowed: a new folder"
    line = refused("run", "one_winch", "--duration", "0.01", "--out", "file/bag")
    assert line == f"{tmp_path}/file/bag: cannot be written (Not a directory)"


def test_long_lines_are_not_broken(refused, tmp_path, monkeypatch):
    monkeypatch.setenv("COLUMNS", "40")
    deep = "/".join(["folder"] * 20)
    line = refused("info", deep)
    assert line == f"{deep}: no such file or folder"


def test_a_summary_that_cannot_be_written(refused, tmp_path):
    if not Path("/dev/full").exists():
        pytest.skip("no /dev/full on this system")
    line = refused(
        "run", "one_winch", "--duration", "0.01", "--no-record", "--json", "/dev/full", code=1
    )
    assert line.endswith("No space left on device")


def test_a_divergence_is_one_line_and_leaves_a_readable_recording(refused, cspm, tmp_path):
    settings = [part for setting in WILD for part in ("--set", setting)]
    line = refused("run", "rest", *settings, "--out", "bag", code=1)
    assert line.startswith("diverged at t = 0.")
    assert "; before it: wrench infeasible since 0." in line
    assert "bar at [" in line
    files = {path.name for path in (tmp_path / "bag").iterdir()}
    assert files == {"bag_0.mcap", "metadata.yaml", "summary.json", "run.png", "run.svg"}
    assert overview(tmp_path / "bag").complete
    assert cspm("resim", "bag")[0] == 0


def test_info_shows_topics_rates_gaps_duration_and_scenario(cspm, tmp_path):
    run(bundle_of("rest"), tmp_path / "[bag]", steps=300)
    code, out, err = cspm("info", "[bag]", "--json", "info.json")
    assert (code, err) == (0, "")
    assert "[bag]" in out
    lines = {line.split()[0]: line.split()[1:] for line in out.splitlines() if "/msg/" in line}
    assert lines["/bar/pose"] == ["geometry_msgs/msg/PoseStamped", "30", "100.0", "10.000", "0.000"]
    assert lines["/truth/cables/unstretched_length"][0] == "sensor_msgs/msg/JointState"
    assert "scenario rest, seed 1, test-bed thesis, mode inprocess" in out
    assert "messages over 0.299 s" in out
    found = json.loads((tmp_path / "info.json").read_text())
    assert (found["scenario"], found["complete"], found["path"]) == ("rest", True, "[bag]")
    assert found["message_count"] == sum(topic["count"] for topic in found["topics"])


def test_a_cut_recording_is_reported_recovered_and_repeated(cspm, tmp_path):
    run(bundle_of("rest"), tmp_path / "bag", steps=400)
    [file] = (tmp_path / "bag").glob("*.mcap")
    file.write_bytes(file.read_bytes()[:150_000])
    code, out, _ = cspm("info", "bag")
    assert code == 0
    assert "cut short: `cspm recover bag` restores its index" in out
    code, out, _ = cspm("recover", "bag", "--json", "report.json")
    assert code == 0
    assert "the original is kept as bag_0.mcap.broken" in out
    report = json.loads((tmp_path / "report.json").read_text())
    assert report["restored"] == ["bag/bag_0.mcap"]
    assert report["kept"] == ["bag/bag_0.mcap.broken"]
    assert "cut short" not in cspm("info", "bag")[1]
    code, out, _ = cspm("recover", "bag")
    assert (code, out) == (0, "bag: complete, nothing to restore\n")
    code, out, _ = cspm("resim", "bag", "--json", "resim.json")
    assert code == 0
    found = json.loads((tmp_path / "resim.json").read_text())
    assert (found["identical"], found["first_difference"]) == (True, None)
    assert found["cut_at_s"] is None or 0.1 < found["cut_at_s"] < 0.4
    reported = (
        "" if found["cut_at_s"] is None else f", up to {found['cut_at_s']:g} s, where it was cut"
    )
    ((first, last),) = found["missing_s"]
    assert out.strip().splitlines() == [
        f"not recorded, or not run: {first:g} to {last:g} s of the scenario",
        f"identical: all {found['messages']} messages, bit for bit{reported}",
    ]
    assert 0.0 < first < 0.4
    assert last == pytest.approx(19.999)


def test_a_hole_is_named_with_its_remedy_by_every_command(cspm, refused, tmp_path):
    run(bundle_of("rest"), tmp_path / "bag", steps=400)
    [file] = (tmp_path / "bag").glob("*.mcap")
    content = bytearray(file.read_bytes())
    content[100_000:100_500] = bytes(500)
    file.write_bytes(content)
    for command in (["resim"], ["compare"], ["diagnose"], ["view", "--html", "x.html"]):
        line = refused(command[0], "bag", *command[1:])
        assert line.startswith("bag/bag_0.mcap: chunk at byte "), command
        assert line.endswith("; `cspm recover` leaves the damaged part out"), command
    assert cspm("recover", "bag")[0] == 0
    assert cspm("info", "bag")[0] == 0


def test_resim_reports_the_first_difference(cspm, tmp_path, monkeypatch):
    bundle = bundle_of("one_winch")
    run(bundle, tmp_path / "bag", steps=50)
    # The other bundle has one more sine digit: the recording was made by something else.
    reported = bundle_of("one_winch", "control.torque.surge.offset=0.7500000001")
    monkeypatch.setattr("cspm_run.resim.read_bundle", lambda *_: reported)
    code, out, err = cspm("resim", "bag", "--json", "resim.json")
    assert (code, err) == (1, "")
    assert out.strip().splitlines()[-1].startswith("different: /")
    found = json.loads((tmp_path / "resim.json").read_text())
    assert found["identical"] is False
    assert found["first_difference"]["index"] == 0
    assert found["first_difference"]["topic"].startswith("/")


def test_recordings_of_others_are_one_line(refused, tmp_path):
    write_sample(tmp_path / "other", 3)
    (tmp_path / "empty").mkdir()
    (tmp_path / "noise.mcap").write_bytes(bytes(range(256)))
    assert "scenario.yaml: testbed: missing" in refused("resim", "other")
    for command in ("info", "resim", "recover"):
        assert refused(command, "missing").startswith("missing: no such file or folder")
        assert refused(command, "empty").startswith("empty: a folder without ")
        assert refused(command, "noise.mcap").startswith("noise.mcap: ")


def test_cspm_alone_explains_itself(cspm):
    code, out, err = cspm()
    assert (code, err) == (0, "")
    text = squeezed(out)
    assert "Begin with `cspm run worst_case worst_case_past_thesis`." in text
    for command in ("run", "info", "recover", "resim"):
        assert f" {command} " in text


@pytest.mark.parametrize(
    ("command", "parts"),
    [
        (
            "run",
            [
                "SECONDS",
                "--set",
                "(SI, rad)",
                "one in recordings/, named after scenario and time",
                "cspm run calm --duration 60 --out calm_60s",
                "Scenarios: calm, ",
                "--no-record",
                "Ctrl-C",
                "Exit code: 0 done, 1 diverged or interrupted, 2 unusable input.",
            ],
        ),
        ("info", ["Example: cspm info recordings/", "Hz", "ms", "folder or its MCAP file"]),
        ("recover", ["Example: cspm recover recordings/", ".broken", "0.2 s"]),
        ("resim", ["Example: cspm resim recordings/", "Exit code: 0 identical, 1 different"]),
    ],
)
def test_help_teaches(cspm, command, parts):
    code, out, err = cspm(command, "--help")
    assert (code, err) == (0, "")
    text = squeezed(out)
    for part in ["--json", *parts]:
        assert part in text


def test_interrupting_the_start_is_no_traceback(cspm, monkeypatch):
    def interrupted(_):
        raise KeyboardInterrupt

    monkeypatch.setattr(cli, "find_scenario", interrupted)
    assert cspm("run", "rest") == (130, "", "")


def test_version_says_which(cspm):
    assert cspm("--version") == (0, f"cspm {version('cspm')}\n", "")


def test_several_scenarios_run_side_by_side(cspm, tmp_path):
    words = ("run", "rest", "worst_case", "--duration", "0.2", "--out", "both", "--json", "j.json")
    code, out, err = cspm(*words)
    assert (code, err) == (0, "")
    found = json.loads((tmp_path / "j.json").read_text())
    assert list(found) == ["rest", "worst_case"]
    for name, summary in found.items():
        assert summary["duration_s"] == pytest.approx(0.2)
        with Recording(tmp_path / "both" / name) as recording:
            assert recording.complete
            assert recording.metadata["cspm"]["scenario"] == name
        assert (tmp_path / "both" / name / "run.png").is_file()
        largest = 1e3 * summary["errors"]["heave"]["max"]
        assert f"{largest:.3g}, " in out
    assert json.loads((tmp_path / "both" / "summary.json").read_text()) == found
    picture = imread(tmp_path / "both" / "runs.png")
    assert picture.shape[1] > 1000
    assert picture.std() > 0.05
    assert "next: `cspm run rest worst_case --seed 2`" in squeezed(out)


@pytest.mark.parametrize(
    ("words", "line"),
    [
        (("rest", "rest"), "scenario rest: named twice, allowed: once each"),
        (
            ("rest", "one_winch"),
            "scenarios rest and one_winch: machines with other cables, allowed: machines with the"
            " same, or one scenario at a time",
        ),
        (("rest", "calm", "--mode", "graph"), "--mode graph: allowed with several scenarios:"),
        (("rest", "calm", "--plant", "external"), "--plant external: allowed with one scenario"),
    ],
)
def test_what_cannot_run_side_by_side_is_one_line(cspm, words, line):
    code, out, err = cspm("run", *words, "--no-record", "--duration", "0.1")
    assert (code, out) == (2, "")
    assert said(err).startswith(line)
