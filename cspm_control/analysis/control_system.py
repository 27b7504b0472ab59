"""The linear model as python-control knows it."""

from __future__ import annotations

import control

from cspm_model.linearisation import StateSpace


def control_system(model: StateSpace) -> control.StateSpace:
    """Return the model with the same matrices and the same names of states, inputs and outputs."""
    names = [
        # python-control takes a dot for the separator of system and signal.
        [name.replace(".", "_") for name in group]
        for group in (model.inputs, model.outputs, model.states)
    ]
    return control.ss(
        model.A, model.B, model.C, model.D, inputs=names[0], outputs=names[1], states=names[2]
    )
