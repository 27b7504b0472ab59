"""Machines that several test files use."""

import copy
import os
import sys
import time
from pathlib import Path

import hypothesis
import numpy as np
import psutil
import pytest

from cspm_bringup import cli
from cspm_msgs_py.testbed import Testbed, load_testbed
from cspm_msgs_py.yaml_file import validate

# The first call of a kernel may compile it, which takes longer than any sensible deadline.
hypothesis.settings.register_profile("cspm", deadline=None)
hypothesis.settings.load_profile("cspm")

THESIS = Path(__file__).resolve().parents[1] / "scenarios" / "testbeds" / "thesis.yaml"

# For how long others may have the processors before a test by the wall clock is given up; for how
# long they are looked at [s]; which share of one processor they may use.
PATIENCE_S, LOOK_S, OTHERS = 10.0, 0.5, 0.2

# Steps of this share of a round come back evenly, however many are looked at.
GOLDEN_SHARE = 0.5 * (5.0**0.5 - 1.0)

EXPONENTIAL = {
    "law": "exponential",
    "a": 7000.0,
    "b": 1.05,
    "c": 0.005,
    "d": -0.14,
    "youngs_modulus": 8.721e9,
    "diameter": 1.0e-3,
    "floor_tension": 0.05,
}
LINEAR = {"law": "linear", "youngs_modulus": 2.0e9, "diameter": 1.0e-3, "floor_tension": 0.05}
WINCH = {"drum_radius": 0.025, "rotor_inertia": 2.4e-4, "torque_limit": 2.0}


def cable(name, exit_point, attachment, stiffness=EXPONENTIAL, **changes):
    return {
        "name": name,
        "exit": list(exit_point),
        "attachment": list(attachment),
        "offset_length": 0.3,
        "stiffness": dict(stiffness),
        "damping": {"constant": 20.0, "slope": 1.5},
        **WINCH,
        "tension_limits": [0.0, 60.0],
        **changes,
    }


def rig_content():
    """One winch, one cable to a fixed point, no bar."""
    return {"name": "rig", "cables": [cable("only", (0, 0, 0), (0, 0, 2.1))]}


def point_content():
    """A small ball on three cables that meet in its centre; no winch frame."""
    exits = [(1.0, 0.0, -0.3), (-0.6, 0.8, -0.3), (-0.5, -0.9, -0.2)]
    return {
        "name": "point",
        "bar": {
            "mass": 2.0,
            "inertia": {"ixx": 0.01, "iyy": 0.01, "izz": 0.01},
            "dimensions": [0.1, 0.1, 0.1],
        },
        "cables": [cable(f"c{i}", point, (0, 0, 0)) for i, point in enumerate(exits)],
    }


def general_content(stiffness=EXPONENTIAL):
    """Eight cables of no symmetry, full inertia, centre of mass beside the origin, two gears."""
    exits = [
        (0.9, 0.8, -0.4),
        (0.85, -0.9, -0.45),
        (-0.95, 0.75, -0.38),
        (-0.8, -0.85, -0.5),
        (0.7, 0.6, -0.3),
        (0.75, -0.65, -0.42),
        (-0.7, 0.7, -0.41),
        (-0.72, -0.6, -0.36),
    ]
    attachments = [
        (0.4, 0.15, -0.05),
        (0.38, -0.2, -0.08),
        (-0.41, 0.18, 0.06),
        (-0.36, -0.16, -0.04),
        (0.2, -0.15, 0.1),
        (0.22, 0.17, 0.08),
        (-0.25, -0.14, 0.12),
        (-0.21, 0.19, -0.1),
    ]
    return {
        "name": "general",
        "bar": {
            "mass": 5.0,
            "inertia": {
                "ixx": 0.08,
                "iyy": 0.31,
                "izz": 0.35,
                "ixy": 0.015,
                "ixz": -0.02,
                "iyz": 0.01,
            },
            "com": [0.03, -0.02, 0.05],
            "dimensions": [1.0, 0.4, 0.2],
        },
        "winch_frame": {},
        "cables": [
            cable(f"c{i}", start, end, stiffness, gear_ratio=1.0 + 2.0 * (i % 2))
            for i, (start, end) in enumerate(zip(exits, attachments, strict=True))
        ],
    }


def build(content):
    """Check a machine that is written as plain data."""
    return validate(Testbed, content, "test.yaml")


def changed(content, path, value):
    """Return a copy with the value at a key path such as `bar.com` or `cables.0.exit` replaced."""
    content = copy.deepcopy(content)
    node = content
    *parents, last = [int(key) if key.isdigit() else key for key in path.split(".")]
    for key in parents:
        node = node[key]
    node[last] = value
    return content


