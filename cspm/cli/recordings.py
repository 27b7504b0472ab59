"""Commands about recordings: info, recover, resim, import, export, bundle."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from cspm.cli.app import RUN_FAILED, Json, app, new_folder
from cspm.cli.early_checks import check_given
from cspm_msgs_py.errors import InputError
from cspm_run.library import find_mapping


@app.command(epilog="Example: cspm info recordings/calm-20260131-120000")
def info(
    bag: Annotated[
        Path, typer.Argument(metavar="REC", help="A recording: its folder or its MCAP file.")
    ],
    json: Json = None,
) -> None:
    """Summarise a recording. Topics, rates in Hz, longest gaps in ms, duration, scenario."""
    from cspm.commands.info_command import info_command

    info_command(bag, json)


@app.command(epilog="Example: cspm recover recordings/calm-20260131-120000 --out restored")
def recover(
    bag: Annotated[
        Path,
        typer.Argument(
            metavar="REC",
            help="A recording that was cut short: its folder or its MCAP file; or a ROS 1 bag.",
        ),
    ],
    out: Annotated[
        Path | None,
        typer.Option(
            metavar="FOLDER",
            help="A new folder to write to. Otherwise the recording is mended in place, and the"
            " original is kept with .broken added to its name.",
        ),
    ] = None,
    json: Json = None,
) -> None:
    """Restore a recording that was cut off. With its index and metadata.

    At most the last 0.2 s before the kill are lost.
    """
    from cspm.commands.info_command import recover_command

    recover_command(bag, out, json)


@app.command(
    epilog="""Example: cspm resim recordings/calm-20260131-120000

Exit code: 0 identical, 1 different, 2 no recording made by cspm."""
)
def resim(
    bag: Annotated[
        Path, typer.Argument(metavar="REC", help="A recording made by cspm: its folder or file.")
    ],
    controllers: Annotated[
        list[Path] | None,
        typer.Option(
            "--controller",
            metavar="FILE",
            help="Your own copy of a Python file that the scenario named as a controller; may be"
            " repeated. Code that a recording carries is never run.",
        ),
    ] = None,
    json: Json = None,
) -> None:
    """Repeat a run from its recording. Say whether every message is identical.

    Bit for bit, in every field. Otherwise the first difference is printed: topic, message, field.
    """
    check_given([bag])
    from cspm.commands.run_command import resim_command

    raise typer.Exit(0 if resim_command(bag, json, controllers or ()) else RUN_FAILED)


@app.command(
    epilog="""Examples:

cspm check recordings/calm-20260131-120000

cspm check lab.csv --mapping lab_mapping.yaml --testbed my_rig.yaml --fix lab_mended.yaml

Exit code: 0 nothing looks wrong, 1 something does, 2 unusable input."""
)
def check(
    source: Annotated[
        Path,
        typer.Argument(
            metavar="REC|FILE",
            help="A recording, or with --mapping any file that `cspm import` reads.",
        ),
    ],
    mapping: Annotated[
        Path | None,
        typer.Option(metavar="FILE", help="Which column is which number, in which unit."),
    ] = None,
    testbed: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE", help="The machine; otherwise the one that the recording carries."
        ),
    ] = None,
    page: Annotated[
        Path | None, typer.Option(metavar="FILE", help="A new .html file with what was found.")
    ] = None,
    fix: Annotated[
        Path | None,
        typer.Option(metavar="FILE", help="A new file for the mapping with what mends it put in."),
    ] = None,
    json: Json = None,
) -> None:
    """Look at signals before any model. Say what looks wrong, when, and which key mends it.

    Units, signs, clocks, lost samples; encoders against poses, load cells against torques.
    """
    from cspm.commands.recordings.check_command import Check, check_command

    fine = check_command(Check(source, mapping, testbed, page, fix), json)
    raise typer.Exit(0 if fine else RUN_FAILED)


@app.command(
    "import",
    epilog="""Examples:

