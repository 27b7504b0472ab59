"""Commands that identify parameters: identify stiffness, damping, winch, system."""

from __future__ import annotations

from collections.abc import Callable
from inspect import Parameter, Signature, signature
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, TypeAlias

import typer

from cspm.cli.app import MARKUP, RUN_FAILED, Json, LeaveOutRegimes, app
from cspm.cli.early_checks import FITTED, begin_judged, check_given
from cspm.cli.held_out import HeldOut, JudgedCommand
from cspm_msgs_py.errors import InputError

if TYPE_CHECKING:
    from cspm.rig import RigRequest
    from cspm_ident.estimation import Prior

RigCommand: TypeAlias = "Callable[[RigRequest, Path | None], bool]"

identify = typer.Typer(
    no_args_is_help=True,
    rich_markup_mode=MARKUP,
    help="Fit parameters to recordings. With 95 % intervals, written into a test-bed file.",
)
app.add_typer(identify, name="identify")

Recordings = Annotated[
    list[Path],
    typer.Argument(
        metavar="REC...",
        help="Recordings of machines without bar, each winch pulling a cable that is fixed to a"
        " load cell: all lengths in one recording, or a recording for each.",
    ),
]
MachineFile = Annotated[
    Path | None,
    typer.Option(
        "--testbed",
        metavar="FILE",
        help="The machine that was recorded, instead of what the recordings carry.",
    ),
]
Cables = Annotated[
    str | None,
    typer.Option(
        metavar="NAME,NAME",
        help="Which cables to use: those of one kind. Otherwise all.",
    ),
]
Verify = Annotated[
    list[str] | None,
    typer.Option(
        metavar="CABLE",
        help="A cable that judges the law without being fitted; may be repeated. Where several"
        " recordings have a cable of that name: RECORDING:CABLE.",
    ),
]
StiffnessFile = Annotated[
    Path | None,
    typer.Option(
        "--stiffness",
        metavar="FILE",
        help="A test-bed file whose stiffness laws to use, instead of those of the machine"
        " recorded; the damping is put into it unless --into says otherwise.",
    ),
]
Into = Annotated[
    Path | None,
    typer.Option(
        metavar="FILE",
        help="The test-bed file that the law is put into; otherwise the machine recorded.",
    ),
]
IntoCables = Annotated[
    str | None,
    typer.Option(
        metavar="NAME,NAME",
        help="The cables there that get the law; otherwise those identified.",
    ),
]
Cutoff = Annotated[
    float | None,
    typer.Option(metavar="HZ", help="Cut-off of the filter without phase."),
]
Out = Annotated[
    Path | None,
    typer.Option(metavar="FOLDER", help="A new folder for pictures and the fitted test-bed file."),
]


def _rig_request(
    recordings: Recordings,
    stiffness: StiffnessFile = None,
    testbed: MachineFile = None,
    cables: Cables = None,
    verify: Verify = None,
    into: Into = None,
    into_cables: IntoCables = None,
    cutoff: Cutoff = None,
    out: Out = None,
) -> RigRequest:
    if cutoff is not None and not cutoff > 0.0:
        raise InputError(f"--cutoff {cutoff:g}: allowed: a frequency above 0 Hz")
    check_given(recordings, testbed, out)
    from cspm.rig import RigRequest

    return RigRequest(
        recordings=tuple(recordings),
        testbed=testbed,
        cables=_names("--cables", cables),
        verify=tuple(verify or ()),
        stiffness=stiffness,
        into=into,
        into_cables=_names("--into-cables", into_cables),
        cutoff=cutoff,
        out=out,
    )


def _names(option: str, text: str | None) -> tuple[str, ...]:
    names = tuple(name.strip() for name in text.split(",")) if text is not None else ()
    if not all(names):
        raise InputError(f"{option} {text}: allowed: names with commas between them")
    return names


def _end(valid: bool) -> None:
    """End the command: with an error where parameters are no result."""
    if not valid:
        raise typer.Exit(RUN_FAILED)


def _rig_command(epilog: str, *without: str) -> Callable[[RigCommand], RigCommand]:
    """Register a command with the options of `_rig_request`, those named left out, and --json."""
    taken = signature(_rig_request, locals={"RigRequest": object}, eval_str=True).parameters
    options = [option for name, option in taken.items() if name not in without]
    json = Parameter("json", Parameter.KEYWORD_ONLY, default=None, annotation=Json)

    def register(does: RigCommand) -> RigCommand:
        def command(json: Path | None, **given: Any) -> None:  # noqa: ANN401 - as `_rig_request`
            _end(does(_rig_request(**given), json))

        command.__signature__ = Signature([*options, json])  # type: ignore[attr-defined]
        command.__doc__ = does.__doc__
        identify.command(does.__name__, epilog=epilog)(command)
        return does

    return register


