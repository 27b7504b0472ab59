"""The commands `cspm urdf` and `cspm mjcf`: a machine in the formats of others."""

from __future__ import annotations

from pathlib import Path

import typer

from cspm.testbed import load_testbed
from cspm_model.scene.mujoco_joints import joint_numbers, mujoco_joints
from cspm_msgs_py.errors import InputError
from cspm_run.output.console import make_console, say
from cspm_run.output.json_file import write_json


def urdf_command(testbed: str, out: Path | None) -> None:
    """Write a machine as URDF.

    Args:
        testbed: its name in the library, or its file.
        out: a new file; None prints it.

    Raises:
        InputError: no such test-bed, or the file exists or cannot be written.
    """
    _hand_out(load_testbed(testbed).urdf(), out, "urdf")


def mjcf_command(testbed: str, out: Path | None, json: Path | None) -> None:
    """Write a machine's winches as default classes of MuJoCo.

    Args:
        testbed: its name in the library, or its file.
        out: a new file; None prints it, unless data are wanted instead.
        json: file for the numbers of each joint as data; None writes none.

    Raises:
        InputError: no such test-bed, or the file exists or cannot be written.
    """
    machine = load_testbed(testbed).description
    if out is not None or json is None:
        _hand_out(mujoco_joints(machine), out, "mjcf")
    if json is not None:
        write_json(json, {"joints": joint_numbers(machine)})


def _hand_out(text: str, out: Path | None, kind: str) -> None:
    """Print a document, or write it to a new file."""
    if out is None:
        typer.echo(text, nl=False)
        return
    try:
        with out.open("x", encoding="utf-8") as file:
            file.write(text)
    except FileExistsError:
        raise InputError(f"--out {out}: already exists, allowed: a new file") from None
    except OSError as err:
        raise InputError(f"--out {out}: cannot be written ({err.strerror})") from None
    say(make_console(), f"{kind} {out}")
