"""Recordings of a benchmark tell nothing of the truth, nor can a diagnosis read it."""

import json
import os
import signal
import subprocess
import sys
import time
from itertools import combinations

import numpy as np
import pytest

pytest.importorskip("mujoco", minversion="4.0", reason="the MuJoCo plant needs MuJoCo 4")
from bench.blind import __main__ as cli
from bench.blind import make as making
from bench.blind.blank_runs import BlankRuns
from bench.blind.commands import score_command
from bench.blind.concealed_run import NOTES, believed, record_concealed
from bench.blind.diagnose_all import environment, run
from bench.blind.make import Request, make
from bench.blind.reality.phenomena import PHENOMENA
from bench.blind.reality.reality import conceal
from bench.blind.stored_results import read_results, tried
from bench.blind.stratum import Case, Stratum
from bench.blind.truth import truth_sha256
from cspm_msgs_py.errors import DivergenceError, InputError
from cspm_msgs_py.recording.reader import Recording

NOTHING = Stratum("nothing", 1.0, (Case(scenarios=("worst_case_steep",)),))
LOUD = Stratum("noise", 1.0, (Case(("bristles",), (16.0,), ("worst_case_steep",)),))


@pytest.fixture(scope="module")
def bench(tmp_path_factory):
    """A recording with nothing and one with strong friction, under limits that are given."""
    place = tmp_path_factory.mktemp("blind")
    patch = pytest.MonkeyPatch()
    patch.setattr(making, "STRATA", {"nothing": NOTHING, "noise": LOUD})
    limits = {name: [5e-4] * 8 for name in PHENOMENA}
    patch.setattr(making, "run_blank", lambda *_: blank({"worst_case_steep": limits}))
    options = Request(
        place / "bench", place / "truth.json", 3, 2, "dev", ("nothing", "noise"), 15.0
    )
    said = []
    digest = make(options, lambda *reported: said.append(reported))
    yield options, digest, said
    patch.undo()


def blank(limits):
    """What blank runs tell where every phenomenon has the catalogue's form."""
    return BlankRuns(limits, {}, {(name, each): [1.0] * 8 for name in limits for each in PHENOMENA})


def recordings(options):
    return sorted((options.folder / "recordings").iterdir())


def stratum_of(options):
    truth = json.loads(options.truth.read_text())
    return {item["name"]: item["stratum"] for item in truth["items"]}


@pytest.mark.slow
def test_the_hash_is_published_before_anything_is_recorded(bench):
    options, digest, said = bench
    assert digest == truth_sha256(options.truth)
    assert digest in said[0][0]
    assert [(text, done) for text, done, _ in said[-3:]] == [
        ("recording, 1 made", 1),
        ("recording, 2 made", 2),
        ("recordings made", 2),
    ]


@pytest.mark.slow
def test_what_surrounds_the_signals_is_the_same_in_all(bench):
    options, _, _ = bench
    found = []
    for path in recordings(options):
        assert sorted(p.name for p in path.iterdir()) == [f"{path.name}_0.mcap", "metadata.yaml"]
        dates = {os.stat(p).st_mtime_ns for p in (path, *path.iterdir())}
        with Recording(path) as recording:
            attached = dict(recording.attachments)
            assert len(attached.pop(NOTES)) == 80
            scenario = attached.pop("scenario.yaml").decode()
            seeds = [line for line in scenario.splitlines() if line.startswith("seed:")]
            about = {**recording.metadata["cspm"], "seed": ""}
            topics = {name: topic.count for name, topic in recording.topics.items()}
        assert not any(name.startswith("/truth") for name in topics)
        assert len(seeds) == 1
        found.append((dates, scenario.replace(seeds[0], ""), attached, about, sorted(topics)))
    for one, other in combinations(found, 2):
        assert one == other


@pytest.mark.slow
def test_sizes_do_not_part_the_strata(bench):
    """Were they ranked by size, either stratum's recordings would be all the larger ones."""
    options, _, _ = bench
    strata = stratum_of(options)
    sizes = [
        (sum(f.stat().st_size for f in p.iterdir()), strata[p.name]) for p in recordings(options)
    ]
    values = np.array([size for size, _ in sizes], dtype=float)
    assert np.ptp(values) < 0.01 * values.mean()


def test_an_interrupted_make_goes_on_where_it_was(tmp_path, monkeypatch):
    made = []

    def record(bundle, reality, folder, **_):
        if len(made) == 1:
            made.append("interrupted")
            raise KeyboardInterrupt
        folder.mkdir(parents=True)
        (folder / "x.mcap").write_text(str(bundle.scenario.seed))
        made.append(folder.name)

    monkeypatch.setattr(making, "record_concealed", record)
    monkeypatch.setattr(making, "run_blank", lambda *_: blank({"worst_case_steep": {}}))
    monkeypatch.setattr(making, "STRATA", {"nothing": NOTHING})
    options = Request(tmp_path / "bench", tmp_path / "t.json", 3, 3, "dev", ("nothing",), 15.0)
    with pytest.raises(KeyboardInterrupt):
        make(options, jobs=1)
    digest = truth_sha256(options.truth)
    assert len(recordings(options)) == 1
    assert make(options, jobs=1) == digest
    assert [p.name for p in recordings(options)] == [made[0], *made[2:]]
    assert len(set(made)) == 4


