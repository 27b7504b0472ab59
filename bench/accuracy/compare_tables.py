"""How near `cspm compare` comes to the noise where nothing is missing, and which delays it finds.

`python -m bench.accuracy.compare_tables` records, compares, and writes the two tables of
docs/explanation/comparison.md.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace
from pathlib import Path

from rich.console import Console

from bench.page import into_page
from cspm_ident.comparison.compare import Comparison, compare
from cspm_ident.signals.delays import find_delays
from cspm_ident.signals.measurement import BAR, FRAME, Measurement, read_measurement
from cspm_ident.signals.timeline import Timeline
from cspm_msgs_py.new_folder import ScratchFolder
from cspm_msgs_py.scenario import load_scenario
from cspm_msgs_py.testbed import load_testbed
from cspm_run.assembly import resolve
from cspm_run.bundle import make_bundle
from cspm_run.library import find_scenario
from cspm_run.recorded_run import run

ROOT = Path(__file__).resolve().parents[2]
SCENARIOS = ROOT / "scenarios"
PAGE = ROOT / "docs" / "explanation" / "comparison.md"
# By how much stamps of bar and frame are shifted [s].
SHIFTS = (
    (0.0, 0.0),
    (0.002, 0.0),
    (0.0, 0.005),
    (0.005, 0.005),
    (0.010, 0.020),
    (0.020, 0.010),
    (0.020, 0.020),
)
# Rows: block, what the names of its channels begin with, and how the page calls them.
ROWS = (
    ("whole", "bar/pose", "whole, bar"),
    ("whole", "cables/tension", "whole, tensions"),
    ("winch", "winches/angle", "winch, angles"),
    ("winch", "winches/speed", "winch, speeds"),
    ("cable", "cables/tension", "cable, tensions"),
    ("bar", "bar/pose", "bar, bar"),
)


@dataclass(frozen=True)
class TableCase:
    """A recording to be made.

    Attributes:
        scenario: its name.
        seconds: how long.
        about: what the page says of it.
        plant: whose equations made it.
    """

    scenario: str
    seconds: float
    about: str
    plant: str = "sim"

    @property
    def title(self) -> str:
        """How the page calls it."""
        made = "" if self.plant == "sim" else "MuJoCo, "
        return f"{made}`{self.scenario}` {self.seconds:g} s"


CASES = (
    TableCase("verification_mid", 40.0, "winches locked, 100 Hz"),
    TableCase("calm_broadband", 50.0, "1 kHz"),
    TableCase("worst_case_steep", 60.0, "1 kHz"),
    TableCase("worst_case_steep", 20.0, "1 kHz", "mujoco"),
)


def main() -> None:
    """Run the whole."""
    console = Console()
    floors, delays = {}, []
    with ScratchFolder("compare") as place:
        for number, case in enumerate(CASES):
            console.print(f"{case.title}: recording")
            measurement = _record(place / str(number), case)
            console.print(f"{case.title}: comparison")
            floors[case.title] = ratios(compare(measurement))
            console.print(f"{case.title}: delays")
            delays.append(_delay_row(case, measurement))
    tables = {"delays": _delay_table(delays), "floors": _floor_table(floors)}
    for name, text in tables.items():
        console.print(text, markup=False, highlight=False)
        into_page(PAGE, name, text)


def ratios(found: Comparison) -> dict[str, str]:
    """Return RMS error over noise floor, least and most of the channels of each row."""
    texts = {}
    for block, stem, title in ROWS:
        shares = [
            c.rms / c.floor for c in found.channels if c.block == block and c.name.startswith(stem)
        ]
        texts[title] = f"{min(shares):.2f}–{max(shares):.2f}" if shares else "at rest"
    return texts


def _record(folder: Path, case: TableCase) -> Measurement:
    path = find_scenario(case.scenario)
    scenario = load_scenario(path, [f"duration={case.seconds}"])
    testbed = load_testbed(path.parent / scenario.testbed)
    bundle = make_bundle(resolve(scenario, testbed.testbed), testbed, path.parent)
    run(replace(bundle, plant=case.plant), folder)
    return read_measurement(folder)


def _delay_row(case: TableCase, measurement: Measurement) -> str:
    errors, held = {BAR: [0.0], FRAME: [0.0]}, 0
    for bar, frame in SHIFTS:
        shifted = replace(
            measurement,
            bar_pose=_shifted(measurement, "bar_pose", bar),
            frame_pose=_shifted(measurement, "frame_pose", frame),
        )
        put_in = {BAR: bar, FRAME: frame}
        for delay in find_delays(Timeline(shifted), shifted.machine):
            true, (low, high) = put_in[delay.topic], delay.interval
            errors[delay.topic].append(1e3 * abs(delay.seconds - true))
            held += low <= true <= high
    most = " / ".join(f"{max(errors[topic]):.2f}" for topic in (BAR, FRAME))
    return f"| {case.title}, {case.about} | {most} ms | {held} of {2 * len(SHIFTS)} |"


def _shifted(measurement: Measurement, name: str, seconds: float) -> object:
    return getattr(measurement, name).shifted(seconds)


def _delay_table(rows: Iterable[str]) -> str:
    head = ["| recording | largest error, bar / frame | intervals that hold |", "|---|---|---|"]
    return "\n".join([*head, *rows])


def _floor_table(found: dict[str, dict[str, str]]) -> str:
    head = [f"| | {' | '.join(found)} |", "|---" * (1 + len(found)) + "|"]
    rows = [
        f"| {title} | {' | '.join(texts[title] for texts in found.values())} |"
        for _, _, title in ROWS
    ]
    return "\n".join([*head, *rows])


if __name__ == "__main__":
    main()
