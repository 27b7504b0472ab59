"""What sensors alone leave of a residual: the held-out error of machines that conceal nothing."""

from __future__ import annotations

from collections.abc import Mapping
from statistics import median
from typing import Any

Data = Mapping[str, Any]
# By scenario and channel, in units of the residual's row-to-row noise.
Floors = Mapping[tuple[str, str], float]


def healthy_floors(truth: Data, results: Mapping[str, Data]) -> Floors:
    """Return the median error of each residual of machines as described, by scenario.

    Noise that is alike from row to row, as a sensor's coloured part, is in it.

    Args:
        truth: as the truth file has it.
        results: by recording, with `diagnosis` as `diagnosis.json` has it or None.
    """
    found: dict[tuple[str, str], list[float]] = {}
    for item in truth["items"]:
        diagnosis = results.get(item["name"], {}).get("diagnosis")
        if item["concealed"] or not diagnosis:
            continue
        for residual in diagnosis["residuals"]:
            fit = residual["held_out"]
            if fit["noise_floor"] > 0.0:
                own = found.setdefault((item["scenario"], residual["channel"]), [])
                own.append(fit["nrmse_before"] / fit["noise_floor"])
    return {key: median(errors) for key, errors in found.items()}
