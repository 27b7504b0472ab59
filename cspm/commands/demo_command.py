"""The command `cspm demo`."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from rich.console import Console

from cspm.commands.progress_shown import shown
from cspm.commands.view_command import page_of
from cspm.demo.concealment import CONCEALABLE, Concealed, drawn
from cspm.demo.guess import choices, guessed
from cspm.diagnosis import Diagnosis, diagnose
from cspm.recorded import Recording
from cspm.simulation import Run, simulate
from cspm.testbed import Testbed, load_testbed
from cspm_ident.diagnosis_file import REPORT
from cspm_msgs_py.new_folder import refuse_existing
from cspm_run.output.console import make_console, say
from cspm_run.output.json_file import write_json
from cspm_sim.effects import catalogue

SCENARIO = "calm"
MACHINE = "thesis"
# Two reversals of every winch and more; recorded, diagnosed and repeated in three minutes.
DURATION_S = 20.0
RECORDED, IMPROVED, VERDICT, PAGE = "recorded", "improved", "verdict", "see_it.html"
_HARD_SHARE, _HARD_COUNT = 0.5, 2


@dataclass(frozen=True)
class DemoRequest:
    """Options of the command.

    Attributes:
        seed: of what is concealed.
        effect: its id; None draws it.
        hard: whether two effects are concealed, each half as large.
        out: a new folder.
        ask: whether somebody is there to guess.
    """

    seed: int
    effect: str | None
    hard: bool
    out: Path
    ask: bool


def demo_command(request: DemoRequest, json: Path | None) -> None:
    """Conceal, show, let guess, diagnose, reveal, and run the improved model.

    Raises:
        InputError: the folder exists, or the effect cannot be concealed.
    """
    console = make_console()
    refuse_existing(request.out)
    random = np.random.default_rng(request.seed)
    described = load_testbed(MACHINE)
    count, share = (_HARD_COUNT, _HARD_SHARE) if request.hard else (1, 1.0)
    truth = drawn(described, random, count, share, request.effect)
    recording, described_run = _recorded(console, request, described, truth)
    _show(console, described_run, recording)
    answer = guess_of(console, described, truth, random) if request.ask else None
    found = diagnosed(console, recording, described)
    found.write(request.out / VERDICT)
    reveal(console, found, truth, answer)
    after = _improved(console, request, found, recording, described_run)
    _conclude(console, request, recording)
    if json is not None:
        write_json(json, _data(request, truth, answer, found, after))


def _recorded(
    console: Console, request: DemoRequest, described: Testbed, truth: list[Concealed]
) -> tuple[Recording, Run]:
    """Return what the real machine does, and what its description says that it does."""
    hidden = "one hidden change" if len(truth) == 1 else f"{len(truth)} hidden changes"
    say(console, f"1  A machine is built to its drawing, with {hidden}. (seed {request.seed})")
    machine = described
    for each in truth:
        machine = machine.with_effect(each.effect, each.element, **each.parameters)
    with shown(console, "the machine runs") as progress:
        real = simulate(SCENARIO, testbed=machine, duration=DURATION_S, progress=progress)
    with shown(console, "its model runs") as progress:
        model = simulate(SCENARIO, testbed=described, duration=DURATION_S, progress=progress)
    request.out.mkdir(parents=True)
    recording = real.save(request.out / RECORDED)
    say(console, f"   It follows the other ship for {DURATION_S:g} s: {recording.path}")
    return recording, model


def _show(console: Console, model: Run, recording: Recording) -> None:
    say(console, "2  What the engineer sees, machine against model:")
    for line in differences(recording, model):
        say(console, f"   {line}")


def differences(recording: Recording, model: Run) -> list[str]:
    """Return the signals in which machine and model differ most, relative to their motion."""
    rows = []
    for name, unit in (("tension", "N"), ("winch_torque", "N·m"), ("winch_angle", "rad")):
        real, own = recording.signal(name), model.signal(name)
        count = min(len(real.values), len(own.values))
        error = real.values[:count] - own.values[:count]
        rms = np.sqrt(np.mean(error**2, axis=0))
        share = rms / np.maximum(real.values.std(axis=0), 1e-12)
        worst = int(np.argmax(share))
        what, cable = name.replace("_", " "), real.columns[worst].replace("_", " ")
        rows.append(
            f"{what} differs most on {cable}: {rms[worst]:.3g} {unit} RMS,"
            f" {share[worst]:.0%} of its motion"
        )
    return rows


def guess_of(
    console: Console,
    described: Testbed,
    truth: list[Concealed],
    random: np.random.Generator,
    names: Sequence[str] = tuple(CONCEALABLE),
) -> Concealed | None:
    """Return what somebody at the terminal guesses; None where nothing is.

    Args:
        console: to ask on.
        described: the machine as described.
        truth: what is concealed.
        random: order of what is offered.
        names: effects that are offered besides.
    """
    say(console, "3  What is it?")
    offered = choices(described, truth[0], random, names)
    try:
        return guessed(offered, input, lambda line: say(console, line))
    except EOFError:
        return None


def diagnosed(
    console: Console,
    recording: Recording,
    described: Testbed,
    held_out: Sequence[Recording] = (),
) -> Diagnosis:
    """Diagnose a recording, and say what is found.

    Args:
        console: to say it on.
        recording: to search.
        described: the machine as described.
        held_out: what is judged; if empty, the last part of the recording.
    """
    with shown(console, "diagnosing") as progress:
        found = diagnose(
            recording,
            testbed=described,
            held_out=held_out,
            closed_loop=False,
            progress=lambda share, what: progress(share, f"diagnosing: {what}"),
        )
    say(console, f"4  The diagnosis, of the recording alone: {found.verdict}")
    for each in found.findings:
        say(console, f"   • {each.statement}")
        for rival in each.alternatives:
            place = ", ".join(rival.elements).replace("_", " ")
            words = catalogue()[rival.effect].words
            say(console, f"     as well explained by {words} of {place}")
    return found


def named(found: Diagnosis, truth: Concealed) -> bool:
    """Return whether a finding names an effect on its element."""
    return any(
        each.effect == truth.effect and truth.element in each.elements for each in found.findings
    )


def reveal(
    console: Console, found: Diagnosis, truth: list[Concealed], answer: Concealed | None
) -> None:
    """Say what was concealed, and whether diagnosis and guess were right."""
    say(console, "5  What was concealed:")
    for each in truth:
        verdict = "named" if named(found, each) else "not named"
        say(console, f"   {each.words}, {each.numbers}: {verdict} by the diagnosis")
    if answer is not None:
        right = any(
            (answer.effect, answer.element) == (each.effect, each.element) for each in truth
        )
        say(console, f"   Your guess, {answer.words}: {'right' if right else 'not it'}")


def _improved(
    console: Console,
    request: DemoRequest,
    found: Diagnosis,
    recording: Recording,
    before: Run,
) -> dict[str, float]:
    """Run the improved model beside the recording; return RMS differences of tension [N]."""
    if found.improved_testbed is None:
        say(console, "6  Nothing was named, so the model stays as it is.")
        page = page_of([recording.path], None, request.out / VERDICT / REPORT)
        (request.out / PAGE).write_text(page, encoding="utf-8")
        return {}
    with shown(console, "the improved model runs") as progress:
        better = found.improved_testbed
        run = simulate(SCENARIO, testbed=better, duration=DURATION_S, progress=progress)
        saved = run.save(request.out / IMPROVED)
        pair = [recording.path, saved.path]
        page = page_of(pair, None, request.out / VERDICT / REPORT)
    (request.out / PAGE).write_text(page, encoding="utf-8")
    sizes = {"before": _apart(recording, before), "after": _apart(recording, run)}
    say(
        console,
        f"6  The model runs again with what was found. Its torques differ from the machine's by"
        f" {1e3 * sizes['after']:.3g} mN·m RMS, before by {1e3 * sizes['before']:.3g} mN·m.",
    )
    return sizes


def _apart(recording: Recording, run: Run) -> float:
    """Return the RMS difference of the motor torques [N·m], all winches together."""
    real, own = recording.winch_torque.values, run.winch_torque.values
    count = min(len(real), len(own))
    return float(np.sqrt(np.mean((real[:count] - own[:count]) ** 2)))


def _conclude(console: Console, request: DemoRequest, recording: Recording) -> None:
    say(console, f"\nSee it: open {request.out / PAGE} in a browser; the verdict is in")
    say(console, f"{request.out / VERDICT / 'diagnosis.html'}. The same on your own recording:")
    say(console, f"  cspm diagnose {recording.path} --testbed FILE --out verdict")
    again = f"cspm demo --seed {request.seed + 1}"
    say(console, f"Another machine: {again}; two effects at once: {again} --hard")
    sys.stdout.flush()


def _data(
    request: DemoRequest,
    truth: list[Concealed],
    answer: Concealed | None,
    found: Diagnosis,
    after: dict[str, float],
) -> dict[str, Any]:
    return {
        "seed": request.seed,
        "concealed": [
            {"effect": e.effect, "element": e.element, "parameters": e.parameters} for e in truth
        ],
        "guess": None if answer is None else {"effect": answer.effect, "element": answer.element},
        "verdict": found.verdict,
        "named": [named(found, each) for each in truth],
        "torque_rms_nm": after,
    }
