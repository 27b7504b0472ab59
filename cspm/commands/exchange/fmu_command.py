"""The command `cspm fmu`: a scenario's plant for other simulators."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from cspm.commands.run_command import bundle_from
from cspm_msgs_py.errors import InputError
from cspm_msgs_py.installed.extra_library import extra_library
from cspm_msgs_py.new_folder import ScratchFolder, refuse_existing
from cspm_msgs_py.recording.run_record import SIM
from cspm_run.bundle import Bundle
from cspm_run.output.console import make_console, say
from cspm_run.output.json_file import write_json
from cspm_sim.fmu.unit import EXTRA
from cspm_sim.fmu.unit_file import ENDING
from cspm_sim.fmu.variables import RUN_FOLDER

# PythonFMU takes the class from a file, and names the module that it imports after it.
MODULE = "cspm_plant_unit"
# It also drops a reference to that module's names with each instance, which would end a process of
# Python's at the next collection of garbage: here are enough for as many instances.
SCRIPT = '''"""The unit's class."""

from cspm_run.exchange.plant_unit import PlantUnit

HELD = [globals()] * 100_000
'''


def fmu_command(
    path: Path,
    out: Path | None,
    overrides: Sequence[str] = (),
    machine: Path | None = None,
    effects: Sequence[str] = (),
    json: Path | None = None,
) -> None:
    """Write the plant of a scenario as a unit of FMI 2 for co-simulation.

    Args:
        path: the scenario.
        out: a new file; None names it after the scenario.
        overrides: replaced values, `KEY=VALUE`.
        machine: a test-bed file instead of the scenario's.
        effects: physics planted in the machine, as for `cspm run`.
        json: file for the unit's name; None writes none.

    Raises:
        InputError: the scenario cannot be used, the file exists, or PythonFMU is not installed.
    """
    builder = extra_library("pythonfmu", EXTRA, "cspm fmu").FmuBuilder
    bundle = bundle_from(path, overrides, machine, SIM, effects)
    place = out if out is not None else Path(f"{bundle.scenario.name}{ENDING}")
    if place.suffix != ENDING or not place.absolute().parent.is_dir():
        raise InputError(f"--out {place}: allowed: a name that ends in {ENDING}, in a folder")
    refuse_existing(place)
    with ScratchFolder("fmu") as folder:
        script, run = _resources(bundle, folder)
        known = list(sys.path)
        try:
            builder.build_FMU(script, dest=place.absolute(), project_files=[run])
        finally:
            # The builder leaves the script's folder there.
            sys.path[:] = known
    say(make_console(), f"fmu {place}")
    if json is not None:
        write_json(json, {"fmu": str(place)})


def _resources(bundle: Bundle, folder: Path) -> tuple[Path, Path]:
    """Write the script of a unit, and a folder with what its plant is made of."""
    # A plant needs no controllers, whose code is the user's own.
    code = {each.file for each in bundle.scenario.controllers.values()}
    scenario = bundle.scenario.model_copy(update={"controllers": {}})
    files = {name: text for name, text in bundle.files.items() if name not in code}
    script, run = folder / f"{MODULE}.py", folder / RUN_FOLDER
    run.mkdir()
    for name, content in replace(bundle, scenario=scenario, files=files).attachments().items():
        (run / name).write_bytes(content)
    script.write_text(SCRIPT, encoding="utf-8")
    return script, run
