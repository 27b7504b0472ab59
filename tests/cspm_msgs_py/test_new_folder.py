"""Scratch folders go with their program, however it ends, and only then."""

import os
import subprocess
import sys
import tempfile
from pathlib import Path

import pytest

from cspm_msgs_py.errors import InputError
from cspm_msgs_py.new_folder import ScratchFolder

MAKE = "from cspm_msgs_py.new_folder import ScratchFolder\nmade = ScratchFolder('other')\n"


@pytest.fixture
def place(tmp_path, monkeypatch):
    """A folder for temporary files, for this process and those that it starts."""
    monkeypatch.setenv("TMPDIR", str(tmp_path))
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    return tmp_path


def made_by_another(then):
    """Return the folder that another process made, which did something and has ended."""
    code = f"{MAKE}import os, signal\nprint(made.path, flush=True)\n{then}"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert done.stderr == ""
    return Path(done.stdout.strip())


def test_a_folder_is_there_in_its_block_and_for_nobody_else(place):
    with ScratchFolder("run") as folder:
        (folder / "a").write_text("b")
        assert folder.name.startswith("run-")
        assert folder.parent == place / f"cspm-{os.getuid()}"
        assert folder.stat().st_mode & 0o077 == folder.parent.stat().st_mode & 0o077 == 0
    assert not folder.exists()


def test_a_folder_goes_with_the_last_reference_and_is_closed_twice_without_harm(place):
    dropped, closed = ScratchFolder("run"), ScratchFolder("run")
    paths = dropped.path, closed.path
    closed.close()
    closed.close()
    del dropped
    assert [each.exists() for each in paths] == [False, False]


def test_what_a_killed_process_left_is_removed_by_the_next_and_nothing_else(place):
    with ScratchFolder("mine") as mine:
        (place / "cspm-of-the-user").mkdir()
        left = made_by_another("os.kill(os.getpid(), signal.SIGKILL)")
        assert left.exists()
        assert not made_by_another("").exists()
        assert not left.exists()
        assert mine.exists()
        assert (place / "cspm-of-the-user").exists()


def test_a_fork_that_ends_leaves_its_parents_folder(place):
    forked = "child = os.fork()\nif child:\n    os.waitpid(child, 0)\n    print(made.path.exists())"
    code = f"{MAKE}import os, sys\n{forked}\nelse:\n    sys.exit()\n"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert (done.stdout, done.stderr) == ("True\n", "")


def test_folders_of_somebody_else_are_not_swept(place):
    (place / "elsewhere").mkdir()
    room = place / f"cspm-{os.getuid()}"
    room.symlink_to(place / "elsewhere")
    with pytest.raises(InputError) as caught:
        ScratchFolder("run")
    assert str(caught.value) == (
        f"{room}: belongs to somebody else, allowed: a TMPDIR of one's own"
    )
