"""Whether a run that `cspm run` made is steady, judged by its recording alone."""

from __future__ import annotations

import io
import json
from collections.abc import Iterator, Mapping
from contextlib import redirect_stderr
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

import cspm
from cspm.commands.run_command import run_command
from cspm_msgs_py.errors import InputError
from cspm_run.output.console import VOICE, Voice

Array = NDArray[np.float64]

# Of the machine's size, and in rad.
WILD_SHARE, WILD_ANGLE = 0.03, 0.1
# Tensions faster than this [Hz] are none of the reference, which takes seconds.
FAST = 2.0
# Their root mean square over the mean tension of all cables that is no tremble, that shakes the
# machine, and by what the last quarter of a run exceeds its second where they grow.
TREMBLE, SHAKES, GROWS = 0.02, 0.1, 2.0
# Of the polynomial that is taken out before, enough for two turns.
SLOW_DEGREE = 16
# Of the time.
NOTED = 0.01


class Judged(NamedTuple):
    """A run as its recording shows it, beside what the command said.

    Attributes:
        said: by warnings, and by the error with which the run ended.
        unsteady: what is not steady, in words.
        largest: error, with its DOF.
    """

    said: tuple[str, ...]
    unsteady: tuple[str, ...]
    largest: str


def judged_run(scenario: Path, folder: Path, size: float) -> Judged:
    """Run a scenario's file by `cspm run`, without an option, and judge what came of it.

    Args:
        scenario: the file.
        folder: a new one, for the recording.
        size: of the machine [m].

    Raises:
        InputError: the command refuses the scenario.
        CspmError: the bar cannot hang where it starts.
    """
    VOICE.set(Voice.NOWHERE)
    said: list[str] = []
    with redirect_stderr(io.StringIO()) as before:
        try:
            run_command(scenario, (), folder, None)
        except InputError:
            raise
        except cspm.CspmError as error:
            if not (folder / "summary.json").exists():
                raise
            said.append(str(error))
    summary = json.loads((folder / "summary.json").read_text(encoding="utf-8"))
    said += [*before.getvalue().splitlines(), *summary["warnings"]]
    tension = cspm.open(folder).tension
    found = (*_limits(summary, size), *moving(tension.time, tension.values))
    return Judged(tuple(dict.fromkeys(said)), found, _largest(summary))


def is_wild(summary: Mapping[str, Any], size: float) -> bool:
    """Return whether a run erred by more than is usual, from its summary and a size [m]."""
    return any(
        summary["errors"][dof]["max"]
        > (WILD_SHARE * size if dof in ("surge", "sway", "heave") else WILD_ANGLE)
        for dof in summary["controlled"]
    )


def _limits(summary: Mapping[str, Any], size: float) -> Iterator[str]:
    if is_wild(summary, size):
        yield f"errs: {_largest(summary)}"
    if summary["slack_share"] > NOTED:
        yield f"a cable slack {summary['slack_share']:.1%} of the time"
    if summary["infeasible_share"] > NOTED:
        yield f"wrench unmet {summary['infeasible_share']:.1%} of the time"


def moving(time: Array, tensions: Array) -> Iterator[str]:
    """Yield how tensions (k, n) [N], at times (k,) [s], move faster than any reference does."""
    if len(time) < 8:
        return
    kept = tremble(tensions, float(np.median(np.diff(time))))
    quarters = [np.sqrt(np.mean(part**2, axis=0)) for part in np.array_split(kept, 4)]
    second, last = quarters[1] / tensions.mean(), quarters[3] / tensions.mean()
    if (last > SHAKES).any():
        yield f"tensions shake by {last.max():.0%} of the mean"
    if ((last > TREMBLE) & (last > GROWS * second)).any():
        yield f"a motion grows, by {np.max(last / second):.2g} times in half the run"


def tremble(values: Array, period: float) -> Array:
    """Return what of values (k, n) is faster than `FAST`, by a window in frequency.

    Args:
        values: (k, n), an even count of instants.
        period: from one to the next [s].
    """
    count = len(values)
    # Without its slow part, or what differs from end to end would ring at both.
    fit = np.polynomial.chebyshev.chebvander(np.linspace(-1.0, 1.0, count), SLOW_DEGREE)
    level = values - fit @ np.linalg.lstsq(fit, values, rcond=None)[0]
    spectrum = np.fft.rfft(level, axis=0)
    spectrum[np.fft.rfftfreq(count, period) < FAST] = 0.0
    return np.fft.irfft(spectrum, count, axis=0)


def _largest(summary: Mapping[str, Any]) -> str:
    worst = max(summary["controlled"], key=lambda dof: float(summary["errors"][dof]["max"]))
    return f"{worst} {summary['errors'][worst]['max']:.3g}"
