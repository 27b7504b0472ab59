"""Machines whose numbers are not those of their file."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from cspm_msgs_py.testbed import AxialDamping, Cable, ExponentialStiffness, Testbed

Array = NDArray[np.float64]


def heavier(testbed: Testbed, mass: Array) -> Testbed:
    """Return a machine whose bar has more mass [kg]."""
    if testbed.bar is None:
        return testbed
    bar = testbed.bar.model_copy(update={"mass": testbed.bar.mass + float(mass[0])})
    return testbed.model_copy(update={"bar": bar})


def harder_to_turn(testbed: Testbed, inertia: Array) -> Testbed:
    """Return a machine whose bar has more inertia about both axes across it [kg·m²]."""
    if testbed.bar is None:
        return testbed
    tensor, more = testbed.bar.inertia, float(inertia[0])
    changed = tensor.model_copy(update={"iyy": tensor.iyy + more, "izz": tensor.izz + more})
    bar = testbed.bar.model_copy(update={"inertia": changed})
    return testbed.model_copy(update={"bar": bar})


def off_centre(testbed: Testbed, shift: Array) -> Testbed:
    """Return a machine whose bar has its centre of mass farther along it [m]."""
    if testbed.bar is None:
        return testbed
    x, y, z = testbed.bar.com
    bar = testbed.bar.model_copy(update={"com": (x + float(shift[0]), y, z)})
    return testbed.model_copy(update={"bar": bar})


def stiffer(testbed: Testbed, excess: Array) -> Testbed:
    """Return a machine of stiffer cables, by shares (n,)."""

    def change(cable: Cable, share: float) -> Cable:
        law = cable.stiffness
        if not isinstance(law, ExponentialStiffness):
            return cable
        scaled = {
            "a": law.a * (1.0 + share),
            "youngs_modulus": law.youngs_modulus * (1.0 + share),
        }
        return cable.model_copy(update={"stiffness": law.model_copy(update=scaled)})

    return _each(testbed, excess, change)


def damped(testbed: Testbed, excess: Array) -> Testbed:
    """Return a machine whose cables have stronger dampers, by shares (n,)."""

    def change(cable: Cable, share: float) -> Cable:
        law = cable.damping
        if not isinstance(law, AxialDamping):
            return cable
        factor = {"factor": law.factor * (1.0 + share)}
        return cable.model_copy(update={"damping": law.model_copy(update=factor)})

    return _each(testbed, excess, change)


def more_inert(testbed: Testbed, inertia: Array) -> Testbed:
    """Return a machine of more inert winches (n,) [kg·m²]."""

    def change(cable: Cable, more: float) -> Cable:
        return cable.model_copy(update={"rotor_inertia": cable.rotor_inertia + more})

    return _each(testbed, inertia, change)


def wider(testbed: Testbed, radius: Array) -> Testbed:
    """Return a machine of wider drums (n,) [m]."""

    def change(cable: Cable, more: float) -> Cable:
        return cable.model_copy(update={"drum_radius": cable.drum_radius + more})

    return _each(testbed, radius, change)


def surveyed(testbed: Testbed, error: float, generator: np.random.Generator) -> Testbed:
    """Return a machine whose exits and attachments lie beside those of its file.

    Attachments stay on the bar's own axis: beside it cables turn the bar, and none holds it.

    Args:
        testbed: the machine as it was surveyed.
        error: standard deviation of each coordinate [m].
        generator: of the errors.
    """

    def beside(
        point: tuple[float, float, float] | None, axes: int
    ) -> tuple[float, float, float] | None:
        if point is None:
            return None
        moved = np.array(point)
        moved[:axes] += generator.normal(0.0, error, axes)
        x, y, z = moved.tolist()
        return x, y, z

    cables = tuple(
        cable.model_copy(
            update={"exit": beside(cable.exit, 3), "attachment": beside(cable.attachment, 1)}
        )
        for cable in testbed.cables
    )
    return testbed.model_copy(update={"cables": cables})


def _each(testbed: Testbed, amounts: Array, change: Callable[[Cable, float], Cable]) -> Testbed:
    cables = tuple(
        change(cable, float(amount)) if amount else cable
        for cable, amount in zip(testbed.cables, amounts, strict=True)
    )
    return testbed.model_copy(update={"cables": cables})
