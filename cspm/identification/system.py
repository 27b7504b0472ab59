"""Identifying a whole machine: bar, cables and damping."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from functools import partial
from pathlib import Path

from cspm.identification.identified import Identification, estimates, source_of
from cspm.measured import looked_at
from cspm.parameters import Parameters
from cspm.progress import Progress, by_steps, shows_progress, silent
from cspm.recorded import AnyRecording
from cspm.testbed import AnyTestbed
from cspm_ident.data_look.data_check import DataCheck
from cspm_ident.estimation import Prior
from cspm_ident.system.choice import Chosen, choose
from cspm_ident.system.fitted_file import fitted_testbed
from cspm_ident.system.identification import HORIZON, SystemResult
from cspm_ident.system.identification import identify_system as fit_system
from cspm_msgs_py.errors import InputError
from cspm_msgs_py.testbed import TestbedFile


@shows_progress("reading")
def identify_system(
    recordings: AnyRecording | Iterable[AnyRecording],
    *,
    held_out: AnyRecording | Iterable[AnyRecording] = (),
    testbed: AnyTestbed | None = None,
    names: Sequence[str] = (),
    frozen: Mapping[str, float | None] | None = None,
    priors: Mapping[str, tuple[float, float]] | None = None,
    bounds: Mapping[str, tuple[float, float]] | None = None,
    profiled: Sequence[str] = (),
    horizon: float | None = None,
    leave_out_regimes: bool = False,
    progress: Progress = silent,
) -> Identification[SystemResult]:
    """Identify bar, cables and damping of a whole machine: `cspm identify system`.

    Windows of each recording are simulated from measured motor angles and the frame's pose, and
    compared with the bar's pose and the tensions.

    Args:
        recordings: to fit, all of one machine.
        held_out: which judge without being fitted.
        testbed: the machine, instead of the one that the recordings carry.
        names: parameters to fit, such as `bar.mass`; none for the usual ones.
        frozen: values that stay, by name; None: the machine's.
        priors: mean and standard deviation of what is known already, by name.
        bounds: lowest and highest value, by name.
        profiled: parameters whose profile likelihood is wanted, which is slow.
        horizon: length of a window [s]; None for 4 s.
        leave_out_regimes: whether to leave out the stretches that obey another equation than the
            rest of their recording.
        progress: called now and then with an estimate of the share and what is being done;
            none: a bar in a terminal, lines in a notebook.

    Raises:
        InputError: naming what is wrong in recordings, test-bed or arguments.
    """
    searched, judged, checks = looked_at(
        recordings, held_out, testbed, leave_out_regimes=leave_out_regimes
    )
    chosen = choose(searched[0].machine, names, frozen or {}, _priors(priors), bounds or {})
    _check_profiled(profiled, chosen)
    result = fit_system(
        searched,
        chosen,
        held_out=judged,
        profiled=profiled,
        horizon=HORIZON if horizon is None else horizon,
        progress=by_steps(progress),
    )
    source = source_of(testbed, searched[0].path)
    return _identification(result, searched[0].testbed, source, checks)


def _identification(
    result: SystemResult, file: TestbedFile, source: str, checks: tuple[DataCheck, ...]
) -> Identification[SystemResult]:
    refused = {name for each in result.objections for name in each.parameters}
    estimate = result.solution.estimate
    valid = [name for name in estimate.names if name not in refused]
    return Identification(
        result,
        Parameters(estimates(estimate, "", valid)),
        lambda: None if refused else fitted_testbed(result, file, source),
        partial(_draw, result),
        data_checks=checks,
        objections=tuple(each.text for each in result.objections),
    )


def _priors(given: Mapping[str, tuple[float, float]] | None) -> dict[str, Prior]:
    return {name: Prior(*each) for name, each in (given or {}).items()}


def _check_profiled(names: Sequence[str], chosen: Sequence[Chosen]) -> None:
    fitted = {each.name for each in chosen if not each.parameter.frozen}
    for name in names:
        if name not in fitted:
            raise InputError(f"--profile {name}: is not fitted, allowed: a name that is")


def _draw(result: SystemResult, folder: Path) -> dict[str, str]:
    from cspm.plots.system_figure import draw_system

    draw_system(folder / "system.png", result.judgements)
    return {"system": str(folder / "system.png")}
