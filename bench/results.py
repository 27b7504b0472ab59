"""The numbers and pictures of docs/results.md: `python -m bench.results`, or `make results`.

With --keep DIR what was measured stays there, and a later call measures only what is missing.
"""

from __future__ import annotations

import argparse
import json
import re
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from rich.console import Console

from bench.feasibility import least_errors, least_tensions
from bench.machine import describe_machine
from bench.result_cases import (
    BEYOND,
    CAUSES,
    CORNERS,
    LIMITED,
    PAST,
    PROFILES,
    SWITCHED,
    SWITCHED_4M,
    SWITCHED_CALM,
    SWITCHED_GAINS,
    THESIS,
    changed,
    corrected,
    seeded,
)
from bench.result_figures import bands, draw_comparison, draw_limit
from bench.tension_distribution import HEADINGS, distribution_rows
from bench.tracking import Case, follow, track, within_requirement
from cspm_msgs_py.dofs import DOFS

ROOT = Path(__file__).resolve().parents[1]
PAGE = ROOT / "docs" / "results.md"
FIGURES = ROOT / "docs" / "figures"
BLOCK = re.compile(r"<!-- results: (\w+) -->\n.*?<!-- end -->", re.DOTALL)
# Tables 8-1 and 8-2: largest and RMS error in mm and rad; None where the text is lost.
THESIS_TABLES: dict[str, tuple[tuple[float | None, ...], tuple[float | None, ...]]] = {
    "calm": (
        (1.414, 0.06335, 0.397, 0.0682, 3.14e-5, 4.822e-5),
        (0.158, 0.020845, 0.0535, 0.022815, 4.323e-6, 1.54e-5),
    ),
    "worst case": (
        (None, None, None, 0.645, 0.0804, 0.0814),
        (8.58, 0.74, 5.73, 0.02545, 0.00306, 0.0038),
    ),
}
LIMITS = (0.0, 0.3, 1.0, 2.0)
LIMIT_PERIOD = 0.2
POSSIBLE = ("worst case", "worst case, all six coordinates", "worst case, 4 m")
ROBUST_S = 20.0
PICTURES = "pictures"

Measure = Callable[[], Any]


class Store:
    """What was measured, by name, in a folder that may already hold some of it."""

    def __init__(self, folder: Path | None, console: Console) -> None:
        self._folder, self._console = folder, console
        if folder:
            folder.mkdir(parents=True, exist_ok=True)

    def get(self, name: str, measure: Measure) -> Any:
        """Return what is there by this name, or measure it."""
        signed = name.replace("+", "plus ").replace("−", "minus ")
        file = re.sub(r"\W+", "_", signed) + ".json"
        place = self._folder / file if self._folder else None
        if place and place.exists():
            return json.loads(place.read_text(encoding="utf-8"))
        self._console.print(name)
        found = measure()
        if place:
            place.write_text(json.dumps(found), encoding="utf-8")
        return found

    def tracks(self, group: str, cases: Mapping[str, Case]) -> dict[str, dict[str, Any]]:
        """Return the tracking of each case."""
        return {
            name: self.get(f"{group} {name}", lambda case=case: track(case).data())
            for name, case in cases.items()
        }


def main() -> None:
    """Run the command line."""
    parser = argparse.ArgumentParser(prog="python -m bench.results", description=__doc__)
    parser.add_argument("--seeds", type=int, default=20, help="of the worst case past the thesis")
    parser.add_argument("--keep", type=Path, metavar="DIR", help="for what was measured")
    parser.add_argument("--only", nargs="+", default=[], metavar="BLOCK", help="renew only these")
    asked = parser.parse_args()
    store, seeds = Store(asked.keep, Console()), asked.seeds
    blocks: dict[str, Callable[[], str]] = {
        "machine": lambda: _machine_block(seeds),
        "thesis": lambda: thesis_block(store.tracks("thesis", THESIS)),
        "switched": lambda: tracking_block(store.tracks("switched", SWITCHED)),
        "switched_gains": lambda: tracking_block(store.tracks("switched gains", SWITCHED_GAINS)),
        "switched_calm": lambda: tracking_block(store.tracks("switched calm", SWITCHED_CALM)),
        "switched_4m": lambda: tracking_block(store.tracks("switched 4 m", SWITCHED_4M)),
        "distribution": lambda: table(
            HEADINGS, store.get("distribution", lambda: distribution_rows(20000, 60.0))
        ),
        "past": lambda: past_block(store, "1000 Hz", seeds),
        "past_100": lambda: past_block(store, "100 Hz", seeds),
        "causes": lambda: tracking_block(store.tracks("causes", CAUSES)),
        "beyond": lambda: tracking_block(store.tracks("beyond", BEYOND)),
        "corners": lambda: tracking_block(store.tracks("corners", CORNERS)),
        "limit": lambda: limit_block(store),
        "possible": lambda: possible_block(store),
        "robust": lambda: tracking_block(store.tracks("robust", changed(PAST, ROBUST_S))),
        "corrected": lambda: tracking_block(store.tracks("corrected", corrected(ROBUST_S))),
        "robust_thesis": lambda: tracking_block(
            store.tracks("robust thesis", changed("worst_case", ROBUST_S))
        ),
    }
    chosen = asked.only or [*blocks, PICTURES]
    unknown = [name for name in chosen if name not in (*blocks, PICTURES)]
    if unknown:
        parser.error(f"--only: {', '.join(unknown)}, allowed: {', '.join(blocks)}, {PICTURES}")
    for name, block in blocks.items():
        if name in chosen:
            _into_page(name, block())
    if PICTURES in chosen:
        _draw(store)


