"""The tables of results/steep-sea.md, each from what was found, by name."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from bench.accuracy.tension_distribution import HEADINGS, MET, P99, RESIDUAL
from bench.markdown import markdown_table
from cspm_msgs_py.control_spec.distribution import TensionDistribution
from cspm_msgs_py.dofs import DOFS

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
PAST_FIGURES = {
    "within_feasible": "within ± 2 mm, ± 4 mrad, of the time in which tensions ≥ 0 exist",
    "available": "that time",
    "least": "least tension [N]",
    "slack": "any slack",
    "not_met": "wrench infeasible",
}
PAST_FORMATS = {
    "within_feasible": "{:.2%}",
    "available": "{:.1%}",
    "least": "{:.2f}",
    "slack": "{:.3%}",
    "not_met": "{:.1%}",
}
Found = Mapping[str, Any]


def thesis_block(found: Found) -> str:
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
        parts.append(f"**{name}**, {_rest(ours)}\n\n{markdown_table(heads, rows)}")
    deep = found["worst case, 4 m"]
    end = f"ends at {deep['duration']:.1f} s: {deep['failure']}" if deep["failure"] else "holds"
    parts.append(f"With the target 4 m below the frame the run {end}.")
    return "\n\n".join(parts)


def _number(value: float | None) -> str:
    return "lost" if value is None else f"{value:.3g}"


def _rest(found: Mapping[str, Any]) -> str:
    low, high = found["tensions"]
    return (
        f"{found['duration']:.0f} s, tensions {low:.2f} to {high:.1f} N, commanded wrench"
        f" infeasible {found['not_met']:.1%} of the time"
    )


def tracking_block(found: Found) -> str:
    """Return a row per run."""
    heads = [
        "",
        "time [s]",
        "RMS surge, sway, heave [mm]",
        "roll, pitch, yaw [mrad]",
        "within ± 2 mm, ± 4 mrad",
    ]
    heads += ["least tension [N]", "any slack", "wrench infeasible", ""]
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
    return markdown_table(heads, rows)


def extremes_block(found: Found) -> str:
    """Return a row per run, with the largest errors."""
    heads = [
        "",
        "RMS surge, sway, heave [mm]",
        "pitch, yaw [mrad]",
        "largest surge, sway, heave [mm]",
        "pitch, yaw [mrad]",
        "least tension [N]",
        "any slack",
        "",
    ]
    rows = []
    for name, each in found.items():
        rms, largest = ([1e3 * value for value in each[kind]] for kind in ("rms", "largest"))
        rows.append(
            [
                name,
                *(part for e in (rms, largest) for part in (_listed(e[:3]), _listed(e[4:]))),
                f"{each['tensions'][0]:.2f}",
                f"{each['slack']:.2%}",
                "ends there" if each["failure"] else "",
            ]
        )
    return markdown_table(heads, rows)


def past_block(found: Found) -> str:
    """Return the worst case past the thesis per seed, with one motion capture, and the reach."""
    return _seeds_block(found, "pitch, yaw [mrad]", slice(4, 6))


def past_six_block(found: Found) -> str:
    """Return the same with all six coordinates controlled."""
    return _seeds_block(found, "roll, pitch, yaw [mrad]", slice(3, 6))


def _seeds_block(found: Found, angles_said: str, angles: slice) -> str:
    heads = ["", "RMS surge, sway, heave [mm]", angles_said, *PAST_FIGURES.values()]
    rows = []
    for name, each in found.items():
        rms = [1e3 * value for value in each["rms"]]
        figures = [PAST_FORMATS[key].format(each[key]) for key in PAST_FIGURES]
        rows.append([name, _listed(rms[:3]), _listed(rms[angles]), *figures])
    rows.append(["to reach", "≤ 2 each", "≤ 4 each", "≥ 99%", "", "> 0", "0%", ""])
    rms = 1e3 * np.array([each["rms"] for each in found.values()])
    reached = (rms[:, :3] <= 2.0).all(axis=1) & (rms[:, angles] <= 4.0).all(axis=1)
    within = sum(each["within_feasible"] >= 0.99 for each in found.values())
    taut = sum(each["slack"] == 0.0 for each in found.values())
    failed = [name for name, each in found.items() if each["failure"]]
    said = (
        f"Of {len(found)} seeds {reached.sum()} reach every RMS, {within} the 99 % of the time in"
        f" which tensions ≥ 0 exist, {taut} have no cable slack at any instant. Runs that ended"
        f" early: {', '.join(failed) if failed else 'none'}."
    )
    return f"{markdown_table(heads, rows)}\n\n{said}"


def calm_block(found: Found) -> str:
    """Return a row per motion capture with the worst of all seeds of the calm sea, and the reach.

    Names are of motion capture and seed, with a comma between.
    """
    heads = ["motion capture", "seeds", "RMS surge, sway, heave [mm]", "pitch, yaw [mrad]"]
    heads += ["largest surge, sway, heave [mm]", "pitch, yaw [mrad]"]
    heads += ["within ± 0.2 mm, ± 0.4 mrad", "least tension [N]", "any slack", "ended early"]
    rows = []
    for profile in dict.fromkeys(name.partition(", ")[0] for name in found):
        runs = [each for name, each in found.items() if name.partition(", ")[0] == profile]
        rms, largest = (
            1e3 * np.max([each[kind] for each in runs], axis=0) for kind in ("rms", "largest")
        )
        rows.append(
            [
                profile,
                str(len(runs)),
                *(_listed(part) for each in (rms, largest) for part in (each[:3], each[4:])),
                f"{min(each['within'] for each in runs):.2%}",
                f"{min(each['tensions'][0] for each in runs):.2f}",
                f"{max(each['slack'] for each in runs):.3%}",
                str(sum(bool(each["failure"]) for each in runs)),
            ]
        )
    rows.append(["to reach", "", "≤ 0.2 each", "≤ 0.4 each", "", "", "≥ 99%", "> 0", "0%", "0"])
    return markdown_table(heads, rows)


def _listed(values: Sequence[float]) -> str:
    return ", ".join(f"{value:.2f}" for value in values)


def errors_block(found: Found) -> str:
    """Return a row of six errors [m, rad] per name."""
    rows = [
        [name, _listed([1e3 * v for v in rms[:3]]), _listed([1e3 * v for v in rms[3:]])]
        for name, rms in found.items()
    ]
    return markdown_table(["", "surge, sway, heave [mm]", "roll, pitch, yaw [mrad]"], rows)


def distribution_block(rows: Sequence[Sequence[str]]) -> str:
    """Return the methods' table, and what the default reaches."""
    usual = TensionDistribution().method
    own = dict(zip(HEADINGS, next(row for row in rows if row[0] == f"`{usual}`"), strict=True))
    said = (
        f"The default, `{usual}`: {own[MET]} of the feasible set (to reach: 100 %), residual"
        f" {own[RESIDUAL]} of the demand (≤ 1e-6), p99 {own[P99]} µs (< 100 µs)."
    )
    return f"{markdown_table(HEADINGS, rows)}\n\n{said}"


def shares_block(found: Found) -> str:
    """Return a share per name."""
    return markdown_table(["", "share"], [[name, f"{share:.2%}"] for name, share in found.items()])


def limit_block(found: Found) -> str:
    """Return the share of time in which any tension set exists, by scenario and lower limit."""
    rows = [
        [name, *(f"{(np.array(least) >= limit).mean():.1%}" for limit in LIMITS)]
        for name, least in found.items()
    ]
    return markdown_table(["", *(f"t_min = {limit:g} N" for limit in LIMITS)], rows)