@_rig_command(
    """Example:

cspm run rig_stiffness_hoist --out ramps

cspm identify stiffness ramps --verify hoist_180 --out hoist_stiffness""",
    "stiffness",
)
def stiffness(request: RigRequest, json: Path | None) -> bool:
    """Fit a cable's stiffness to slow ramps. One kind of cable, at several lengths.

    Stretching and releasing are kept apart, and the hysteresis between them is reported.
    """
    from cspm.commands.identify_stiffness_command import identify_stiffness_command

    return identify_stiffness_command(request, json)


@_rig_command(
    """Example:

cspm run rig_damping_hoist --out sines

cspm identify damping sines --stiffness hoist_stiffness/fitted_testbed.yaml --verify hoist_180
--out hoist_damping"""
)
def damping(request: RigRequest, json: Path | None) -> bool:
    """Fit a cable's damping to multi-sines. One kind of cable, at several lengths.

    Identify the stiffness first, and give its fitted test-bed file by --stiffness.
    """
    from cspm.commands.identify_damping_command import identify_damping_command

    return identify_damping_command(request, json)


@identify.command(
    cls=JudgedCommand,
    epilog="""Examples:

cspm import DATA_EMPS.mat --mapping emps --testbed emps --out emps

cspm identify winch emps --held-out emps_pulses --out fitted

cspm run emps --testbed fitted/fitted_testbed.yaml

cspm identify winch bag --winches surge_1,surge_2 --effects winch_viscous_friction""",
)
def winch(
    recordings: Annotated[
        list[Path],
        typer.Argument(
            metavar="REC...",
            help="Recordings of motor angle and torque, and of the tension where the winch pulls a"
            " cable; with a bar or without.",
        ),
    ],
    testbed: MachineFile = None,
    winches: Annotated[
        str | None,
        typer.Option(metavar="NAME,NAME", help="Names of their cables, otherwise all."),
    ] = None,
    effects: Annotated[
        str | None,
        typer.Option(
            metavar="ID,ID",
            help="What to fit beside the inertia: effects that are linear at the motor shaft; a"
            " wrong id lists them. Usually viscous friction, Coulomb friction and an offset.",
        ),
    ] = None,
    held_out: HeldOut = None,
    torque_age: Annotated[
        float | None,
        typer.Option(
            metavar="S",
            help="How long before its stamp a reported torque acted; otherwise half a period for"
            " recordings of `cspm run`, whose drives hold it, and 0 for others, unless the motion"
            " clearly says another.",
        ),
    ] = None,
    reversals: Annotated[
        bool | None,
        typer.Option(
            "--with-reversals/--without-reversals",
            help="Whether windows count in which the shaft reverses, where dry friction sticks."
            " Otherwise only where a parameter cannot be identified without them.",
            show_default=False,
        ),
    ] = None,
    band: Annotated[
        float | None,
        typer.Option(metavar="HZ", help="Torque errors are counted below, otherwise 40 Hz."),
    ] = None,
    leave_out_regimes: LeaveOutRegimes = False,
    out: Out = None,
    json: Json = None,
) -> None:
    """Fit inertia and friction of winches. From their own angle, torque and tension.

    Each winch by itself, in weak form: nothing is differentiated that carries noise.
    """
    begin_judged(FITTED, recordings, held_out or (), testbed, out)
    from cspm.commands.identify_winch_command import WinchRequest, identify_winch_command

    request = WinchRequest(
        recordings=tuple(recordings),
        held_out=tuple(held_out or ()),
        testbed=testbed,
        winches=_names("--winches", winches),
        effects=_names("--effects", effects),
        torque_age=torque_age,
        reversals=reversals,
        band=band,
        out=out,
        leave_out_regimes=leave_out_regimes,
    )
    _end(identify_winch_command(request, json))


_GEOMETRY_EXAMPLE = """Example:

cspm run worst_case --duration 60 --out wide

cspm identify geometry wide --out geometry"""


@identify.command("lengths", cls=JudgedCommand, hidden=True, epilog=_GEOMETRY_EXAMPLE)
@identify.command(cls=JudgedCommand, epilog=_GEOMETRY_EXAMPLE)
def geometry(
    recordings: Annotated[
        list[Path],
        typer.Argument(
            metavar="REC...",
            help="Recordings of motor angles and the poses of what moves; tensions, where there"
            " are load cells, give the stretch.",
        ),
    ],
    testbed: MachineFile = None,
    held_out: HeldOut = None,
    out: Out = None,
    json: Json = None,
) -> None:
    """Fit where cables begin and end. Exits, attachments and drum radii, from poses and angles."""
    begin_judged(FITTED, recordings, held_out or (), testbed, out)
    from cspm.commands.identify_geometry_command import identify_geometry_command

    _end(identify_geometry_command(tuple(recordings), tuple(held_out or ()), testbed, out, json))


