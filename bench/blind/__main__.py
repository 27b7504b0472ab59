"""The blind benchmark: `python -m bench.blind {make,run,score}`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from cspm.cli.app import Json
from cspm.cli.main import run_app

blind = typer.Typer(
    add_completion=False,
    pretty_exceptions_enable=False,
    no_args_is_help=True,
    help="Recordings that conceal what acts in them, diagnosed and scored: make, run, score.",
)

Folder = Annotated[Path, typer.Argument(metavar="DIR", help="The benchmark's folder.")]
Truth = Annotated[
    Path | None,
    typer.Option(metavar="FILE", help="The truth file; otherwise DIR.truth.json beside DIR."),
]


@blind.command(
    epilog="""Example: python -m bench.blind make --seed 7 --count 40 --out bench7

Exit code: 0 done, 2 unusable input. Interrupted, the same command goes on where it was."""
)
def make(
    seed: Annotated[
        int, typer.Option(metavar="NUMBER", min=0, help="Of everything drawn; it gives all away.")
    ],
    out: Annotated[Path, typer.Option(metavar="DIR", help="For the recordings.")],
    count: Annotated[int, typer.Option(metavar="NUMBER", help="Of recordings.")] = 400,
    split: Annotated[
        str, typer.Option(metavar="SPLIT", help="dev, tune or sealed: nothing in common.")
    ] = "dev",
    strata: Annotated[
        list[str] | None,
        typer.Option(metavar="NAME", help="Ways of concealing, repeated; otherwise all."),
    ] = None,
    duration: Annotated[
        float, typer.Option(metavar="SECONDS", help="Of each recording, 15 to 200.")
    ] = 60.0,
    sensors: Annotated[
        str,
        typer.Option(
            metavar="KIND",
            help="real, or plain: white noise alone, to see what the sensors themselves cost.",
        ),
    ] = "real",
    survey: Annotated[
        float,
        typer.Option(
            metavar="MM",
            help="Standard deviation of the places of exits and attachments, in half of them.",
        ),
    ] = 0.0,
    truth: Truth = None,
    jobs: Annotated[
        int | None,
        typer.Option(metavar="NUMBER", help="Recordings at a time; otherwise one per processor."),
    ] = None,
) -> None:
    """Record machines that conceal something, and write the truth apart."""
    from bench.blind.commands import make_command

    where, ways = _truth(out, truth), tuple(strata or ())
    make_command(out, where, seed, count, split, ways, duration, sensors, survey, jobs)


@blind.command(
    epilog="""Methods: cspm, the diagnosis; cspm-without-measured-interfaces, -weak-form,
-joint-refit, -block-null, -held-out, which each leave one safeguard out; peers: retuned, stepwise,
lasso, sindy, black-box. The last four need pip install cspm\\[blind]."""
)
def run(
    folder: Folder,
    method: Annotated[
        list[str] | None,
        typer.Option(metavar="NAME", help="What diagnoses, repeated; otherwise cspm."),
    ] = None,
    jobs: Annotated[
        int | None,
        typer.Option(
            metavar="NUMBER", help="Recordings at a time, 1.3 GB each; otherwise one per processor."
        ),
    ] = None,
) -> None:
    """Diagnose recordings that have not been yet, in processes that can read nothing else."""
    from bench.blind.commands import run_command

    run_command(folder, method or ["cspm"], jobs)


@blind.command()
def score(
    folder: Folder,
    truth: Truth = None,
    sha256: Annotated[
        str | None,
        typer.Option(metavar="HASH", help="What `make` printed, to be checked."),
    ] = None,
    page: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE", help="Also write the scorecard as Markdown, its picture beside it."
        ),
    ] = None,
    json: Json = None,
) -> None:
    """Open the truth and score what was found."""
    from bench.blind.commands import score_command

    score_command(folder, _truth(folder, truth), sha256, page, json)


def _truth(folder: Path, given: Path | None) -> Path:
    return given if given is not None else folder.with_name(f"{folder.name}.truth.json")


def main() -> None:
    """Run the command line."""
    run_app(blind, "python -m bench.blind")


if __name__ == "__main__":
    main()
