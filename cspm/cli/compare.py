"""The command that holds a recording against its simulation: compare."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from cspm.cli.app import Json, app
from cspm.cli.early_checks import check_given
from cspm_msgs_py.errors import InputError

DRIVES = ("winch", "torque", "tension")
SENSORS = ("/bar/pose", "/winch_frame/pose", "/cables/tension")


def _delays(texts: list[str] | None) -> dict[str, float] | None:
    """Return delays [s] by topic of TOPIC=SECONDS; None where none are given."""
    if texts is None:
        return None
    found = {}
    for text in texts:
        topic, _, number = text.partition("=")
        try:
            found[topic] = float(number)
        except ValueError:
            found = {}
        if topic not in found or topic not in SENSORS or abs(found[topic]) > 1.0:
            raise InputError(
                f"--delay {text}: allowed: TOPIC=SECONDS with one of {', '.join(SENSORS)} and at"
                " most 1 s"
            )
    return found


@app.command(
    epilog="""Examples:

cspm compare recordings/verification_mid-20260131-120000 --out report

cspm compare today --testbed my_rig.yaml --drive torque --horizon 0.2

cspm compare today --delay /bar/pose=0.008 --delay /winch_frame/pose=0.008

Exit code: 0 done, 2 unusable input, 130 interrupted.""",
)
def compare(
    recording: Annotated[
        Path, typer.Argument(metavar="REC", help="A recording: its folder or its MCAP file.")
    ],
    testbed: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE", help="The machine to simulate, instead of the one that it carries."
        ),
    ] = None,
    drive: Annotated[
        str,
        typer.Option(
            metavar="DRIVE",
            help="What is taken from the recording: winch, motor angles; torque, motor torques;"
            " tension, cable tensions; always with the winch frame's pose. The rest is simulated.",
        ),
    ] = DRIVES[0],
    horizon: Annotated[
        float | None,
        typer.Option(
            metavar="SECONDS",
            help="Begin anew from the measured state after so long; otherwise 0.5 s for torque and"
            " tension, whose errors grow, and never for winch.",
        ),
    ] = None,
    delay: Annotated[
        list[str] | None,
        typer.Option(
            metavar="TOPIC=SECONDS",
            help="How late a sensor's stamps are, instead of finding it out; may be repeated.",
        ),
    ] = None,
    repeat: Annotated[
        Path | None,
        typer.Option(
            metavar="REC", help="The same experiment once more, to take the noise floor from."
        ),
    ] = None,
    out: Annotated[
        Path | None,
        typer.Option(metavar="FOLDER", help="A new folder for report.html and comparison.json."),
    ] = None,
    json: Json = None,
) -> None:
    """Compare a recording with its model. Simulates its measured inputs, says where both differ.

    The whole, then cables and bar alone, each from what was measured.
    """
    if drive not in DRIVES:
        raise InputError(f"--drive {drive}: allowed: {', '.join(DRIVES)}")
    if horizon is not None and not 0.01 <= horizon <= 3600.0:
        raise InputError(f"--horizon {horizon:g}: allowed: 0.01 to 3600 s")
    delays = _delays(delay)
    check_given([recording, repeat], testbed, out)
    from cspm.commands.compare_command import CompareRequest, compare_command
    from cspm_ident.block_simulation import Input

    compare_command(
        CompareRequest(recording, testbed, Input(drive), horizon, delays, repeat, out), json
    )
