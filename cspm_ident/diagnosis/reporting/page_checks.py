"""Tables of the report page that check the recordings: data, energy and controllers."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from cspm_ident.data_look.channel_checks import drives_at_limit
from cspm_ident.diagnosis.diagnosis import Diagnosis
from cspm_ident.diagnosis.reporting.statement import channel_of
from cspm_ident.diagnosis.validation.residual_power import Power, lost_powers
from cspm_ident.offline_page import table_html


def data_table(data: dict[str, Any]) -> str:
    """Return what the recordings themselves show as HTML; empty where nothing was looked at.

    Args:
        data: contents of `diagnosis.json`, with `data_checks`.
    """
    checks = data.get("data_checks", ())
    rows = [
        (Path(each["recording"]).name, each["check"], each["what"], each["remedy"])
        for each in sorted(checks, key=lambda each: bool(each["ok"]))
    ]
    wrong = sum(not each["ok"] for each in checks)
    text = f"<p>{wrong} of {len(rows)} checks found something, before any model was fitted.</p>"
    heads = ("recording", "check", "what was found", "remedy")
    return text + table_html(heads, rows, "the recordings themselves") if rows else ""


def saturation_table(found: Diagnosis) -> str:
    """Return which drives were at their torque limit as HTML; empty where none was.

    Touches count that are too rare for the check of the data.
    """
    rows = []
    for each in (*found.searched, *found.held_out):
        for drive in drives_at_limit(each):
            if drive.longest > 0.0:
                kind = "stretches" if drive.lasts else "chatter"
                cells = f"{100.0 * drive.share:.1f}", kind, f"{1e3 * drive.longest:.3g}"
                rows.append((each.path.name, drive.drive.replace("_", " "), *cells))
    heads = ("recording", "drive", "share of the time [%]", "kind", "longest [ms]")
    text = "<p>Where a drive is at its limit it does not give what is asked of it.</p>"
    return text + table_html(heads, rows, "drives at their torque limit") if rows else ""


def energy_table(found: Diagnosis) -> str:
    """Return the mean power of every residual as an HTML table; empty without any."""
    heads = ("residual", "before [W]", "after [W]", "95 % interval [W]", "residual power")
    rows = []
    for power in lost_powers(found.curves):
        ends = f"{power.after - power.half:.2g} to {power.after + power.half:.2g}"
        reported = f"{power.before:.2g}", f"{power.after:.2g}", ends, _takes_or_gives(power)
        rows.append((channel_of(power), *reported))
    text = (
        "<p>Mean power that the machine loses beyond the model, on held-out data: residuals times"
        " the measured rates that they act at. Friction, drag and dampers take energy. Where the"
        " rest gives some, another cause remains: a drive, a sensor or a force from outside.</p>"
    )
    return text + table_html(heads, rows, "power beyond the model") if rows else ""


def _takes_or_gives(power: Power) -> str:
    if power.gives:
        return "gives energy"
    return "takes energy" if power.after > power.half else "neither significantly"


def controllers_table(data: dict[str, Any]) -> str:
    """Return recorded commands against the controllers' own, as HTML; empty without any.

    Args:
        data: contents of `diagnosis.json`, with `controllers` where they could be stepped.
    """
    rows = [
        (
            each["node"],
            each["topic"],
            str(each["compared"]),
            str(each["different"]),
            f"{each['largest']:.2g}",
        )
        for each in data.get("controllers", ())
    ]
    heads = ("controller", "commands", "compared", "different", "largest difference")
    text = (
        "<p>The described controllers, each stepped again with what was recorded: commands that"
        " differ are not theirs, whatever the machine does.</p>"
    )
    return text + table_html(heads, rows, "recorded commands and described ones") if rows else ""
