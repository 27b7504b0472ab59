"""The command `cspm urdf`: one document on standard output, in a file and in Python."""

import json
import re

import pytest

import cspm
from cspm.commands.urdf_command import mjcf_command, urdf_command
from cspm_msgs_py.errors import InputError


def test_it_is_printed_or_written_as_python_gives_it(tmp_path, capsys):
    expected = cspm.load_testbed("thesis").urdf()
    urdf_command("thesis", None)
    assert capsys.readouterr().out == expected
    urdf_command("thesis", tmp_path / "thesis.urdf")
    assert (tmp_path / "thesis.urdf").read_text(encoding="utf-8") == expected
    assert capsys.readouterr().out == f"urdf {tmp_path}/thesis.urdf\n"


def test_a_file_that_is_there_stays(tmp_path):
    there = tmp_path / "there.urdf"
    there.write_text("mine")
    with pytest.raises(
        InputError, match=re.escape(f"--out {there}: already exists, allowed: a new file")
    ):
        urdf_command("thesis", there)
    assert there.read_text() == "mine"


def test_what_cannot_be_written_or_read_is_said(tmp_path):
    away = tmp_path / "nowhere" / "x.urdf"
    line = f"--out {away}: cannot be written (No such file or directory)"
    with pytest.raises(InputError, match=re.escape(line)):
        urdf_command("thesis", away)
    with pytest.raises(InputError, match=r"^no_robot: no such test-bed"):
        urdf_command("no_robot", None)


def test_winches_are_printed_or_written_for_mujoco_and_their_numbers_as_data(tmp_path, capsys):
    mjcf_command("emps", None, None)
    text = capsys.readouterr().out
    assert '<default class="carriage">' in text
    mjcf_command("emps", tmp_path / "joints.xml", tmp_path / "joints.json")
    assert (tmp_path / "joints.xml").read_text(encoding="utf-8") == text
    (joint,) = json.loads((tmp_path / "joints.json").read_text())["joints"].values()
    assert joint == {"armature": 9.51089e-3, "damping": 2.035034e-2, "frictionloss": 0.203935}
