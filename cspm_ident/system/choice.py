"""The machine's numbers that can be fitted, by name."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace

from cspm_ident.estimation.parameter import Parameter, Prior
from cspm_msgs_py.dofs import DOFS
from cspm_msgs_py.errors import InputError
from cspm_msgs_py.testbed import Testbed
from cspm_sim.effect_entries import read_actions
from cspm_sim.effects import catalogue

DEFAULT = (
    "bar.mass",
    "bar.com.x",
    "bar.inertia",
    "stiffness",
    "axial_damping",
    "transverse_damping",
    "bar_damping.roll",
)
MOMENTS = ("ixx", "iyy", "izz")
AXES = ("x", "y", "z")
POINTS = ("exit", "attachment")
# By name: effect, its parameter, value without it, upper bound, a change that matters.
_OF_CABLES = {
    "stiffness": ("cable_stiffness", "scale", 0.2, 5.0, 0.3),
    "axial_damping": ("cable_axial_damping", "scale", 0.0, 50.0, 1.0),
    "transverse_damping": ("cable_transverse_damping", "coefficient", 0.0, 50.0, 1.0),
}
_TRANSLATIONS = 3


@dataclass(frozen=True)
class EffectPlace:
    """A parameter of an entry of the test-bed's `effects`.

    Attributes:
        effect: id.
        parameter: its name.
        elements: cables that it acts on; empty for all, or for a body.
    """

    effect: str
    parameter: str
    elements: tuple[str, ...] = ()


@dataclass(frozen=True)
class BarPlace:
    """A number of the test-bed's `bar`.

    Attributes:
        key: `mass`, `com.x`, `inertia.iyy`; `inertia` alone is a factor on all of the tensor.
    """

    key: str


@dataclass(frozen=True)
class PointPlace:
    """A coordinate of one end of a cable.

    Attributes:
        cable: its number.
        point: `exit`, in winch_frame_ned, or `attachment`, in bar_ned.
        axis: number of the coordinate.
    """

    cable: int
    point: str
    axis: int


Place = EffectPlace | BarPlace | PointPlace


@dataclass(frozen=True)
class Chosen:
    """A parameter to fit, and where it lies in the machine.

    Attributes:
        parameter: bounds, scale, prior, frozen.
        place: what it replaces.
        nominal: the machine's value, where the fit starts.
    """

    parameter: Parameter
    place: Place
    nominal: float

    @property
    def name(self) -> str:
        """The parameter's."""
        return self.parameter.name


def choose(
    testbed: Testbed,
    names: Sequence[str] = (),
    frozen: Mapping[str, float | None] | None = None,
    priors: Mapping[str, Prior] | None = None,
    bounds: Mapping[str, tuple[float, float]] | None = None,
) -> tuple[Chosen, ...]:
    """Return what is to be fitted.

    Args:
        testbed: the machine as described.
        names: see `allowed_names`; none for `DEFAULT`.
        frozen: names that keep a value, or the machine's where it is None.
        priors: by name, in the parameter's unit.
        bounds: lowest and highest value by name, in the parameter's unit, within the usual ones.

    Raises:
        InputError: a name that there is not or that occurs twice, a prior or bounds of none that is
            fitted, a value out of bounds, or a machine without bar.
    """
    frozen, priors, bounds = frozen or {}, priors or {}, bounds or {}
    if testbed.bar is None:
        raise InputError(
            f"identify system: test-bed {testbed.name} has no bar, allowed: a machine with one;"
            " cables on a rig: cspm identify stiffness"
        )
    fitted = list(names or DEFAULT)
    held = [name for name in frozen if name not in fitted]
    wanted = [*fitted, *held]
    for i, name in enumerate(fitted):
        if name in fitted[:i]:
            raise InputError(f"--fit {name}: occurs twice, allowed: each name once")
    for option, known in (("--prior", priors), ("--bound", bounds)):
        for name in known:
            if name not in wanted:
                raise InputError(f"{option} {name}: is not fitted, allowed: {', '.join(wanted)}")
    found = [_chosen(testbed, name, "--fit") for name in fitted]
    found += [_chosen(testbed, name, "--freeze") for name in held]
    bounded = [_within(each, bounds[each.name]) if each.name in bounds else each for each in found]
    return tuple(_with_knowledge(each, frozen, priors) for each in bounded)


def allowed_names(testbed: Testbed) -> list[str]:
    """Return all names for a machine; those of cables also take a kind or a cable behind a dot."""
    return [
        *("bar.mass", *(f"bar.com.{axis}" for axis in AXES)),
        *("bar.inertia", *(f"bar.inertia.{moment}" for moment in MOMENTS)),
        *(f"{name}[.{'|.'.join(_kinds(testbed))}|.CABLE]" for name in _OF_CABLES),
        *(f"bar_damping.{dof}" for dof in DOFS),
        *(f"frame_offset.{dof}" for dof in DOFS),
        *(f"{point}.CABLE.{'|'.join(AXES)}" for point in POINTS),
    ]


def _chosen(testbed: Testbed, name: str, option: str) -> Chosen:
    head, _, rest = name.partition(".")
    found = None
    if head == "bar":
        found = _of_bar(testbed, name, rest)
    elif head in _OF_CABLES:
        found = _of_cables(testbed, name, head, rest)
    elif head in ("bar_damping", "frame_offset") and rest in DOFS:
        found = _of_body(testbed, name, head, rest)
    elif head in POINTS:
        found = _of_point(testbed, name, head, rest)
    if found is None:
        raise InputError(f"{option} {name}: allowed: {', '.join(allowed_names(testbed))}")
    return found


