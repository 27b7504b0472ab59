"""The command `cspm demo --real NAME`: a known term leaves the file of a real machine."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from rich.console import Console

from cspm.commands.demo_command import VERDICT, diagnosed, guess_of, named, reveal
from cspm.commands.recordings.data_command import FOLDER, data_get_command
from cspm.demo.concealment import CONCEALABLE, Concealed
from cspm.diagnosis import Diagnosis
from cspm.importing import import_recording
from cspm.open_data.source import Machine, Source, source_of
from cspm.recorded import Recording
from cspm.testbed import Testbed, load_testbed
from cspm_msgs_py.errors import InputError
from cspm_msgs_py.new_folder import refuse_existing
from cspm_run.output.console import make_console, say
from cspm_run.output.json_file import write_json

_OFFERED = tuple(name for name in CONCEALABLE if name.startswith("winch_"))


@dataclass(frozen=True)
class RealDemoRequest:
    """Options of the command.

    Attributes:
        name: of published recordings.
        seed: of which machine of theirs, and which term.
        effect: the term; None draws it.
        out: a new folder.
        ask: whether somebody is there to guess.
    """

    name: str
    seed: int
    effect: str | None
    out: Path
    ask: bool


def demo_real_command(request: RealDemoRequest, json: Path | None) -> None:
    """Delete a term, let guess, diagnose, reveal.

    Raises:
        InputError: the folder exists, or no machine of these recordings has the effect.
        CspmError: the recordings cannot be fetched.
    """
    console = make_console()
    refuse_existing(request.out)
    source, random = source_of(request.name), np.random.default_rng(request.seed)
    folder = FOLDER / source.folder
    if not folder.is_dir():
        data_get_command(request.name, None, None, None, None)
    machine, known, truth = _drawn(request, source, folder, random)
    described = known.without_effect(truth.effect)
    say(console, f"1  {source.title}: {machine.tables[0]}; the file lacks one known term.")
    say(console, f"   (seed {request.seed}; {source.licence}, {source.citation})")
    searched, held_out = _imported(request.out, machine, folder, described)
    say(console, f"2  Recordings {searched.path}, held out {held_out.path}.")
    answer = guess_of(console, described, [truth], random, _OFFERED) if request.ask else None
    found = diagnosed(console, searched, described, [held_out])
    found.write(request.out / VERDICT)
    reveal(console, found, [truth], answer)
    _say_fit(console, found)
    say(console, f"The verdict is in {request.out / VERDICT / 'diagnosis.html'}.")
    if json is not None:
        deleted = {"effect": truth.effect, "parameters": truth.parameters}
        said = {"verdict": found.verdict, "named": named(found, truth)}
        write_json(json, {"seed": request.seed, "tables": machine.tables[:2], **deleted, **said})


def _drawn(
    request: RealDemoRequest, source: Source, folder: Path, random: np.random.Generator
) -> tuple[Machine, Testbed, Concealed]:
    """Return a machine, its file with all that is known, and the term that leaves it."""
    terms = []
    for machine in source.machines:
        known = load_testbed(folder / machine.known)
        for entry in known.effects:
            element = (entry.elements or known.cables)[0]
            term = Concealed(entry.effect, element, dict(entry.parameters))
            terms.append((machine, known, term))
    having = [each for each in terms if request.effect in (None, each[2].effect)]
    if not having:
        names = ", ".join(sorted({term.effect for *_, term in terms}))
        raise InputError(
            f"--effect {request.effect}: no machine of {request.name} has it, allowed: {names}"
        )
    return having[int(random.integers(len(having)))]


def _imported(
    out: Path, machine: Machine, folder: Path, described: Testbed
) -> tuple[Recording, Recording]:
    """Return the recordings of the first two runs."""
    first, second = (
        import_recording(
            folder / table,
            out / Path(table).stem,
            mapping=folder / machine.mapping,
            testbed=described,
        )
        for table in machine.tables[:2]
    )
    return first, second


def _say_fit(console: Console, found: Diagnosis) -> None:
    for fit in found.data["fit"]:
        held_out = fit["held_out"]
        before, after = (held_out[f"vaf_{when}"] for when in ("before", "after"))
        say(
            console,
            f"6  {fit['channel']}: the file explains {before:.0f} % of the held-out variance, with"
            f" what was named {after:.0f} %.",
        )