@pytest.mark.compiled
def test_a_recording_that_is_cut_short_is_not_taken_for_whole(tmp_path):
    bundle = believed("worst_case_steep", 15.0, 1)
    reality = conceal(bundle.testbed.testbed, {}, 0.0, 1)
    with pytest.raises(KeyboardInterrupt):
        record_concealed(
            bundle,
            reality,
            tmp_path / "cut",
            note="",
            without=(),
            progress=lambda now: os.kill(os.getpid(), signal.SIGINT),
        )


def test_recordings_are_made_at_least_one_at_a_time(tmp_path):
    options = Request(tmp_path / "bench", tmp_path / "t.json", 3, 3, "dev", ("nothing",), 15.0)
    with pytest.raises(InputError, match=r"^--jobs 0: allowed: 1 or more$"):
        make(options, jobs=0)


def test_the_command_line_tells_the_hash_and_keeps_the_truth_beside(tmp_path, monkeypatch, capsys):
    def record(bundle, reality, folder, **_):
        folder.mkdir(parents=True)
        (folder / "x.mcap").write_text(str(bundle.scenario.seed))

    monkeypatch.setattr(making, "record_concealed", record)
    monkeypatch.setattr(making, "run_blank", lambda *_: blank({"worst_case_steep": {}}))
    monkeypatch.setattr(making, "STRATA", {"nothing": NOTHING})
    out = tmp_path / "bench"
    words = f"bench.blind make --seed 3 --count 1 --duration 15 --strata nothing --out {out}"
    monkeypatch.setattr(sys, "argv", words.split())
    with pytest.raises(SystemExit) as caught:
        cli.main()
    assert not caught.value.code
    truth = tmp_path / "bench.truth.json"
    reported = capsys.readouterr().out
    assert f"truth {truth}, SHA-256 {truth_sha256(truth)}" in reported
    assert reported.index("SHA-256") < reported.index("1 made")
    assert len(list((out / "recordings").iterdir())) == 1


def test_what_diverges_is_an_empty_folder_and_is_not_tried_again(tmp_path, monkeypatch):
    tried = []

    def record(*_, **__):
        tried.append(1)
        raise DivergenceError("t = 1 s: gone")

    monkeypatch.setattr(making, "record_concealed", record)
    monkeypatch.setattr(making, "run_blank", lambda *_: blank({"worst_case_steep": {}}))
    monkeypatch.setattr(making, "STRATA", {"nothing": NOTHING})
    options = Request(tmp_path / "bench", tmp_path / "t.json", 3, 1, "dev", ("nothing",), 15.0)
    make(options)
    make(options)
    assert len(tried) == 1
    assert [list(p.iterdir()) for p in recordings(options)] == [[]]


@pytest.mark.slow
def test_a_slice_is_diagnosed_and_scored(bench, tmp_path):
    """Bounds fixed beforehand: strong friction is seen, on its winch or more, and silence is not.

    Every one of these numbers is a count of two recordings.
    """
    options, digest, _ = bench
    assert run(options.folder) == {}
    score_command(options.folder, options.truth, digest, tmp_path / "p.md", tmp_path / "s.json")
    card = json.loads((tmp_path / "s.json").read_text())
    assert card["scored"] == 2
    assert card["truth_sha256"] == digest
    assert card["shares"]["detected"][:2] == [1, 1]
    assert card["shares"]["tied"][:2] == [1, 1]
    assert card["shares"]["false_alarm"][:2] == [0, 1]
    assert (tmp_path / "p.md").read_text().startswith("# Blind results")
    done = {p: os.stat(p).st_ino for p in (options.folder / "results").iterdir()}
    assert run(options.folder) == {}
    assert {p: os.stat(p).st_ino for p in (options.folder / "results").iterdir()} == done
    with pytest.raises(InputError, match=r"SHA-256 .*, allowed: that of --sha256, 00$"):
        score_command(options.folder, options.truth, "00", None, None)


STAND_IN = """#!{python}
import json, sys
from pathlib import Path
recording, *methods = sys.argv[3:]
if recording == "a":
    sys.exit("Traceback\\nValueError: lost")
if recording == "endless":
    Path({begun!r}).touch()
    sys.stdin.read()
    Path({begun!r}).unlink()
    sys.exit(1)
for name in methods:
    Path(name + ".json").write_text(json.dumps({{"diagnosis": {{"verdict": name}}, "cpu_s": 1.0}}))
"""