cspm import lab.csv --mapping lab_mapping.yaml --testbed my_rig.yaml --dry-run

cspm import DATA_EMPS.mat --mapping emps --testbed emps --out emps

Exit code: 0 done, 2 unusable input, 130 interrupted.""",
)
def import_(
    file: Annotated[
        Path,
        typer.Argument(
            metavar="FILE",
            help="A text table (.csv.gz too), a spreadsheet (.xlsx), a Parquet, HDF5 or .mat file,"
            " or a bag: a rosbag2 folder, an .mcap or .db3 file, or a ROS 1 .bag.",
        ),
    ],
    mapping: Annotated[
        Path,
        typer.Option(metavar="FILE", help="Which column is which number, in which unit."),
    ],
    testbed: Annotated[Path, typer.Option(metavar="FILE", help="The machine that was recorded.")],
    out: Annotated[
        Path | None,
        typer.Option(
            metavar="FOLDER",
            help="A new folder for the recording; otherwise recordings/MAPPING-DATE-TIME.",
        ),
    ] = None,
    dry_run: Annotated[
        bool, typer.Option("--dry-run", help="Show what would be done, and write nothing.")
    ] = False,
    json: Json = None,
) -> None:
    """Turn a table or bag into a recording. Every conversion is shown.

    What looks wrong is reported: units, signs, gaps, clocks. Nothing is interpolated.
    """
    if dry_run and out is not None:
        raise InputError(f"--out {out} --dry-run: allowed: one of both")
    check_given([], testbed, out)
    find_mapping(str(mapping))
    from cspm.commands.import_command import Import, import_command

    folder = out if out is not None else new_folder(mapping.stem)
    import_command(Import(file, mapping, testbed, None if dry_run else folder), json)


@app.command(
    epilog="""Examples:

cspm export recordings/calm-20260131-120000 --out calm.csv

cspm export today --out today.mat --signals tension,winch_torque

Exit code: 0 done, 2 unusable input."""
)
def export(
    bag: Annotated[
        Path, typer.Argument(metavar="REC", help="A recording: its folder or its MCAP file.")
    ],
    out: Annotated[
        Path,
        typer.Option(metavar="FILE", help="A new file: .csv, .parquet, or .mat for MATLAB."),
    ],
    signals: Annotated[
        str | None,
        typer.Option(
            metavar="NAME,…",
            help="Such as bar_pose,tension.",
            show_default="all that are recorded",
        ),
    ] = None,
    json: Json = None,
) -> None:
    """Write a recording's signals as a table. As text, Parquet or for MATLAB, in SI units.

    Nothing is interpolated: a row for each stamp, and nothing where a signal has none then.
    """
    check_given([bag])
    from cspm.commands.recordings.export_command import export_command

    names = [] if signals is None else [name.strip() for name in signals.split(",")]
    export_command(bag, out, names, json)


@app.command(
    epilog="""Examples:

cspm bundle today verdict --out for_anna.zip

cspm bundle monday tuesday verdict --out two_days.zip --testbed my_rig.yaml

Exit code: 0 done, 2 unusable input."""
)
def bundle(
    recordings: Annotated[
        list[Path],
        typer.Argument(metavar="REC...", help="All recordings that the verdict was made of."),
    ],
    verdict: Annotated[
        Path, typer.Argument(metavar="VERDICT", help="The folder that diagnose wrote.")
    ],
    out: Annotated[Path, typer.Option(metavar="FILE", help="A new zip file.")],
    testbed: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE",
            help="The test-bed file that the recordings were compared with.",
            show_default="the recording's, or where the verdict says it is",
        ),
    ] = None,
    json: Json = None,
) -> None:
    """Pack what repeats a verdict. For a colleague, without names and paths.

    Recordings, test-bed, verdict and the command. Comments, notes and statuses are left out.
    """
    check_given([*recordings, verdict], testbed)
    from cspm.commands.recordings.bundle_command import bundle_command

    bundle_command(recordings, verdict, out, testbed, json)
