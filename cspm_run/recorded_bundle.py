"""The run that a recording describes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from cspm_msgs_py.recording.reader import Recording
from cspm_msgs_py.recording.run_record import SIM, simulated_plant
from cspm_msgs_py.scenario import parse_scenario
from cspm_run.assembly import resolve
from cspm_run.bundle import SCENARIO, Bundle, read_bundle


def recorded_bundle(path: Path, overrides: Sequence[str] = ()) -> Bundle:
    """Return the description that a recording carries, resolved.

    Args:
        path: the recording.
        overrides: values put over the scenario's, `key.path=value`.

    Raises:
        InputError: it carries none, or is no recording; or an override that cannot be used.
    """
    with Recording(path) as recording:
        attachments = recording.attachments
        plant = simulated_plant(recording) or SIM
    bundle = replace(read_bundle(attachments, str(path)), plant=plant)
    if not overrides:
        return bundle
    text = attachments[SCENARIO].decode(errors="replace")
    scenario = parse_scenario(text, f"{path}: {SCENARIO}", overrides)
    # Overrides can take a recording's controllers away; they make none of them the user's own.
    unasked = bundle.unasked if scenario.controllers else None
    resolved = resolve(scenario, bundle.testbed.testbed)
    return replace(bundle, scenario=resolved, unasked=unasked)