def with_bar(testbed, **changes):
    """Return a machine with some of its bar's values replaced."""
    return testbed.model_copy(update={"bar": testbed.bar.model_copy(update=changes)})


def random_poses(count, seed, centre=(0.0, 0.0, 2.0), reach=0.3, angle=0.4):
    rng = np.random.default_rng(seed)
    poses = rng.uniform(-1.0, 1.0, (count, 6)) * np.repeat([reach, angle], 3)
    poses[:, :3] += centre
    return poses


@pytest.fixture(scope="session")
def thesis():
    """The machine as the thesis models it: without the roll damping that its file adds."""
    return load_testbed(THESIS).testbed.model_copy(update={"effects": ()})


@pytest.fixture(scope="session")
def rig():
    return build(rig_content())


@pytest.fixture(scope="session")
def point():
    return build(point_content())


@pytest.fixture(scope="session")
def general():
    return build(general_content())


def turned(files, turn):
    """Return the list begun elsewhere; in five turns in a row each file is in the first quarter."""
    first = int(len(files) * (turn * GOLDEN_SHARE % 1.0))
    return files[first:] + files[:first]


@pytest.hookimpl(trylast=True)
def pytest_collection_modifyitems(items):
    """Begin slow tests with another file each turn, so that where time is short all have theirs.

    But for what no run may be without.
    """
    turn = int(os.environ.get("CSPM_SLOW_TESTS_TURN", "0"))
    files = list(dict.fromkeys(item.path for item in items if item.get_closest_marker("slow")))
    place = {path: i for i, path in enumerate(turned(files, turn))}
    early = {item.path for item in items if item.get_closest_marker("early")}
    items.sort(key=lambda item: -1 if item.path in early else place.get(item.path, -1))


def pytest_runtest_setup(item):
    """Skip slow tests once the time that continuous integration gives them is over."""
    kind = "ALONE" if item.get_closest_marker("alone") else "SLOW"
    until = os.environ.get(f"CSPM_{kind}_TESTS_BEGIN_UNTIL")
    if until and item.get_closest_marker("slow") and time.time() > float(until):
        pytest.skip("no time left for all slow tests: `make test` has no such limit")


@pytest.fixture(autouse=True)
def _real_time_needs_a_processor(request):
    """Skip tests that run by the wall clock where other programs have the processors."""
    by_the_wall = ("test_realtime_safety", "test_realtime_run", "test_external_plant")
    if request.module.__name__ in by_the_wall:
        request.getfixturevalue("uncrowded")


@pytest.fixture
def uncrowded():
    """Skip where other programs have the processors, and go on having them for some seconds."""
    until = time.monotonic() + PATIENCE_S
    while is_crowded():
        if time.monotonic() > until:
            pytest.skip("the processor is crowded: real time cannot be judged")


def is_crowded():
    """Whether others use more than a part of a processor, or a busy loop does not get all of one.

    Not by the load average, in which the tests before this one are still to be seen.
    """
    begun, used, all_before = time.perf_counter(), time.process_time(), psutil.cpu_times()
    while time.perf_counter() < begun + LOOK_S:
        pass
    own, all_after = time.process_time() - used, psutil.cpu_times()
    busy = sum(
        getattr(all_after, kind) - getattr(all_before, kind) for kind in ("user", "nice", "system")
    )
    return own < 0.98 * LOOK_S or busy - own > OTHERS * LOOK_S


@pytest.fixture
def captured(capsys):
    """What catches the output of `cspm`; for a file to override."""
    return capsys


@pytest.fixture
def columns():
    """How wide the terminal of `cspm` is; for a file to override."""
    return 200


@pytest.fixture
def cspm(monkeypatch, captured, columns, tmp_path):
    """Run a command line in an empty folder; return exit code, stdout and stderr."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("COLUMNS", str(columns))

    def call(*arguments):
        monkeypatch.setattr(sys, "argv", ["cspm", *map(str, arguments)])
        with pytest.raises(SystemExit) as caught:
            cli.main()
        out, err = captured.readouterr()
        return caught.value.code or 0, out, err

    return call


@pytest.fixture
def refused(cspm):
    """Run a command line that must fail with one line on stderr; return the line."""

    def call(*arguments, code=2):
        found, _, err = cspm(*arguments)
        assert (found, err.count("\n")) == (code, 1), err
        assert err.startswith("cspm: ")
        return err.removeprefix("cspm: ").removesuffix("\n")

    return call