def _of_bar(testbed: Testbed, name: str, rest: str) -> Chosen | None:
    bar = testbed.bar
    key, _, part = rest.partition(".")
    if bar is None:
        return None
    if rest == "mass":
        value, unit = bar.mass, "kg"
    elif rest == "inertia":
        value, unit = 1.0, "1"
    elif key == "inertia" and part in MOMENTS:
        value, unit = float(getattr(bar.inertia, part)), "kg·m²"
    elif key == "com" and part in AXES:
        value = bar.com[AXES.index(part)]
        parameter = Parameter(name, "m", value - 0.5, value + 0.5, 0.05)
        return Chosen(parameter, BarPlace(rest), value)
    else:
        return None
    parameter = Parameter(name, unit, 0.1 * value, 10.0 * value, 0.3 * value)
    return Chosen(parameter, BarPlace(rest), value)


def _of_cables(testbed: Testbed, name: str, head: str, rest: str) -> Chosen | None:
    effect, key, lower, upper, scale = _OF_CABLES[head]
    elements = tuple(
        cable for cable in testbed.cable_names if rest in (cable, cable.rpartition("_")[0])
    )
    if rest and not elements:
        return None
    about = next(p for p in catalogue()[effect].parameters if p.name == key)
    place = EffectPlace(effect, key, elements)
    parameter = Parameter(name, about.unit, lower, upper, scale)
    return Chosen(parameter, place, _present(testbed, place))


def _of_body(testbed: Testbed, name: str, head: str, dof: str) -> Chosen:
    straight = DOFS.index(dof) < _TRANSLATIONS
    if head == "bar_damping":
        unit, scale = ("N·s/m", 1.0) if straight else ("N·m·s/rad", 0.1)
        place = EffectPlace("bar_linear_damping", dof)
        parameter = Parameter(name, unit, 0.0, 50.0, scale)
    else:
        place = EffectPlace("frame_pose_offset", dof)
        parameter = Parameter(name, "m" if straight else "rad", -0.2, 0.2, 0.01)
    return Chosen(parameter, place, _present(testbed, place))


def _of_point(testbed: Testbed, name: str, point: str, rest: str) -> Chosen | None:
    cable, _, axis = rest.partition(".")
    if cable not in testbed.cable_names or axis not in AXES:
        return None
    place = PointPlace(testbed.cable_names.index(cable), point, AXES.index(axis))
    value = coordinate(testbed, place)
    return Chosen(Parameter(name, "m", value - 0.2, value + 0.2, 0.01), place, value)


def coordinate(testbed: Testbed, place: PointPlace) -> float:
    """Return the machine's own coordinate of one end of a cable [m]."""
    return float(getattr(testbed.cables[place.cable], place.point)[place.axis])


def _present(testbed: Testbed, place: EffectPlace) -> float:
    """Return the value in the machine's own entry for the same elements, or the absent one."""
    read_actions(testbed)
    for entry in testbed.effects:
        if same_place(testbed, place, entry.effect, entry.elements):
            return entry.numbers[place.parameter]
    return absent_values(place.effect)[place.parameter]


def same_place(testbed: Testbed, place: EffectPlace, effect: str, elements: Iterable[str]) -> bool:
    """Return whether an entry is that of a place: the same effect on the same elements."""
    if effect != place.effect:
        return False
    bodies = {"bar", "winch_frame"}
    everything = set(testbed.cable_names)
    theirs, ours = set(elements) - bodies, set(place.elements)
    return (theirs or everything) == (ours or everything)


def absent_values(effect: str) -> dict[str, float]:
    """Return an effect's parameters at which it does nothing, less what a file may leave out."""
    needed = (p for p in catalogue()[effect].parameters if p.default is None)
    return {p.name: p.absent or 0.0 for p in needed}


def _kinds(testbed: Testbed) -> list[str]:
    return list(dict.fromkeys(name.rpartition("_")[0] or name for name in testbed.cable_names))


def _within(chosen: Chosen, bounds: tuple[float, float]) -> Chosen:
    limits, (low, high) = chosen.parameter, bounds
    if not limits.lower <= low < high <= limits.upper:
        raise InputError(
            f"--bound {chosen.name}={low:g}:{high:g}: allowed: rising, {limits.lower:g} to"
            f" {limits.upper:g} {limits.unit}"
        )
    return replace(chosen, parameter=replace(limits, lower=low, upper=high))


def _with_knowledge(
    chosen: Chosen, frozen: Mapping[str, float | None], priors: Mapping[str, Prior]
) -> Chosen:
    name = chosen.name
    value = frozen.get(name)
    nominal = chosen.nominal if value is None else value
    limits = chosen.parameter
    if not limits.lower <= nominal <= limits.upper:
        raise InputError(
            f"{name}: {nominal:g} {limits.unit}, allowed: {limits.lower:g} to {limits.upper:g}"
        )
    parameter = replace(limits, frozen=name in frozen, prior=priors.get(name))
    return replace(chosen, parameter=parameter, nominal=nominal)
