"""The command `cspm new`."""

from __future__ import annotations

import keyword
from pathlib import Path

import numpy as np

from cspm.commands.run_command import run_command
from cspm.new.files import Accuracies, scenario_text, testbed_text
from cspm.new.layout import KINDS, layout
from cspm_ident.diagnosis.reporting.machine_drawing import drawing
from cspm_msgs_py.errors import InputError
from cspm_msgs_py.scenario import load_scenario
from cspm_msgs_py.testbed import load_testbed
from cspm_run.output.console import make_console, say
from cspm_run.output.json_file import write_json

# Of the frame's least side in the plane of motion.
RADIUS_SHARE = 0.1


def new_command(
    name: str,
    kind: str,
    size: tuple[float, float, float],
    mass: float,
    json: Path | None = None,
    known: Accuracies | None = None,
    *,
    run: bool,
) -> None:
    """Write test-bed and scenario of a new robot, check and draw it, and run it.

    Args:
        name: of the robot; its files are NAME.yaml, NAME_testbed.yaml and NAME.svg.
        kind: one of `KINDS`.
        size: of its frame, x y z [m].
        mass: of its platform [kg].
        known: how well places and mass are known; None: as usual.
        json: file for the names of what is written; None writes none.
        run: whether to run the scenario.

    Raises:
        InputError: a name that is none, files that exist, or a machine that cannot be controlled.
    """
    if not name.isidentifier() or keyword.iskeyword(name) or not name.isascii():
        raise InputError(f"new {name}: allowed: letters, digits and _, a letter first")
    if kind not in KINDS:
        raise InputError(f"--kind {kind}: allowed: {', '.join(KINDS)}")
    if not (min(size) > 0.0 and mass > 0.0):
        raise InputError(f"--size {size}, --mass {mass:g}: allowed: more than 0")
    machine, scenario = Path(f"{name}_testbed.yaml"), Path(f"{name}.yaml")
    picture = Path(f"{name}.svg")
    for path in (machine, scenario, picture):
        if path.exists():
            raise InputError(f"{path}: already exists, allowed: a new file, or another name")
    known = known or Accuracies()
    for option, accuracy in known._asdict().items():
        if accuracy is not None and not 0.0 <= accuracy < np.inf:
            raise InputError(f"--{option}-accuracy {accuracy:g}: allowed: 0 or more")
    planned = layout(kind, size)
    radius = RADIUS_SHARE * min(size[0], size[2] if planned.upright else size[1])
    machine.write_text(testbed_text(name, planned, mass, known), encoding="utf-8")
    scenario.write_text(scenario_text(name, machine.name, planned, radius), encoding="utf-8")
    pose = np.array(load_scenario(scenario).bar_mean_pose)
    svg = drawing(load_testbed(machine).testbed, pose, None, ())
    picture.write_text(svg, encoding="utf-8")
    console = make_console()
    say(console, f"written {machine}, {scenario}, {picture}")
    if run:
        run_command(scenario, (), None, None)
    if json is not None:
        files = {"testbed": machine, "scenario": scenario, "picture": picture}
        write_json(json, {key: str(path) for key, path in files.items()})
    say(console, f"next: edit {machine}, then cspm run {scenario} --out first")
    say(console, f"      cspm diagnose first; cspm analyze workspace {scenario} --coarse 2")