@pytest.fixture
def recorded(tmp_path, monkeypatch):
    """Give what makes recordings by name, which a stand-in of the diagnosis is given."""
    stand_in = tmp_path / "python"
    stand_in.write_text(
        STAND_IN.format(python=sys.executable, begun=str(tmp_path / "endless-begun"))
    )
    stand_in.chmod(0o755)
    monkeypatch.setattr(sys, "executable", str(stand_in))

    def make_all(*names):
        for name in names:
            place = tmp_path / "recordings" / name
            place.mkdir(parents=True)
            if name != "empty":
                (place / "x.mcap").write_text("no recording")
        return tmp_path

    return make_all


def test_a_diagnosis_that_fails_says_why_and_the_others_go_on(recorded):
    place = recorded("a", "b", "empty")
    assert run(place) == {"a": "ValueError: lost"}
    found = read_results(place, ["a", "b", "empty"])
    assert found["a"]["diagnosis"] is None
    assert found["b"]["diagnosis"] == {"verdict": "cspm"}
    assert sorted(found) == ["a", "b"]
    with pytest.raises(InputError, match=r"a is not in the truth, allowed: its own recordings$"):
        read_results(place, ["b"])
    assert run(place, methods=("cspm", "retuned")) == {
        "a": "ValueError: lost",
        "a, retuned": "ValueError: lost",
    }
    assert read_results(place, ["a", "b"], "retuned")["b"]["diagnosis"]["verdict"] == "retuned"
    assert tried(place, ("retuned", "lasso")) == ["retuned"]


def test_an_interrupted_run_keeps_what_is_whole_and_kills_the_rest(recorded):
    place = recorded("b", "endless")
    begun = place / "endless-begun"

    def interrupt(text, done, total):
        if done == 1:
            within(begun.exists)
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        run(place, interrupt, jobs=2)
    within(lambda: not begun.exists())
    assert sorted(p.name for p in (place / "results").iterdir()) == ["b"]
    with pytest.raises(InputError, match=r"^--jobs 0: allowed: 1 or more$"):
        run(place, jobs=0)


def within(condition, seconds=60.0):
    """Wait until a condition holds."""
    end = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < end
        time.sleep(0.02)


def test_a_confined_process_ends_with_the_one_that_began_it(tmp_path):
    program = (
        "from bench.blind.confined import end_with_parent\nend_with_parent()\n"
        "import threading\nprint('begun', flush=True)\nthreading.Event().wait()"
    )
    with subprocess.Popen(
        [sys.executable, "-c", program],
        env=environment(tmp_path),
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
    ) as process:
        assert process.stdout.readline() == b"begun\n"
        assert process.poll() is None
        process.stdin.close()
        assert process.wait(60.0) == 1


def confined(code, room):
    program = (
        "from pathlib import Path\nfrom bench.blind.confined import confine\n"
        f"confine(Path.cwd())\n{code}"
    )
    return subprocess.run(
        [sys.executable, "-c", program],
        cwd=room,
        env=environment(room),
        capture_output=True,
        text=True,
        check=False,
    )


def test_a_confined_process_reads_its_room_and_nothing_beside_it(tmp_path):
    room = tmp_path / "room"
    room.mkdir()
    (room / "own").write_text("mine")
    (tmp_path / "truth.json").write_text("sealed")
    (room / "sly").symlink_to(tmp_path / "truth.json")
    assert confined("print(open('own').read())", room).stdout == "mine\n"
    for path in ("../truth.json", "sly", str(tmp_path / "truth.json")):
        done = confined(f"open({path!r}).read()", room)
        assert "PermissionError" in done.stderr
        assert "outside what a blind diagnosis may read" in done.stderr
    done = confined("import os\nos.open('../truth.json', os.O_RDONLY)", room)
    assert "PermissionError" in done.stderr


def test_a_confined_process_knows_of_nothing_outside(tmp_path, monkeypatch):
    monkeypatch.setenv("CSPM_TRUTH", str(tmp_path / "truth.json"))
    assert not any("truth" in value for value in environment(tmp_path / "room").values())


def test_folders_without_recordings_or_results_are_refused(tmp_path):
    with pytest.raises(
        InputError, match=r"no recordings, allowed: a folder of `python -m bench.blind make`$"
    ):
        run(tmp_path)
    truth = tmp_path / "t.json"
    truth.write_text('{"schema": "cspm.blind-truth/1", "asked": {}, "items": []}')
    with pytest.raises(
        InputError, match=r"no results, allowed: a folder after `python -m bench.blind run`$"
    ):
        score_command(tmp_path, truth, None, None, None)
    truth.write_text("[]")
    with pytest.raises(InputError, match=r"allowed: a truth file of schema cspm.blind-truth/1$"):
        score_command(tmp_path, truth, None, None, None)
    with pytest.raises(InputError, match=r"not readable .*allowed: a truth file$"):
        score_command(tmp_path, tmp_path / "none.json", None, None, None)
