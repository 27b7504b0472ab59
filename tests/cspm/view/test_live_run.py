"""A run that is watched: its page follows it, holds it, and begins it again otherwise."""

import json
import signal
import threading
import time
import urllib.error
import urllib.request

import numpy as np
import pytest
from accessibility import serious_findings
from cspm_process import child
from driven_browser import driven_browser
from error_lines import said
from waiting import PATIENCE_S, until

import cspm
from cspm.simulation import bundle_of
from cspm.view.growing import GrowingRecording
from cspm.view.knobs import GAIN, PACE, SEA, Knob, effects_on, knobs_of, turned
from cspm.view.live_run import LiveRun, Restart
from cspm_msgs_py.errors import InputError

WORN = "winch_coulomb_friction@sway_3:torque=0.02"


@pytest.fixture(scope="module")
def calm():
    return bundle_of(cspm.load_scenario("calm"), None, "sim")


def names(knobs):
    return [each.name for each in knobs]


def test_what_may_be_turned_is_what_the_scenario_has(calm):
    assert names(knobs_of(calm.scenario, [WORN], paced=True)) == [
        *(PACE, GAIN, SEA, f"effect {WORN}"),
    ]
    rest = bundle_of(cspm.load_scenario("rig_stiffness_surge"), None, "sim")
    assert names(knobs_of(rest.scenario, [], paced=False)) == []


def test_knobs_at_one_leave_the_run_as_it_is(calm):
    assert turned(calm, knobs_of(calm.scenario, [], paced=True)).scenario == calm.scenario


def test_gains_and_sea_are_scaled(calm):
    knobs = [each.at(0.5) for each in knobs_of(calm.scenario, [], paced=False)]
    found = turned(calm, knobs).scenario
    for dof, gains in calm.scenario.control.motion.gains.items():
        half = found.control.motion.gains[dof]
        assert (half.kp, half.ki, half.kd) == (0.5 * gains.kp, 0.5 * gains.ki, 0.5 * gains.kd)
    for role in ("target", "winch_frame"):
        before, after = getattr(calm.scenario, role), getattr(found, role)
        np.testing.assert_allclose(
            after.motion.amplitudes, np.multiply(0.5, before.motion.amplitudes)
        )


def test_effects_are_on_until_they_are_switched_off():
    knobs = [Knob("effect a", "a", "switch", True), Knob("effect b", "b", "switch", True)]
    assert effects_on(knobs) == ["a", "b"]
    assert effects_on([knobs[0].at(False), knobs[1]]) == ["b"]


@pytest.mark.parametrize("value", [3.0, -1.0, "much", None, True])
def test_a_value_that_a_knob_cannot_have_is_refused(value):
    with pytest.raises(InputError, match=r"gain: .*, allowed: 0\.1 to 2"):
        Knob(GAIN, "", "range", 1.0, 0.1, 2.0).at(value)


def watched():
    live = LiveRun([Knob(GAIN, "", "range", 1.0, 0.1, 2.0)], can_pause=True)
    live._due = time.monotonic()
    return live


def test_a_paused_run_waits_until_it_may_go_on():
    live, passed = watched(), threading.Event()
    live.turn("pause", True)
    thread = threading.Thread(target=lambda: (live.hold(0.1), passed.set()))
    thread.start()
    assert not passed.wait(0.2)
    live.turn("pause", False)
    assert passed.wait(PATIENCE_S)
    thread.join()


def test_a_turned_knob_ends_the_run_even_while_it_is_paused():
    live = watched()
    live.turn("pause", True)
    live.turn(GAIN, 0.5)
    with pytest.raises(Restart):
        live.hold(0.1)
    assert live.knobs[0].value == 0.5


def test_what_is_no_knob_is_refused():
    with pytest.raises(InputError, match=r"^brake: no knob, allowed: pause, gain$"):
        watched().turn("brake", 1.0)


@pytest.mark.parametrize(
    ("words", "line"),
    [
        (["worst_case"], "--view: with several runs, allowed: one scenario, no --controllers"),
        (["--plant", "external"], "--plant external --mode inprocess: allowed: --mode realtime"),
        (["--own-node", "plant"], "--own-node --mode inprocess: allowed: --mode processes"),
        (["--process-per-node"], "--process-per-node --mode inprocess: allowed: --mode realtime"),
        (["--no-record"], "--view --no-record: allowed: one of both, since recordings are shown"),
    ],
)
def test_what_cannot_be_watched_is_refused(cspm, words, line):
    code, _, err = cspm("run", "calm", "--view", *words)
    assert (code, said(err)) == (2, f"{line}\n")


COUNT = "return view.runs[0].count;"
STATE = "return live.words ? live.words.textContent : '';"


def frames_within(browser, seconds):
    before = browser.run(COUNT)
    browser.run(f"await new Promise(done => setTimeout(done, {1000 * seconds}));")
    return browser.run(COUNT) - before


