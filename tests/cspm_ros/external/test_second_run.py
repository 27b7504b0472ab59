"""Two runs in one ROS domain: the second ends at once, and the first does not notice."""

import os
import subprocess

import pytest
from realtime_graph import (
    APART,
    CSPM,
    GUARDS,
    TOGETHER,
    Command,
    Evidence,
    Witness,
    slow_bundle,
    topics_of,
    under_way,
)
from ros_graph import load_ros

from cspm_msgs_py.schedule import FORCE_CONTROLLER, TENSION

load_ros()
pytestmark = pytest.mark.slow

MODES = {
    "graph": ("--mode", "graph"),
    "processes": ("--mode", "processes"),
    "together": ("--mode", "realtime", TOGETHER),
    "apart": ("--mode", "realtime", APART),
    "external": ("--mode", "realtime", "--plant", "external"),
}


def second(domain, place, *options):
    """Start a second run; return exit code and what it says of its error."""
    words = [*CSPM, "run", "rest", "--duration", "2", "--out", str(place / "second"), *options]
    environment = os.environ | {"ROS_DOMAIN_ID": str(domain)}
    done = subprocess.run(
        words, env=environment, capture_output=True, text=True, check=False, timeout=120
    )
    return done.returncode, done.stderr.strip()


def test_the_second_run_is_refused_and_the_first_goes_on(tmp_path):
    bundle = slow_bundle("duration=1000")
    with (
        Command(tmp_path, bundle, TOGETHER) as first,
        Witness(first.domain, topics_of(bundle, TENSION)) as witness,
    ):
        under_way(witness)
        for name, options in MODES.items():
            code, err = second(first.domain, tmp_path / name, *options)
            text = f"ROS_DOMAIN_ID {first.domain}: rest (process {first.process.pid}) runs there"
            assert text in err, (name, err)
            assert len(err.splitlines()) == 1, (name, err)
            assert code == 2, name
            assert not (tmp_path / name).exists()
        witness.until_running(*GUARDS)
        witness.until_more(TENSION, 100)
        first.process.send_signal(2)
        assert first.done()[0] == 1
    assert not Evidence(first.folder).alarms(FORCE_CONTROLLER)
