"""Identified winches as joints of MuJoCo: default classes that another model includes.

MuJoCo's joint has armature, viscous damping and dry friction of one size; see its documentation of
XML, `joint`. Numbers at the motor shaft become those at the drum or output shaft behind the gear
ratio n: inertia and damping times n², friction and torque times n.
"""

from __future__ import annotations

from xml.etree import ElementTree as ET

from cspm_msgs_py.testbed import Cable, Testbed

_VISCOUS, _COULOMB, _INERTIA = "winch_viscous_friction", "winch_coulomb_friction", "winch_inertia"
_WINCH = "winch_"


def mujoco_joints(testbed: Testbed) -> str:
    """Return an MJCF document with a default class for each winch, named as its cable.

    Its `joint` has armature [kg·m²], damping [N·m·s/rad] and frictionloss [N·m]; its `motor` the
    largest torque [N·m]. Effects of winches that MuJoCo's joints do not have are named in comments.
    """
    root = ET.Element("mujoco", model=testbed.name)
    defaults = ET.SubElement(root, "default")
    numbers = joint_numbers(testbed)
    for cable in testbed.cables:
        own = ET.SubElement(defaults, "default", {"class": cable.name})
        for effect in _left_out(testbed, cable.name):
            own.append(ET.Comment(f" {effect}: left out, MuJoCo's joints have none "))
        joint = {name: f"{value:.8g}" for name, value in numbers[cable.name].items()}
        ET.SubElement(own, "joint", joint)
        ET.SubElement(own, "motor", _motor(cable))
    ET.indent(root)
    return ET.tostring(root, encoding="unicode") + "\n"


def joint_numbers(testbed: Testbed) -> dict[str, dict[str, float]]:
    """Return armature, damping and frictionloss of each winch behind its gear, by cable."""
    found = {}
    for cable in testbed.cables:
        gear = cable.gear_ratio
        inertia = cable.rotor_inertia + _sum(testbed, cable.name, _INERTIA, "inertia")
        found[cable.name] = {
            "armature": gear**2 * inertia,
            "damping": gear**2 * _sum(testbed, cable.name, _VISCOUS, "coefficient"),
            "frictionloss": gear * _sum(testbed, cable.name, _COULOMB, "torque"),
        }
    return found


def _motor(cable: Cable) -> dict[str, str]:
    """Return the limit of a motor whose control is the torque at its own shaft [N·m]."""
    limit = f"{cable.torque_limit:.8g}"
    return {
        "gear": f"{cable.gear_ratio:.8g}",
        "ctrllimited": "true",
        "ctrlrange": f"-{limit} {limit}",
    }


def _sum(testbed: Testbed, cable: str, effect: str, parameter: str) -> float:
    """Return the sum of a parameter over all entries of an effect that act on a winch."""
    return sum(
        entry.numbers.get(parameter, 0.0)
        for entry in testbed.effects
        if entry.effect == effect and cable in (entry.elements or testbed.cable_names)
    )


def _left_out(testbed: Testbed, cable: str) -> list[str]:
    """Return the effects of a winch that a joint of MuJoCo cannot have, each once."""
    named = [
        entry.effect
        for entry in testbed.effects
        if cable in (entry.elements or testbed.cable_names)
        and entry.effect.startswith(_WINCH)
        and entry.effect not in (_VISCOUS, _COULOMB, _INERTIA)
    ]
    return list(dict.fromkeys(named))
