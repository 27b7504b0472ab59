"""What the guessed motion and the motion capture's noise have to do with the factor's VAF.

`python -m bench.accuracy.factor_six_motion` records the thesis's three lengths with faster
moves and with less noise, matches surge by a factor on the axial damping each time, and writes
the second table of docs/explanation/the-factor-six.md.
The plant is the model's own: nothing is identified here
but that factor.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from rich.console import Console

from bench.accuracy.factor_six import (
    HIDDEN,
    LENGTHS,
    PAGE,
    SCENARIOS,
    THESIS,
    fit_factor,
    record,
    share,
    without_factor,
)
from bench.page import into_page
from cspm_ident.signals.measurement import BAR, FRAME, Measurement
from cspm_ident.system.choice import choose
from cspm_ident.system.machine import machine_with
from cspm_ident.system.prediction_test import Judgement, judge
from cspm_msgs_py.dofs import DOFS
from cspm_msgs_py.new_folder import ScratchFolder
from cspm_msgs_py.testbed import Testbed, TestbedFile, load_testbed

_SHOWN = DOFS[:3]


@dataclass(frozen=True)
class Variant:
    """One guess at what the thesis does not give.

    Attributes:
        slower: factor on the duration of each move of the winch frame.
        quieter: by what the noise of motion capture is divided.
    """

    slower: float
    quieter: float

    @property
    def title(self) -> str:
        """How the page calls it."""
        return f"moves × {self.slower:g}, noise ÷ {self.quieter:g}"


VARIANTS = (Variant(0.5, 1.0), Variant(1.0, 3.0))


def main() -> None:
    """Run the whole."""
    console = Console()
    described = without_factor(load_testbed(SCENARIOS / "testbeds" / "thesis.yaml"))
    rows = [
        f"| VAF surge / sway / heave, % | {' | '.join(LENGTHS.values())} | factor |",
        "|---" * (2 + len(LENGTHS)) + "|",
        f"| thesis, its factor | {' | '.join(_published(i) for i in range(len(LENGTHS)))} | 6 |",
    ]
    for variant in VARIANTS:
        rows += _rows(variant, described)
        console.print("\n".join(rows), markup=False, highlight=False)
    into_page(PAGE, "factor six motion", "\n".join(rows))


def _published(i: int) -> str:
    numbers = (THESIS[dof][i] for dof in _SHOWN)
    return " / ".join("low" if number is None else f"{number:g}" for number in numbers)


def _rows(variant: Variant, described: TestbedFile) -> list[str]:
    machine = described.testbed
    hidden = machine_with(machine, choose(machine, list(HIDDEN)), list(HIDDEN.values()))
    quiet = _quieter(hidden, variant.quieter)
    with ScratchFolder("factor-six") as place:
        recordings = [
            record(place / n, f"verification_{n}", described, quiet, "sim", variant.slower)
            for n in LENGTHS
        ]
    factor = fit_factor(machine, recordings)
    machines = {
        "nominal": machine,
        "factor": machine_with(machine, choose(machine, ["axial_damping"]), [factor]),
        "machine itself": hidden,
    }
    judged = _judged(recordings, machines)
    shown = {label: f"{factor:.2f}" if label == "factor" else "" for label in machines}
    return [
        f"| {variant.title}: {label} | {' | '.join(_cell(j, label) for j in judged)} | {text} |"
        for label, text in shown.items()
    ]


def _judged(recordings: Sequence[Measurement], machines: dict[str, Testbed]) -> list[Judgement]:
    return [judge(each, machines, delays={}) for each in recordings]


def _cell(judged: Judgement, label: str) -> str:
    return " / ".join(f"{share(judged, label, dof):.2f}" for dof in _SHOWN)


def _quieter(machine: Testbed, divisor: float) -> Testbed:
    """Return the machine with less noise on both poses."""
    sensors = dict(machine.sensors)
    for topic in (FRAME, BAR):
        noise = tuple(number / divisor for number in sensors[topic].noise)
        sensors[topic] = sensors[topic].model_copy(update={"noise": noise})
    return machine.model_copy(update={"sensors": sensors})


if __name__ == "__main__":
    main()
