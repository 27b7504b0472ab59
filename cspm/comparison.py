"""Comparing a recording with its simulation."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from cspm.measured import measured
from cspm.progress import Progress, by_steps, shows_progress, silent
from cspm.recorded import AnyRecording
from cspm.testbed import AnyTestbed
from cspm_ident.block_simulation import Input
from cspm_ident.comparison.channel_fit import ChannelFit
from cspm_ident.comparison.compare import Comparison as Result
from cspm_ident.comparison.compare import compare as compare_measurement
from cspm_msgs_py.errors import InputError
from cspm_msgs_py.new_folder import new_folder
from cspm_run.output.json_file import write_json

DRIVES = (Input.WINCH.value, Input.TORQUE.value, Input.TENSION.value)


@dataclass(frozen=True, eq=False)
class Comparison:
    """A recording beside its simulation.

    Attributes:
        result: all of it, internal.
    """

    result: Result

    @property
    def channels(self) -> tuple[ChannelFit, ...]:
        """Each quantity with `name`, `unit`, `block`, `vaf` [%], `nrmse`, `rms`, `bias`, `lag` [s].

        First those of the whole, then those of each block driven by measured signals alone. `vaf`
        is None of what is at rest.
        """
        return tuple(self.result.channels)

    def __repr__(self) -> str:
        """Return how many quantities were compared, and the worst of them."""
        worst = self._worst_first()
        if not worst:
            return "<Comparison: nothing compared>"
        return f"<Comparison of {len(self.channels)} quantities, worst {worst[0].name}>"

    def _repr_html_(self) -> str:
        """Show the quantities as a table in a notebook, the worst first."""
        from cspm.notebook import table

        heads = ("quantity", "block", "error, RMS", "times its noise", "VAF")
        rows = (
            (
                each.name,
                each.block,
                f"{each.rms:.3g} {each.unit}",
                f"{each.rms / each.floor:.1f}" if each.floor else "",
                "" if each.vaf is None else f"{each.vaf:.2f} %",
            )
            for each in self._worst_first()
        )
        return table("Measured against simulated", heads, rows)

    def _worst_first(self) -> list[ChannelFit]:
        ratios = {each: each.rms / each.floor if each.floor else 0.0 for each in self.channels}
        return sorted(self.channels, key=lambda each: -ratios[each])

    def channel(self, name: str, block: str = "whole") -> ChannelFit:
        """Return a quantity of a block, such as `cables/tension/sway_3`.

        Raises:
            InputError: there is none of this name.
        """
        found = {each.name: each for each in self.channels if each.block == block}
        if name not in found:
            raise InputError(f"{block}: no channel {name}, allowed: {', '.join(found) or 'none'}")
        return found[name]

    def data(self) -> dict[str, Any]:
        """Return everything as plain data: what `cspm compare --json` writes."""
        return self.result.data()

    def write(self, folder: str | Path) -> Path:
        """Write comparison.json and report.html; return the report's path.

        Args:
            folder: a new one.

        Raises:
            InputError: the folder exists.
        """
        place = new_folder(folder)
        # Loading plotly takes a second that a table alone need not wait for.
        from cspm_ident.comparison.page import write_page

        write_json(place / "comparison.json", self.data())
        write_page(place / "report.html", self.result)
        return place / "report.html"


@shows_progress("reading")
def compare(
    recording: AnyRecording,
    *,
    testbed: AnyTestbed | None = None,
    drive: str = DRIVES[0],
    horizon: float | None = None,
    delays: Mapping[str, float] | None = None,
    repeat: AnyRecording | None = None,
    progress: Progress = silent,
) -> Comparison:
    """Simulate a recording from its own measured inputs and hold both together: `cspm compare`.

    Args:
        recording: what was recorded.
        testbed: the machine to simulate, instead of the one that the recording carries.
        drive: what is taken from the recording beside the winch frame's pose: `winch`, motor
            angles; `torque`, motor torques; `tension`, cable tensions. The rest is simulated.
        horizon: begin anew from the measured state after so long [s]; None: 0.5 s for torque and
            tension, whose errors grow, and never for winch.
        delays: how late sensors' stamps are [s], by topic; None: found.
        repeat: the same experiment once more, from which the noise floor is taken.
        progress: called now and then with an estimate of the share and what is being done;
            none: a bar in a terminal, lines in a notebook.

    Raises:
        InputError: naming what is wrong in recording, test-bed or arguments.

    Examples:
        >>> import cspm
        >>> found = cspm.compare("today", testbed="thesis")  # doctest: +SKIP
        >>> found.channel("cables/tension/sway_3").vaf  # doctest: +SKIP
        99.2
    """
    if drive not in DRIVES:
        raise InputError(f"drive {drive}: allowed: {', '.join(DRIVES)}")
    [measurement] = measured([recording], testbed)
    again = None if repeat is None else measured([repeat], testbed)[0]
    found = compare_measurement(
        measurement,
        Input(drive),
        horizon=horizon,
        delays=delays,
        repeat=again,
        progress=by_steps(progress),
    )
    return Comparison(found)
