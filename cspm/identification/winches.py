"""Identifying winches: inertia and friction."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from functools import partial
from pathlib import Path

from cspm.identification.identified import Identification, estimates, source_of
from cspm.measured import looked_at
from cspm.parameters import Parameters
from cspm.progress import Progress, by_steps, shows_progress, silent
from cspm.recorded import AnyRecording
from cspm.testbed import AnyTestbed
from cspm_ident.data_look.data_check import DataCheck
from cspm_ident.winch.fitted_file import fitted_testbed
from cspm_ident.winch.identified_winch import WinchesResult
from cspm_ident.winch.identify_winches import BAND_HZ, EFFECTS, identify_winches
from cspm_msgs_py.testbed import TestbedFile


@shows_progress("reading")
def identify_winch(
    recordings: AnyRecording | Iterable[AnyRecording],
    *,
    held_out: AnyRecording | Iterable[AnyRecording] = (),
    testbed: AnyTestbed | None = None,
    winches: Sequence[str] = (),
    effects: Sequence[str] = (),
    torque_age: float | None = None,
    reversals: bool | None = None,
    band: float | None = None,
    leave_out_regimes: bool = False,
    progress: Progress = silent,
) -> Identification[WinchesResult]:
    """Identify inertia and friction of winches: `cspm identify winch`.

    Each winch by itself from its own angle, torque and tension, in weak form.

    Args:
        recordings: to fit, all of one machine.
        held_out: which judge without being fitted.
        testbed: the machine, instead of the one that the recordings carry.
        winches: names of their cables; none for all.
        effects: ids of what to fit beside the inertia; none for viscous friction, Coulomb friction
            and an offset.
        torque_age: how long before its stamp a reported torque acted [s]; None: half a period of a
            simulated drive, else 0, unless the motion clearly says another.
        reversals: whether windows count in which the shaft reverses; None: only where a parameter
            cannot be identified without them.
        band: torque errors are counted below this frequency [Hz]; None for 40 Hz.
        leave_out_regimes: whether to leave out the stretches that obey another equation than the
            rest of their recording.
        progress: called now and then with an estimate of the share and what is being done;
            none: a bar in a terminal, lines in a notebook.

    Raises:
        InputError: naming what is wrong in recordings, test-bed or arguments.

    Examples:
        >>> import cspm
        >>> found = cspm.identify_winch("one_winch_30")  # doctest: +SKIP
        >>> found.parameters["inertia"].ci95  # doctest: +SKIP
        (3.9e-05, 4.1e-05)
    """
    searched, judged, checks = looked_at(
        recordings, held_out, testbed, leave_out_regimes=leave_out_regimes
    )
    age = searched[0].torque_age if torque_age is None else torque_age
    result = identify_winches(
        searched,
        winches,
        effects or EFFECTS,
        held_out=judged,
        torque_age=age,
        lateness=torque_age is None,
        reversals=reversals,
        band=BAND_HZ if band is None else band,
        progress=by_steps(progress),
    )
    source = source_of(testbed, searched[0].path)
    return _identification(result, searched[0].testbed, source, checks)


def _identification(
    result: WinchesResult, file: TestbedFile, source: str, checks: tuple[DataCheck, ...]
) -> Identification[WinchesResult]:
    return Identification(
        result,
        Parameters(p for w in result.winches for p in estimates(w.fit.estimate, w.name, w.valid)),
        lambda: fitted_testbed(result, file, source),
        partial(_draw, result),
        data_checks=checks,
        objections=result.objections,
    )


def _draw(result: WinchesResult, folder: Path) -> dict[str, str]:
    from cspm.plots.winch_figure import draw_winch

    written = {}
    for winch in result.winches:
        picture = folder / f"winch_{winch.name}.png"
        draw_winch(picture, winch)
        written[f"winch_{winch.name}"] = str(picture)
    return written
