"""Identifying one kind of cable: stiffness and damping."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from functools import partial
from pathlib import Path

from cspm.identification.identified import Identification, estimates
from cspm.measured import listed
from cspm.parameters import Parameter, Parameters
from cspm.recorded import AnyRecording, path_of
from cspm.rig import RigRequest, provenance
from cspm.testbed import AnyTestbed, as_file
from cspm_ident.fitted_testbed import FittedNumber
from cspm_ident.rig.damping import CUTOFF as DAMPING_CUTOFF
from cspm_ident.rig.damping import DampingResult, LinearDamping
from cspm_ident.rig.damping import identify_damping as fit_damping
from cspm_ident.rig.stiffness import CUTOFF as STIFFNESS_CUTOFF
from cspm_ident.rig.stiffness import StiffnessResult
from cspm_ident.rig.stiffness import identify_stiffness as fit_stiffness
from cspm_ident.rig.stiffness_fit import NAMES


def identify_stiffness(
    recordings: AnyRecording | Iterable[AnyRecording],
    *,
    testbed: AnyTestbed | None = None,
    cables: Sequence[str] = (),
    verify: Sequence[str] = (),
    into: AnyTestbed | None = None,
    into_cables: Sequence[str] = (),
    cutoff: float | None = None,
) -> Identification[StiffnessResult]:
    """Identify the stiffness law of one kind of cable: `cspm identify stiffness`.

    From slow ramps at several lengths, stretching and releasing kept apart.

    Args:
        recordings: of machines without bar, each winch pulling a cable that is fixed to a load
            cell: all lengths in one recording, or a recording for each.
        testbed: the machine recorded, instead of what the recordings carry.
        cables: those to use; none for all.
        verify: labels of those that judge without being fitted.
        into: the test-bed that gets the law, instead of the machine recorded.
        into_cables: the cables there that get it; none for those identified.
        cutoff: of the filter without phase [Hz]; None for the usual one.

    Raises:
        InputError: naming what is wrong in recordings, test-bed or arguments.
    """
    request = _rig(recordings, testbed, cables, verify, None, into, into_cables, cutoff)
    return identified_stiffness(request)


def identify_damping(
    recordings: AnyRecording | Iterable[AnyRecording],
    *,
    stiffness: AnyTestbed | None = None,
    testbed: AnyTestbed | None = None,
    cables: Sequence[str] = (),
    verify: Sequence[str] = (),
    into: AnyTestbed | None = None,
    into_cables: Sequence[str] = (),
    cutoff: float | None = None,
) -> Identification[DampingResult]:
    """Identify the damping of one kind of cable: `cspm identify damping`.

    From multi-sines at several lengths, with a stiffness that is known.

    Args:
        recordings: as for `identify_stiffness`.
        stiffness: a test-bed whose stiffness laws to use, such as `identify_stiffness(…).testbed`;
            None: those of the machine recorded.
        testbed: the machine recorded, instead of what the recordings carry.
        cables: those to use; none for all.
        verify: labels of those that judge without being fitted.
        into: the test-bed that gets the damping, instead of `stiffness` or the machine recorded.
        into_cables: the cables there that get it; none for those identified.
        cutoff: of the filter without phase [Hz]; None for the usual one.

    Raises:
        InputError: naming what is wrong in recordings, test-bed or arguments.
    """
    request = _rig(recordings, testbed, cables, verify, stiffness, into, into_cables, cutoff)
    return identified_damping(request)


def identified_stiffness(request: RigRequest) -> Identification[StiffnessResult]:
    """Return the stiffness that is requested; see `identify_stiffness`."""
    result = fit_stiffness(request.specimens(), request.verify, request.cutoff or STIFFNESS_CUTOFF)
    specimens = [one.specimen for one in result.specimens]
    objections = tuple(each.text for each in result.objections)
    return Identification(
        result,
        Parameters(estimates(result.both.estimate, "")),
        lambda: (
            None
            if objections
            else request.fitted(specimens, "stiffness", stiffness_numbers(result))
        ),
        partial(_draw_stiffness, result),
        pictures_first=True,
        objections=objections,
    )


def identified_damping(request: RigRequest) -> Identification[DampingResult]:
    """Return the damping that is requested; see `identify_damping`."""
    result = fit_damping(request.specimens(), request.verify, request.cutoff or DAMPING_CUTOFF)
    law, specimens = result.law, [one.specimen for one in result.specimens]
    objections = tuple(each.text for each in result.objections)
    return Identification(
        result,
        Parameters(_law(law)),
        lambda: (
            None
            if law is None or objections
            else request.fitted(specimens, "damping", damping_numbers(result, law))
        ),
        partial(_draw_damping, result),
        pictures_first=True,
        objections=objections,
    )


def _rig(
    recordings: AnyRecording | Iterable[AnyRecording],
    testbed: AnyTestbed | None,
    cables: Sequence[str],
    verify: Sequence[str],
    stiffness: AnyTestbed | None,
    into: AnyTestbed | None,
    into_cables: Sequence[str],
    cutoff: float | None,
) -> RigRequest:
    files = (None if each is None else as_file(each) for each in (testbed, stiffness, into))
    machine, laws, target = files
    return RigRequest(
        recordings=tuple(map(path_of, listed(recordings))),
        testbed=machine,
        cables=tuple(cables),
        verify=tuple(verify),
        stiffness=laws,
        into=target,
        into_cables=tuple(into_cables),
        cutoff=cutoff,
        out=None,
    )


def _law(law: LinearDamping | None) -> Iterable[Parameter]:
    if law is not None:
        yield Parameter("constant", "", law.constant, "N·s/m", law.constant_interval)
        yield Parameter("slope", "", law.slope, "N·s/m²", law.slope_interval)


def stiffness_numbers(result: StiffnessResult) -> dict[str, FittedNumber | float | str]:
    """Return the block `stiffness` of a test-bed file as far as it was fitted."""
    recordings, windows = provenance([one.specimen for one in result.specimens if one.fitted])
    estimate = result.both.estimate
    found: dict[str, FittedNumber | float | str] = {"law": "exponential"}
    for name in NAMES[:-1]:
        if name in estimate.frozen:
            found[name] = estimate.value(name)
            continue
        interval = estimate.interval(name)
        found[name] = FittedNumber(estimate.value(name), interval, recordings, windows)
    if result.both.asymptote:
        low, high = (end / result.area for end in estimate.interval("rigidity"))
        modulus = estimate.value("rigidity") / result.area
        found["youngs_modulus"] = FittedNumber(
            modulus, (low, high), recordings, windows, "k l/A on the asymptote"
        )
    return found


def damping_numbers(
    result: DampingResult, law: LinearDamping
) -> dict[str, FittedNumber | float | str]:
    """Return the block `damping` of a test-bed file; what was fitted needs no factor."""
    recordings, windows = provenance([one.specimen for one in result.specimens if one.fitted])
    return {
        "law": "linear_in_length",
        "constant": FittedNumber(law.constant, law.constant_interval, recordings, windows),
        "slope": FittedNumber(law.slope, law.slope_interval, recordings, windows),
        "factor": 1.0,
    }


def _draw_stiffness(result: StiffnessResult, folder: Path) -> dict[str, str]:
    from cspm.plots.stiffness_figure import draw_hysteresis, draw_stiffness

    pictures = {"stiffness": folder / "stiffness.png", "hysteresis": folder / "hysteresis.png"}
    draw_stiffness(pictures["stiffness"], result)
    draw_hysteresis(pictures["hysteresis"], result)
    return {name: str(path) for name, path in pictures.items()}


def _draw_damping(result: DampingResult, folder: Path) -> dict[str, str]:
    from cspm.plots.damping_figure import draw_damping

    draw_damping(folder / "damping.png", result)
    return {"damping": str(folder / "damping.png")}
