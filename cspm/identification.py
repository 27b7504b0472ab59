"""Identifying parameters from recordings, with 95 % intervals."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property, partial
from math import isfinite
from pathlib import Path
from typing import Any, Generic, Protocol, TypeVar

from cspm.measured import listed, measured
from cspm.parameters import Parameter, Parameters
from cspm.progress import Progress, by_steps, silent
from cspm.recorded import AnyRecording, path_of
from cspm.rig import FITTED, RigRequest, provenance
from cspm.testbed import AnyTestbed, Testbed, as_file
from cspm_ident.estimation import Prior
from cspm_ident.estimation.estimate import Estimate
from cspm_ident.fitted_testbed import FittedNumber
from cspm_ident.rig.damping import CUTOFF as DAMPING_CUTOFF
from cspm_ident.rig.damping import DampingResult, LinearDamping
from cspm_ident.rig.damping import identify_damping as fit_damping
from cspm_ident.rig.stiffness import CUTOFF as STIFFNESS_CUTOFF
from cspm_ident.rig.stiffness import StiffnessResult
from cspm_ident.rig.stiffness import identify_stiffness as fit_stiffness
from cspm_ident.rig.stiffness_fit import NAMES
from cspm_ident.system.choice import choose
from cspm_ident.system.fitted_file import fitted_testbed as fitted_system
from cspm_ident.system.identification import HORIZON, SystemResult
from cspm_ident.system.identification import identify_system as fit_system
from cspm_ident.winch.fitted_file import fitted_testbed as fitted_winches
from cspm_ident.winch.identify_winches import BAND_HZ, EFFECTS, WinchesResult, identify_winches
from cspm_msgs_py.errors import InputError
from cspm_msgs_py.new_folder import refuse_existing
from cspm_msgs_py.testbed import TestbedFile


class Outcome(Protocol):
    """All that was identified."""

    def data(self) -> dict[str, Any]:
        """Return everything as plain data for JSON."""


Result = TypeVar("Result", bound=Outcome, covariant=True)


@dataclass(frozen=True, eq=False)
class Identification(Generic[Result]):
    """What was identified.

    Attributes:
        result: all of it, internal.
        parameters: the estimates: `parameters["bar.mass"].ci95`; of several winches
            `parameters["inertia", "sway_3"]`.
        fitted: gives the test-bed file with the estimates.
        draw: draws pictures into a folder; returns their paths by kind.
        pictures_first: whether they are listed before the test-bed file.
    """

    result: Result
    parameters: Parameters
    fitted: Callable[[], TestbedFile | None]
    draw: Callable[[Path], dict[str, str]]
    pictures_first: bool = False

    def data(self) -> dict[str, Any]:
        """Return everything as plain data: what `cspm identify … --json` writes."""
        return self.result.data()

    @cached_property
    def testbed(self) -> Testbed | None:
        """The machine with what was identified; None where nothing was that it could take.

        Raises:
            InputError: the numbers are no machine's.
        """
        file = self.fitted()
        return None if file is None else Testbed(file)

    def write(self, folder: str | Path) -> dict[str, str]:
        """Write the fitted test-bed file and pictures; return their paths by kind.

        Args:
            folder: a new one.

        Raises:
            InputError: the folder exists, or the numbers are no machine's.
        """
        place = Path(folder)
        refuse_existing(place)
        file = self.fitted()
        place.mkdir(parents=True)
        written = {}
        if file is not None:
            (place / FITTED).write_text(file.text, encoding="utf-8")
            written["testbed"] = str(place / FITTED)
        pictures = self.draw(place)
        return pictures | written if self.pictures_first else written | pictures


def identify_winch(
    recordings: AnyRecording | Iterable[AnyRecording],
    *,
    held_out: AnyRecording | Iterable[AnyRecording] = (),
    testbed: AnyTestbed | None = None,
    winches: Sequence[str] = (),
    effects: Sequence[str] = (),
    torque_age: float | None = None,
    reversals: bool = True,
    band: float | None = None,
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
            simulated drive, else 0.
        reversals: whether windows count in which the shaft reverses.
        band: torque errors are counted below this frequency [Hz]; None for 40 Hz.
        progress: called now and then with an estimate of the share and what is being done.

    Raises:
        InputError: naming what is wrong in recordings, test-bed or arguments.

    Example:
        >>> import cspm
        >>> found = cspm.identify_winch("one_winch_30")  # doctest: +SKIP
        >>> found.parameters["inertia"].ci95  # doctest: +SKIP
        (3.9e-05, 4.1e-05)
    """
    searched, judged = measured(listed(recordings), testbed), measured(listed(held_out), testbed)
    age = searched[0].torque_age if torque_age is None else torque_age
    result = identify_winches(
        searched,
        winches,
        effects or EFFECTS,
        held_out=judged,
        torque_age=age,
        reversals=reversals,
        band=BAND_HZ if band is None else band,
        progress=by_steps(progress),
    )
    file, source = searched[0].testbed, _source(testbed, searched[0].path)
    return Identification(
        result,
        Parameters(p for w in result.winches for p in _estimated(w.fit.estimate, w.name)),
        lambda: fitted_winches(result, file, source),
        partial(_draw_winches, result),
    )


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
        progress: called now and then with an estimate of the share and what is being done.

    Raises:
        InputError: naming what is wrong in recordings, test-bed or arguments.
    """
    searched, judged = measured(listed(recordings), testbed), measured(listed(held_out), testbed)
    known = {name: Prior(*each) for name, each in (priors or {}).items()}
    chosen = choose(searched[0].machine, names, frozen or {}, known, bounds or {})
    for name in profiled:
        if name not in {each.name for each in chosen if not each.parameter.frozen}:
            raise InputError(f"--profile {name}: is not fitted, allowed: a name that is")
    result = fit_system(
        searched,
        chosen,
        held_out=judged,
        profiled=profiled,
        horizon=HORIZON if horizon is None else horizon,
        progress=by_steps(progress),
    )
    file, source = searched[0].testbed, _source(testbed, searched[0].path)
    return Identification(
        result,
        Parameters(_estimated(result.solution.estimate, "")),
        lambda: fitted_system(result, file, source),
        partial(_draw_system, result),
    )


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
    asked = _rig(recordings, testbed, cables, verify, None, into, into_cables, cutoff)
    return identified_stiffness(asked)


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
    asked = _rig(recordings, testbed, cables, verify, stiffness, into, into_cables, cutoff)
    return identified_damping(asked)


def identified_stiffness(asked: RigRequest) -> Identification[StiffnessResult]:
    """Return the stiffness that was asked for; see `identify_stiffness`."""
    result = fit_stiffness(asked.specimens(), asked.verify, asked.cutoff or STIFFNESS_CUTOFF)
    specimens = [one.specimen for one in result.specimens]
    return Identification(
        result,
        Parameters(_estimated(result.both.estimate, "")),
        lambda: asked.fitted(specimens, "stiffness", stiffness_numbers(result)),
        partial(_draw_stiffness, result),
        pictures_first=True,
    )


def identified_damping(asked: RigRequest) -> Identification[DampingResult]:
    """Return the damping that was asked for; see `identify_damping`."""
    result = fit_damping(asked.specimens(), asked.verify, asked.cutoff or DAMPING_CUTOFF)
    law, specimens = result.law, [one.specimen for one in result.specimens]
    return Identification(
        result,
        Parameters(_law(law)),
        lambda: (
            None
            if law is None
            else asked.fitted(specimens, "damping", damping_numbers(result, law))
        ),
        partial(_draw_damping, result),
        pictures_first=True,
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


def _source(testbed: AnyTestbed | None, recording: Path) -> str:
    return str(recording) if testbed is None else as_file(testbed).source


def _estimated(estimate: Estimate, element: str) -> Iterable[Parameter]:
    for name, unit in zip(estimate.names, estimate.units, strict=True):
        low, high = estimate.interval(name)
        known = isfinite(low) and isfinite(high)
        ends = (float(low), float(high)) if known else None
        yield Parameter(name, element, float(estimate.value(name)), unit, ends)


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


def _draw_winches(result: WinchesResult, folder: Path) -> dict[str, str]:
    from cspm.plots.winch_figure import draw_winch

    written = {}
    for winch in result.winches:
        picture = folder / f"winch_{winch.name}.png"
        draw_winch(picture, winch)
        written[f"winch_{winch.name}"] = str(picture)
    return written


def _draw_system(result: SystemResult, folder: Path) -> dict[str, str]:
    from cspm.plots.system_figure import draw_system

    draw_system(folder / "system.png", result.judgements)
    return {"system": str(folder / "system.png")}


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