def _draw(store: Store) -> None:
    drawn = {
        "the thesis's controllers": store.get("bands thesis", lambda: bands(Case("worst_case"))),
        "past the thesis": store.get("bands past", lambda: bands(Case(PAST))),
    }
    draw_comparison(FIGURES / "past_thesis.png", drawn)
    least = np.array(_least(store, "worst case", LIMITED["worst case"]))
    draw_limit(FIGURES / "tension_limit.png", least, LIMIT_PERIOD, drawn["past the thesis"])


def _machine_block(seeds: int) -> str:
    machine = describe_machine()
    return (
        f"Measured {machine['date']}, {machine['processor']}, {machine['software']}; {seeds} seeds."
    )


def thesis_block(found: Mapping[str, Mapping[str, Any]]) -> str:
    """Return tables 8-1 and 8-2, the thesis's figures beside ours."""
    parts = []
    for name, (largest, rms) in THESIS_TABLES.items():
        ours = found[name]
        rows = []
        for i, dof in enumerate(DOFS):
            unit = 1e3 if i < 3 else 1.0
            values = largest[i], ours["largest"][i] * unit, rms[i], ours["rms"][i] * unit
            rows.append([f"{dof} [{'mm' if i < 3 else 'rad'}]", *(_number(v) for v in values)])
        heads = ["", "largest: thesis", "ours", "RMS: thesis", "ours"]
        parts.append(f"**{name}**, {_rest(ours)}\n\n{table(heads, rows)}")
    deep = found["worst case, 4 m"]
    end = f"ends at {deep['duration']:.1f} s: {deep['failure']}" if deep["failure"] else "holds"
    parts.append(f"With the target 4 m below the frame the run {end}.")
    return "\n\n".join(parts)


def _number(value: float | None) -> str:
    return "lost" if value is None else f"{value:.3g}"


def _rest(found: Mapping[str, Any]) -> str:
    low, high = found["tensions"]
    return (
        f"{found['duration']:.0f} s, tensions {low:.2f} to {high:.1f} N, wanted wrench not met"
        f" {found['not_met']:.1%} of the time"
    )


def tracking_block(found: Mapping[str, Mapping[str, Any]]) -> str:
    """Return a row per run."""
    heads = [
        "",
        "time [s]",
        "RMS surge, sway, heave [mm]",
        "roll, pitch, yaw [mrad]",
        "within ± 2 mm, ± 4 mrad",
    ]
    heads += ["least tension [N]", "any slack", "wrench not met", ""]
    rows = []
    for name, each in found.items():
        rms = [1e3 * value for value in each["rms"]]
        rows.append(
            [
                name,
                f"{each['duration']:.0f}",
                ", ".join(f"{value:.2f}" for value in rms[:3]),
                ", ".join(f"{value:.2f}" for value in rms[3:]),
                f"{each['within']:.1%}",
                f"{each['tensions'][0]:.2f}",
                f"{each['slack']:.2%}",
                f"{each['not_met']:.1%}",
                "ends there" if each["failure"] else "",
            ]
        )
    return table(heads, rows)


