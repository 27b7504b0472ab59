"""The command `cspm campaign`."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rich import box
from rich.console import Console
from rich.markup import escape
from rich.table import Table

from cspm.campaign import require_engine
from cspm.commands.progress_shown import shown
from cspm_msgs_py.interruption import interruptible
from cspm_run.output.console import make_console, say
from cspm_run.output.json_file import write_json

if TYPE_CHECKING:
    from cspm.campaign.campaign import Campaign

# Failures that are printed; the table has all.
_MOST_FAILURES = 5


@dataclass(frozen=True)
class CampaignRequest:
    """Options of the command.

    Attributes:
        file: of the campaign.
        out: its folder.
        workers: processes on this computer; None: one per processor.
        scheduler: address of a dask scheduler instead.
        time_limit: after which a run counts as hung [s]; None: by its duration.
    """

    file: Path
    out: Path
    workers: int | None
    scheduler: str | None
    time_limit: float | None


def campaign_command(request: CampaignRequest, json: Path | None) -> bool:
    """Make the runs of a campaign, print and write what came of them.

    Returns:
        Whether every run has its result.

    Raises:
        InputError: file, folder or workers cannot be used.
        CspmError: the scheduler was lost.
    """
    console = make_console()
    require_engine()
    from cspm.campaign.campaign import run_campaign
    from cspm.campaign.campaign_folder import TABLE
    from cspm.campaign.campaign_page import write_campaign_page
    from cspm.campaign.summary import summary_of
    from cspm.campaign.task import DONE, FAILED, STATUS

    with interruptible() as stopped, shown(console, "reading the campaign") as progress:
        done = run_campaign(
            request.file,
            request.out,
            workers=request.workers,
            scheduler=request.scheduler,
            time_limit=request.time_limit,
            progress=progress,
            tell=lambda line: say(console, line),
            stop=stopped,
        )
    found = summary_of(done)
    page = write_campaign_page(done, found)
    _print(console, done, found)
    say(console, f"table {done.folder / TABLE}, page {page}")
    if json is not None:
        write_json(json, found)
    if done.interrupted and len(done.rows) < len(done.variants):
        kept = f"{len(done.rows)} of {len(done.variants)} runs are kept"
        say(console, f"interrupted: {kept}; the same command goes on")
        return False
    return all(row[STATUS] in (DONE, FAILED) for row in done.rows)


def list_command(file: Path, json: Path | None) -> None:
    """Print the runs of a campaign as commands.

    Raises:
        InputError: the file has a fault.
    """
    require_engine()
    from cspm.campaign.campaign import command_of, plan_of

    console, plan = make_console(), plan_of(file)
    commands = [command_of(each, plan.file.plant) for each in plan.variants]
    for command in commands:
        say(console, command)
    if json is not None:
        write_json(json, {"runs": commands})


def spread_table(title: str, metrics: Mapping[str, Mapping[str, Any]]) -> Table:
    """Return the spread of each metric; it fits into 60 columns."""
    from cspm.campaign.summary import SPREAD, spread_cells

    table = Table(title=escape(title), box=box.SIMPLE, pad_edge=False, padding=(0, 1, 0, 0))
    table.add_column("", overflow="fold")
    for head in SPREAD:
        table.add_column(head, justify="right", no_wrap=True)
    table.add_column("unit", no_wrap=True)
    for name, each in metrics.items():
        table.add_row(escape(name), *spread_cells(each, 3), each["unit"])
    return table


def _print(console: Console, done: Campaign, found: dict[str, Any]) -> None:
    console.print(spread_table(f"{done.file.name}: {len(done.rows)} runs", found["metrics"]))
    for row in done.failures[:_MOST_FAILURES]:
        say(console, f"run {row['run']} {row['status']}: {row['failure']}")
        say(console, f"  {done.command_of(row['run'])}")
    more = len(done.failures) - _MOST_FAILURES
    if more > 0:
        say(console, f"and {more} more; column `status` of the table")
    if found["worst"]:
        first = found["worst"][0]
        say(console, f"worst by {first['metric']}, run {first['run']}: {first['command']}")