@identify.command(
    cls=JudgedCommand,
    epilog="""Examples:

cspm run factor_six_mid --out mid

cspm identify system mid --fit bar.mass,axial_damping,bar_damping.surge --out fitted

cspm identify system short long --held-out mid --prior bar.mass=4.1±0.2 --freeze bar.inertia=1.1

cspm run calm --testbed fitted/fitted_testbed.yaml""",
)
def system(
    recordings: Annotated[
        list[Path],
        typer.Argument(
            metavar="REC...",
            help="Recordings of one machine with bar: poses of bar and moving winch frame, motor"
            " angles and, better, tensions; several lengths show more.",
        ),
    ],
    testbed: MachineFile = None,
    fit: Annotated[
        list[str] | None,
        typer.Option(
            metavar="NAME,NAME",
            help="What to fit, repeatable; a wrong name lists all. Usually mass, centre of mass"
            " along the bar, inertia, stiffness, damping along and across the cables, damping of"
            " the roll.",
        ),
    ] = None,
    freeze: Annotated[
        list[str] | None,
        typer.Option(metavar="NAME[=VALUE]", help="Keeps its value, or that one; repeatable."),
    ] = None,
    prior: Annotated[
        list[str] | None,
        typer.Option(
            metavar="NAME=MEAN±SD",
            help="What a datasheet or a scale says, with its standard"
            " deviation; MEAN+-SD works as well; repeatable.",
        ),
    ] = None,
    bound: Annotated[
        list[str] | None,
        typer.Option(
            metavar="NAME=LOW:HIGH", help="Keeps it between these, both included; repeatable."
        ),
    ] = None,
    horizon: Annotated[
        float | None,
        typer.Option(metavar="S", help="Length of the windows, otherwise 4 s."),
    ] = None,
    held_out: HeldOut = None,
    profile: Annotated[
        list[str] | None,
        typer.Option(
            metavar="NAME", help="Also its profile likelihood, which is slow; repeatable."
        ),
    ] = None,
    leave_out_regimes: LeaveOutRegimes = False,
    out: Annotated[
        Path | None,
        typer.Option(metavar="FOLDER", help="A new folder for picture and fitted test-bed file."),
    ] = None,
    json: Json = None,
) -> None:
    """Fit bar, cables and damping at once. Of a whole machine, from its motion.

    Windows of each recording are simulated from measured motor angles and the frame's pose, and
    compared with the bar's pose and the tensions.
    """
    begin_judged(FITTED, recordings, held_out or (), testbed, out)
    from cspm.commands.identify_system_command import SystemRequest, identify_system_command

    request = SystemRequest(
        recordings=tuple(recordings),
        held_out=tuple(held_out or ()),
        testbed=testbed,
        names=_names("--fit", ",".join(fit) if fit else None),
        frozen=dict(_frozen(text) for text in freeze or ()),
        priors=dict(_prior(text) for text in prior or ()),
        bounds=dict(_bounds(text) for text in bound or ()),
        profiled=tuple(profile or ()),
        horizon=horizon,
        out=out,
        leave_out_regimes=leave_out_regimes,
    )
    _end(identify_system_command(request, json))


def _frozen(text: str) -> tuple[str, float | None]:
    name, equals, value = text.partition("=")
    return name, _number("--freeze", text, value) if equals else None


def _prior(text: str) -> tuple[str, Prior]:
    from cspm_ident.estimation import Prior

    name, _, rest = text.partition("=")
    mean, _, deviation = rest.replace("+-", "±").partition("±")
    return name, Prior(_number("--prior", text, mean), _number("--prior", text, deviation))


def _bounds(text: str) -> tuple[str, tuple[float, float]]:
    name, _, rest = text.partition("=")
    low, _, high = rest.partition(":")
    return name, (_number("--bound", text, low), _number("--bound", text, high))


_FORMS = {
    "--prior": "NAME=MEAN±SD",
    "--freeze": "NAME or NAME=VALUE",
    "--bound": "NAME=LOW:HIGH",
}


def _number(option: str, text: str, part: str) -> float:
    try:
        return float(part)
    except ValueError:
        raise InputError(f"{option} {text}: allowed: {_FORMS[option]}") from None
