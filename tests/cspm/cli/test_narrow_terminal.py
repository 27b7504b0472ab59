"""What commands show on a terminal of 60 columns: whole lines, and no number cut off."""

import io
import os
import re
import subprocess
import sys
from pathlib import Path

import pytest
from rich.console import Console
from run_samples import bundle_of

from cspm.commands.info_command import say_topics
from cspm_msgs_py.recording.overview import overview
from cspm_run.recorded_run import run

ROOT = Path(__file__).resolve().parents[3]
COLUMNS = 60


@pytest.fixture(scope="module")
def found(tmp_path_factory):
    folder = tmp_path_factory.mktemp("bags") / "bag"
    run(bundle_of("rest"), folder, steps=100)
    return overview(folder)


def shown(found, width):
    console = Console(width=width, file=io.StringIO())
    say_topics(console, found)
    return console.file.getvalue()


def test_topics_are_paragraphs_where_a_table_has_no_room(found):
    text = shown(found, COLUMNS)
    assert "/bar/pose\n  geometry_msgs/msg/PoseStamped\n  10 messages, 100.0 Hz, gap ≤ 10" in text
    assert "…" not in text
    lines = [line for line in text.splitlines() if line != str(found.path)]
    assert max(map(len, lines)) <= COLUMNS


def test_topics_are_a_table_where_there_is_room(found):
    text = shown(found, 140)
    assert re.search(r"/bar/pose +geometry_msgs/msg/PoseStamped +10 +100\.0 +10\.000", text)
    assert "gap ≤" not in text


@pytest.mark.parametrize("group", [[], ["analyze"], ["identify"]])
def test_a_command_is_listed_with_a_whole_sentence(group):
    known = {**os.environ, "COLUMNS": str(COLUMNS), "PYTHONPATH": str(ROOT)}
    words = [sys.executable, "-m", "cspm", *group, "--help"]
    done = subprocess.run(words, env=known, capture_output=True, text=True, check=True)
    listed = done.stdout.split("Commands:\n")[1]
    assert "..." not in listed
    assert "…" not in listed
    assert len(listed.strip().splitlines()) >= 5
    assert all(line.endswith(".") for line in listed.strip().splitlines())