def past_block(store: Store, profile: str, seeds: int) -> str:
    """Return the worst case past the thesis per seed, with one motion capture, and the reach."""
    found = {
        name: store.get(
            f"past {profile} {name}",
            lambda name=name, case=case: _past(case, np.array(_least(store, name, case))),
        )
        for name, case in seeded(seeds, PROFILES[profile]).items()
    }
    heads = ["", "RMS surge, sway, heave [mm]", "pitch, yaw [mrad]", *PAST_FIGURES.values()]
    rows = []
    for name, each in found.items():
        rms = [1e3 * value for value in each["rms"]]
        figures = [PAST_FORMATS[key].format(each[key]) for key in PAST_FIGURES]
        rows.append([name, _listed(rms[:3]), _listed(rms[4:]), *figures])
    rows.append(["to reach", "≤ 2 each", "≤ 4 each", "≥ 99%", "", "> 0", "0%", ""])
    rms = 1e3 * np.array([each["rms"] for each in found.values()])
    reached = (rms[:, [0, 1, 2]] <= 2.0).all(axis=1) & (rms[:, [4, 5]] <= 4.0).all(axis=1)
    within = sum(each["within_feasible"] >= 0.99 for each in found.values())
    taut = sum(each["slack"] == 0.0 for each in found.values())
    failed = [name for name, each in found.items() if each["failure"]]
    said = (
        f"Of {seeds} seeds {reached.sum()} reach every RMS, {within} the 99 % of the time in which"
        f" tensions ≥ 0 exist, {taut} have no cable slack at any instant. Runs that ended early:"
        f" {', '.join(failed) if failed else 'none'}."
    )
    return f"{table(heads, rows)}\n\n{said}"


def _listed(values: Sequence[float]) -> str:
    return ", ".join(f"{value:.2f}" for value in values)


PAST_FIGURES = {
    "within_feasible": "within ± 2 mm, ± 4 mrad, of the time in which tensions ≥ 0 exist",
    "available": "that time",
    "least": "least tension [N]",
    "slack": "any slack",
    "not_met": "wrench not met",
}
PAST_FORMATS = {
    "within_feasible": "{:.2%}",
    "available": "{:.1%}",
    "least": "{:.2f}",
    "slack": "{:.3%}",
    "not_met": "{:.1%}",
}


def possible_block(store: Store) -> str:
    """Return the least error that any controller could have, by scenario."""
    rows = []
    for name in POSSIBLE:
        case = LIMITED[name]
        rms = store.get(f"possible {name}", lambda case=case: least_errors(case.bundle()).tolist())
        rows.append(
            [name, _listed([1e3 * v for v in rms[:3]]), _listed([1e3 * v for v in rms[3:]])]
        )
    return table(["", "surge, sway, heave [mm]", "roll, pitch, yaw [mrad]"], rows)


def _past(case: Case, least: NDArray[np.float64]) -> dict[str, Any]:
    bundle = case.bundle()
    errors, tensions, missed, failure = follow(bundle)
    stride = round(LIMIT_PERIOD * bundle.scenario.rates.plant)
    sampled = within_requirement(bundle, errors)[::stride]
    least = least[: len(sampled)]
    return {
        "rms": np.sqrt((errors**2).mean(axis=0)).tolist(),
        "within_feasible": float(sampled[least >= 0.0].mean()),
        "available": float((least >= 0.0).mean()),
        "least": float(tensions.min()),
        "slack": float((tensions <= 0.0).any(axis=1).mean()),
        "not_met": float(missed.mean()),
        "failure": failure,
    }


def limit_block(store: Store) -> str:
    """Return the share of time in which any tension set exists, by scenario and lower limit."""
    rows = []
    for name, case in LIMITED.items():
        least = np.array(_least(store, name, case))
        rows.append([name, *(f"{(least >= limit).mean():.1%}" for limit in LIMITS)])
    return table(["", *(f"t_min = {limit:g} N" for limit in LIMITS)], rows)


def _limit_times(case: Case) -> NDArray[np.float64]:
    return np.arange(0.0, case.bundle().scenario.duration, LIMIT_PERIOD)


def _least(store: Store, name: str, case: Case) -> list[float]:
    def measure() -> list[float]:
        # JSON knows no infinity.
        least = np.maximum(least_tensions(case.bundle(), _limit_times(case)), -1e9)
        return [float(value) for value in least]

    return [float(value) for value in store.get(f"limit {name}", measure)]


def table(heads: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """Return a table in Markdown."""
    lines = [heads, ["---"] * len(heads), *rows]
    return "\n".join(f"| {' | '.join(line)} |" for line in lines)


def _into_page(name: str, block: str) -> None:
    page = PAGE.read_text(encoding="utf-8")

    def renewed(match: re.Match[str]) -> str:
        is_meant = match[1] == name
        return f"<!-- results: {name} -->\n{block}\n<!-- end -->" if is_meant else match[0]

    PAGE.write_text(BLOCK.sub(renewed, page), encoding="utf-8")


if __name__ == "__main__":
    main()
