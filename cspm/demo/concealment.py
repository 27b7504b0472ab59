"""What the demonstration conceals: an effect of usual size, drawn from a seed."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.random import Generator

from cspm.testbed import Testbed
from cspm_msgs_py.errors import InputError
from cspm_msgs_py.testbed import Cable
from cspm_msgs_py.testbed_keys.near_name import allowed_names
from cspm_sim.effects import Effect, catalogue

BAR = "bar"
# Shares of a quantity that wear, tolerances and ageing usually reach; half of it with --hard.
_LEAST, _MOST = 0.1, 0.25
_TOLERANCE_LEAST, _TOLERANCE_MOST = 0.03, 0.08
_USUAL_CABLE_SPEED = 0.15  # m/s, of the library's calm sea
_ORDERS = (1, 2, 3)  # of torque ripple per turn: unbalance and pole pairs


@dataclass(frozen=True)
class Concealed:
    """One effect on one element.

    Attributes:
        effect: its id.
        element: the cable or body that has it.
        parameters: its numbers, SI.
    """

    effect: str
    element: str
    parameters: dict[str, float]

    @property
    def words(self) -> str:
        """What it is and where, such as "dry friction of winch surge 2"."""
        return naming(catalogue()[self.effect], self.element)

    @property
    def numbers(self) -> str:
        """Its numbers with units."""
        units = {p.name: p.unit for p in catalogue()[self.effect].parameters}
        return ", ".join(
            f"{name.replace('_', ' ')} {value:.3g} {units[name]}".removesuffix(" 1")
            for name, value in self.parameters.items()
        )


def naming(effect: Effect, element: str) -> str:
    """Return an effect and its place in words."""
    place = element.replace("_", " ")
    part = {"winch": "winch ", "cable": "cable ", "sensor": "load cell "}
    where = place if element == BAR else f"{part.get(effect.block.value, '')}{place}"
    return f"{effect.words} of {where}"


def drawn(
    testbed: Testbed, random: Generator, count: int, share: float, named: str | None
) -> list[Concealed]:
    """Draw effects on different elements.

    Args:
        testbed: the machine.
        random: where chance comes from.
        count: how many.
        share: of their usual size.
        named: id of the first; None draws it too.

    Raises:
        InputError: an effect that is not one of `CONCEALABLE`.
    """
    if named is not None and named not in CONCEALABLE:
        raise InputError(f"--effect {named}: {allowed_names(named, CONCEALABLE)}")
    names = [str(name) for name in random.permutation(list(CONCEALABLE))]
    if named is not None:
        names.insert(0, named)
    cables = random.permutation(len(testbed.cables))
    found = []
    for name, cable in list(zip(dict.fromkeys(names), cables, strict=False))[:count]:
        element = BAR if name.startswith(BAR) else testbed.cables[cable]
        numbers = CONCEALABLE[name](testbed, testbed.description.cables[cable], random, share)
        found.append(Concealed(name, element, numbers))
    return found


def _part(random: Generator, share: float) -> float:
    return share * float(random.uniform(_LEAST, _MOST))


def _tolerance(random: Generator, share: float) -> float:
    sign = float(random.choice([-1.0, 1.0]))
    return sign * share * float(random.uniform(_TOLERANCE_LEAST, _TOLERANCE_MOST))


def _tension(testbed: Testbed) -> float:
    """Return the bar's weight per cable [N]."""
    bar = testbed.description.bar
    weight = 0.0 if bar is None else bar.mass * testbed.description.gravity
    return weight / len(testbed.cables)


def _holding(testbed: Testbed, cable: Cable) -> float:
    """Return the motor torque that holds the weight per cable [N·m]."""
    return _tension(testbed) * cable.drum_radius / cable.gear_ratio


def _friction(testbed: Testbed, cable: Cable, random: Generator, share: float) -> dict[str, float]:
    return {"torque": _part(random, share) * _holding(testbed, cable)}


def _drag(testbed: Testbed, cable: Cable, random: Generator, share: float) -> dict[str, float]:
    speed = _USUAL_CABLE_SPEED * cable.gear_ratio / cable.drum_radius
    return {"coefficient": _part(random, share) * _holding(testbed, cable) / speed}


def _ripple(testbed: Testbed, cable: Cable, random: Generator, share: float) -> dict[str, float]:
    return {
        "amplitude": _part(random, share) * _holding(testbed, cable),
        "order": float(random.choice(_ORDERS)),
        "phase": float(random.uniform(-np.pi, np.pi)),
    }


def _gain(testbed: Testbed, cable: Cable, random: Generator, share: float) -> dict[str, float]:
    return {"gain": 1.0 + _tolerance(random, share)}


def _offset(testbed: Testbed, cable: Cable, random: Generator, share: float) -> dict[str, float]:
    return {"torque": _tolerance(random, share) * _holding(testbed, cable)}


def _bias(testbed: Testbed, cable: Cable, random: Generator, share: float) -> dict[str, float]:
    return {"bias": _tolerance(random, share) * _tension(testbed)}


def _mass(testbed: Testbed, cable: Cable, random: Generator, share: float) -> dict[str, float]:
    bar = testbed.description.bar
    return {"mass": _tolerance(random, share) * (0.0 if bar is None else bar.mass)}


_Sized = Callable[[Testbed, Cable, Generator, float], dict[str, float]]
CONCEALABLE: dict[str, _Sized] = {
    "winch_coulomb_friction": _friction,
    "winch_viscous_friction": _drag,
    "winch_torque_ripple": _ripple,
    "winch_torque_gain": _gain,
    "winch_torque_offset": _offset,
    "tension_bias": _bias,
    "tension_gain": _gain,
    "bar_mass": _mass,
}