def asked(url, data=None, **headers):
    request = urllib.request.Request(url, data, headers)
    try:
        with urllib.request.urlopen(request, timeout=60) as answer:
            return answer.status, answer.read()
    except urllib.error.HTTPError as err:
        return err.code, err.read()


@pytest.mark.compiled
@pytest.mark.slow
def test_a_page_follows_a_run_holds_it_and_begins_it_again(tmp_path):
    options = ("--duration", 60, "--view", "--port", 0, "--no-browser", "--effect", WORN)
    program = child("run", "calm", *options, "--out", "watched", cwd=tmp_path)
    try:
        line = program.stdout.readline()
        while not line.startswith("view "):
            line = program.stdout.readline()
        url = line.split()[1]
        until(lambda: b'"count"' in asked(f"{url}run?after=")[1], "the first frames")
        with driven_browser(tmp_path / "profile") as browser:
            browser.open(url)
            until(lambda: browser.run(STATE) == "the run goes on", "the run's state")
            first = browser.run(COUNT)
            until(lambda: browser.run(COUNT) > first, "more frames")
            browser.run("document.getElementById('hold').click();")
            until(lambda: browser.run(STATE) == "the run is paused", "the pause")
            until(lambda: frames_within(browser, 1.5) == 0, "a page that has caught up")
            assert frames_within(browser, 1.5) == 0
            assert browser.run(STATE) == "the run is paused"
            browser.run("send('sea', 0.5);")
            until(lambda: browser.run("return view.runs[0].name;") == "watched_2", "another run")
            browser.open(url, width=400)
            until(lambda: browser.run(STATE) == "the run goes on", "the page of 400 px")
            assert browser.run("return document.documentElement.scrollWidth;") <= 400
            assert serious_findings(browser) == []
            assert browser.errors() == []
        own = url.rstrip("/")
        turn = json.dumps({"name": "gain", "value": 0.5}).encode()
        assert asked(f"{url}knob", turn)[0] == 403
        assert asked(f"{url}knob", turn, Origin="http://evil.example")[0] == 403
        assert asked(f"{url}knob", b"{}", Origin=own)[0] == 400
        assert asked(f"{url}knob", turn, Origin=own)[0] == 204
    finally:
        program.send_signal(signal.SIGINT)
        out, err = program.communicate(timeout=PATIENCE_S)
    assert err == ""
    assert "begins again" in out
    half = cspm.open(tmp_path / "watched_2").attachments["scenario.yaml"].decode()
    whole = cspm.open(tmp_path / "watched").attachments["scenario.yaml"].decode()
    assert half != whole
    assert cspm.open(tmp_path / "watched").complete


@pytest.mark.compiled
@pytest.mark.slow
def test_the_view_of_a_run_that_has_ended_stays_until_ctrl_c(tmp_path):
    options = ("--duration", 1, "--view", "--port", 0, "--no-browser")
    program = child("run", "calm", *options, "--out", "short", cwd=tmp_path)
    lines = []
    while not lines or "the view stays until Ctrl-C" not in lines[-1]:
        lines.append(program.stdout.readline())
        assert lines[-1], program.communicate()
    url = next(line for line in lines if line.startswith("view ")).split()[1]
    found = json.loads(asked(f"{url}run?after=")[1])
    assert found["state"]["ended"]
    assert found["runs"][0]["count"] == 31
    assert asked(f"{url}run?after={found['version']}")[0] == 204
    assert asked(f"{url}etc/passwd")[0] == 404
    program.send_signal(signal.SIGINT)
    _, err = program.communicate(timeout=PATIENCE_S)
    assert (program.returncode, err) == (0, "")
    assert (tmp_path / "short" / "run.png").exists()


def test_a_recording_is_read_on_while_it_is_made(tmp_path):
    """Piece by piece come the same rows as at once."""
    run = cspm.simulate("rest", duration=0.5)
    whole = run.save(tmp_path / "whole")
    file = tmp_path / "whole" / "whole_0.mcap"
    content = file.read_bytes()
    place = tmp_path / "part"
    place.mkdir()
    growing, readings = GrowingRecording(place), 0
    with pytest.raises(InputError):
        growing.update()
    for size in range(len(content) // 3, len(content) + 1, len(content) // 40):
        (place / "part_0.mcap").write_bytes(content[:size])
        readings += growing.update()
    (place / "part_0.mcap").write_bytes(content)
    growing.update()
    assert readings > 2
    assert not growing.update()
    for name in ("tension", "winch_angle", "bar_pose", "bar_reference"):
        np.testing.assert_array_equal(growing.signal(name).values, whole.signal(name).values)
        np.testing.assert_array_equal(growing.signal(name).time, whole.signal(name).time)
