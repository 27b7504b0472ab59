"""The machine as a MuJoCo model.

Bodies: the winch frame, which is moved from outside, with a site at each exit; the bar on a free
joint, with a site at each attachment; one rotor per winch on a hinge of its own, fixed to the
world. MuJoCo integrates the unstretched lengths as well, as activations of actuators without
force.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any
from xml.etree import ElementTree

import mujoco

from cspm_msgs_py.errors import InputError
from cspm_msgs_py.testbed import Bar, Testbed
from cspm_sim.mujoco.extras import Extras

Element = ElementTree.Element

ORIGIN = (0.0, 0.0, 0.0)
BAR_BODY = 2  # after the world and the winch frame
# MuJoCo keeps a dry joint at rest by a damper; the stiffest that it has, with a time constant of
# two steps.
_STICKING_STEPS = 2.0
_STICKING = "0.9999 0.9999 0.001 0.5 2"


def build_model(testbed: Testbed, extras: Extras, timestep: float) -> Any:  # noqa: ANN401 - mujoco carries no types
    """Return the compiled model; `timestep` in s.

    Raises:
        InputError: MuJoCo refuses the machine, or a cable runs over a pulley or in several parts.
    """
    _check_straight(testbed)
    root = Element("mujoco", model=testbed.name)
    option = ElementTree.SubElement(
        root,
        "option",
        timestep=repr(timestep),
        integrator="RK4",
        gravity=f"0 0 {testbed.gravity!r}",
    )
    ElementTree.SubElement(option, "flag", contact="disable", autoreset="disable")
    world = ElementTree.SubElement(root, "worldbody")
    frame = ElementTree.SubElement(world, "body", name="winch_frame", mocap="true")
    _sites(frame, "exit", ((c.name, c.exit or ORIGIN) for c in testbed.cables))
    hung = ElementTree.SubElement(world, "body", name="bar" if testbed.bar else "anchors")
    if testbed.bar:
        _add_mass(hung, testbed.bar)
    _sites(hung, "attachment", ((c.name, c.attachment or ORIGIN) for c in testbed.cables))
    _add_winches(root, world, testbed, extras, timestep)
    try:
        return mujoco.MjModel.from_xml_string(ElementTree.tostring(root, encoding="unicode"))
    except ValueError as err:
        reason = " ".join(str(err).split())
        raise InputError(
            f"test-bed {testbed.name}: MuJoCo refuses it ({reason}), allowed: a machine that it"
            " can compile"
        ) from None


def _numbers(values: Iterable[float]) -> str:
    return " ".join(repr(float(value)) for value in values)


def _sites(body: Element, kind: str, points: Iterable[tuple[str, Iterable[float]]]) -> None:
    for name, point in points:
        ElementTree.SubElement(body, "site", name=f"{kind}_{name}", pos=_numbers(point))


def _add_mass(body: Element, bar: Bar) -> None:
    tensor = bar.inertia
    ElementTree.SubElement(body, "freejoint")
    ElementTree.SubElement(
        body,
        "inertial",
        pos=_numbers(bar.com),
        mass=repr(bar.mass),
        fullinertia=_numbers(
            (tensor.ixx, tensor.iyy, tensor.izz, tensor.ixy, tensor.ixz, tensor.iyz)
        ),
    )


def _add_winches(
    root: Element, world: Element, testbed: Testbed, extras: Extras, timestep: float
) -> None:
    actuators = ElementTree.SubElement(root, "actuator")
    for i, cable in enumerate(testbed.cables):
        body = ElementTree.SubElement(world, "body", name=f"rotor_{cable.name}")
        # Its mass rests on the hinge; only the inertia about it moves.
        inertia = _numbers([cable.rotor_inertia] * 3)
        ElementTree.SubElement(body, "inertial", pos="0 0 0", mass="1", diaginertia=inertia)
        ElementTree.SubElement(
            body,
            "joint",
            name=cable.name,
            type="hinge",
            axis="0 0 1",
            damping=repr(float(extras.damping[i])),
            frictionloss=repr(float(extras.friction[i])),
            solreffriction=f"{_STICKING_STEPS * timestep!r} 1",
            solimpfriction=_STICKING,
        )
        limit = repr(cable.torque_limit)
        ElementTree.SubElement(
            actuators, "motor", joint=cable.name, ctrllimited="true", ctrlrange=f"-{limit} {limit}"
        )
    for cable in testbed.cables:
        ElementTree.SubElement(
            actuators,
            "general",
            joint=cable.name,
            dyntype="integrator",
            gainprm="0",
            biastype="none",
        )


def _check_straight(testbed: Testbed) -> None:
    for cable in testbed.cables:
        if not cable.is_straight:
            raise InputError(
                f"test-bed {testbed.name}: {cable.name} has a pulley or several parts, allowed with"
                " --plant mujoco: straight cables of one part; the own plant has both"
            )
