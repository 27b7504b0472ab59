"""The tables of docs/results.md, each from the runs behind it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from bench.markdown import markdown_table
from bench.results.outcome import GROUPS, Outcome
from bench.results.result_tables import THESIS_TABLES
from cspm_msgs_py.dofs import DOFS

Array = NDArray[np.float64]

# Section 8: ± 2 mm and ± 4 mrad, here in the units of the thesis's tables (mm, rad).
REQUIRED_MM, REQUIRED_RAD = 2.0, 0.004
TRANSLATIONS, ROTATIONS = slice(0, 3), slice(4, 6)  # the roll is not controlled
# The conclusions' factors, as printed.
PRINTED = ("12.65", "259.74", "4.2882", "1.0526")


def once_block(found: Mapping[str, Outcome]) -> str:
    """Return table 8-1 beside ours."""
    largest, rms = THESIS_TABLES["calm"]
    rows = []
    for i, dof in enumerate(DOFS):
        ours = [f"{1e3 * o.rms[i]:.3g}, {1e3 * o.largest[i]:.3g}" for o in found.values()]
        scale = 1.0 if i < 3 else 1e3
        thesis = f"{scale * (rms[i] or 0.0):.3g}, {scale * (largest[i] or 0.0):.3g}"
        rows.append([f"{dof} [{_unit(i)}]", thesis, *ours])
    low = [", ".join(f"{100 * v:.2g} %" for v in o.low.values()) for o in found.values()]
    rows.append([f"time at 2 N: {', '.join(GROUPS)}", "surge only, once", *low])
    return markdown_table(["RMS, largest", "thesis", *found], rows)


def spread_block(found: Sequence[Outcome]) -> str:
    """Return the RMS errors of table 8-2 beside the spread of ours over seeds."""
    return _spread(found, "RMS", THESIS_TABLES["worst case"][1], [each.rms for each in found])


def largest_block(found: Sequence[Outcome]) -> str:
    """Return the largest errors of table 8-2 beside the spread of ours over seeds."""
    ours = [each.largest for each in found]
    return _spread(found, "largest", THESIS_TABLES["worst case"][0], ours)


def _spread(
    found: Sequence[Outcome], kind: str, thesis: Sequence[float | None], values: Sequence[Array]
) -> str:
    ours = 1e3 * np.array(values)
    rows = []
    for i, dof in enumerate(DOFS):
        low, high = np.percentile(ours[:, i], [5, 95])
        middle = float(np.exp(np.log(ours[:, i]).mean()))
        published, below = thesis[i], "–"
        if published is not None:
            published *= 1.0 if i < 3 else 1e3
            below = f"{int((ours[:, i] < published).sum())} of {len(found)}"
        said = "lost" if published is None else f"{published:.3g}"
        rows.append(
            [f"{dof} [{_unit(i)}]", said, f"{middle:.3g}", f"{low:.3g} to {high:.3g}", below]
        )
    heads = ["thesis", "ours, geometric mean", "5 to 95 % of seeds", "seeds below the thesis"]
    return markdown_table([kind, *heads], rows)


def factor_block(calm: Outcome, worst: Sequence[Outcome]) -> str:
    """Return the factors of the conclusions: printed, from the thesis's tables, and ours."""
    ours = [
        f"{_room(calm, TRANSLATIONS):.4g}",
        f"{_room(calm, ROTATIONS):.4g}",
        _over_seeds([1.0 / _room(each, TRANSLATIONS) for each in worst]),
        _over_seeds([_room(each, ROTATIONS) for each in worst]),
    ]
    said = [
        "calm, translations: required / largest RMS",
        "calm, rotations: required / largest RMS",
        "worst case, translations: largest RMS / required",
        "worst case, rotations: required / largest RMS",
    ]
    rows = zip(said, PRINTED, (f"{each:.4g}" for each in published_factors()), ours, strict=True)
    return markdown_table(["factor", "thesis, printed", "from its tables", "ours"], list(rows))


def published_factors() -> tuple[float, float, float, float]:
    """Return the conclusions' four factors from the RMS errors of tables 8-1 and 8-2."""
    calm, worst = (np.array(THESIS_TABLES[name][1], dtype=float) for name in ("calm", "worst case"))
    return (
        REQUIRED_MM / float(calm[TRANSLATIONS].max()),
        REQUIRED_RAD / float(calm[ROTATIONS].max()),
        float(worst[TRANSLATIONS].max()) / REQUIRED_MM,
        REQUIRED_RAD / float(worst[ROTATIONS].max()),
    )


def _room(found: Outcome, which: slice) -> float:
    """Return how many times the largest RMS error fits into what is required."""
    required = 1e-3 * REQUIRED_MM if which == TRANSLATIONS else REQUIRED_RAD
    return required / float(found.rms[which].max())


def _over_seeds(values: Sequence[float]) -> str:
    low, middle, high = np.percentile(values, [5, 50, 95])
    return f"{middle:.3g} ({low:.3g} to {high:.3g})"


def hoist_block(found: Mapping[str, Sequence[Outcome]]) -> str:
    """Return the least tensions with hoist force loops of less and less bandwidth."""
    rows = []
    for name, outcomes in found.items():
        least = [np.array([o.least_of[group] for o in outcomes]) for group in GROUPS]
        below = sum(bool(o.least_of["hoist"] < 1.0) for o in outcomes)
        first = next(o for o in outcomes if o.seed == 1)
        rows.append(
            [
                name,
                ", ".join(f"{first.least_of[group]:.2f}" for group in GROUPS),
                *(f"{each.min():.2f}" for each in least),
                f"{below} of {len(outcomes)}",
            ]
        )
    heads = ["hoist loops", f"seed 1: {', '.join(GROUPS)} [N]"]
    heads += [f"least {group} [N]" for group in GROUPS]
    return markdown_table([*heads, "seeds with a hoist below 1 N"], rows)


def deep_block(found: Sequence[Outcome]) -> str:
    """Return when the bar turns over with the target at 4 m, over seeds."""
    ends = sorted(each.duration for each in found if each.failure)
    spread = ", ".join(f"{end:.1f}" for end in np.percentile(ends, [0, 50, 100]))
    rows = [
        ["seeds whose bar turns over", f"{len(ends)} of {len(found)}"],
        ["seed 1 [s]", f"{next(o for o in found if o.seed == 1).duration:.1f}"],
        ["first, median, last [s]", spread],
        ["within 40 s", f"{sum(end <= 40.0 for end in ends)} of {len(found)}"],
    ]
    return markdown_table(["at 4 m", "worst case"], rows)


def past_block(found: Mapping[str, Sequence[Outcome]], six: str) -> str:
    """Return how the controllers past the thesis do over seeds; `six` is of all coordinates."""
    rows = []
    for name, outcomes in found.items():
        shares = [o.within_six if name == six else o.within for o in outcomes]
        worst = 1e3 * np.array([o.rms for o in outcomes])[:, :3].max()
        rows.append(
            [
                name,
                f"{worst:.3g} mm",
                f"{sum(share >= 0.99 for share in shares)} of {len(shares)}",
                f"{100 * min(shares):.1f} %",
                f"{min(o.least for o in outcomes):.2f} N",
            ]
        )
    heads = ["", "largest RMS", "seeds within 99 % of the time", "worst seed", "least tension"]
    return markdown_table(heads, rows)


def _unit(i: int) -> str:
    return "mm" if i < 3 else "mrad"
