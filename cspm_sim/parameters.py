"""A test-bed's parameter arrays for the plant, its effects included."""

from __future__ import annotations

from numba import typeof

from cspm_model.kernels.machine import PlantParameters
from cspm_model.kernels.native import address_of
from cspm_model.parameters import nominal_parameters, plant_states
from cspm_msgs_py.testbed import Testbed
from cspm_sim.effect_entries import altered_testbed, hook_rows, read_actions
from cspm_sim.kernels.affected_cables import affected_cables, affected_signature
from cspm_sim.kernels.bar_effects import effects_on_bar, on_bar_signature
from cspm_sim.kernels.hooks import AFFECTED, ATTACHMENT, HOOK, ON_BAR, WINCH, check_order


def plant_parameters(testbed: Testbed) -> PlantParameters:
    """Return the kernels' parameters of a machine, its effects included.

    Raises:
        InputError: an effect, one of its elements or parameters is unknown or out of bounds.
    """
    actions = read_actions(testbed)
    nominal = nominal_parameters(altered_testbed(testbed, actions))
    effects, effect_parameters = hook_rows(actions, plant_states(testbed))
    check_order(effects)
    # What many machines do not need is compiled for those that do.
    kind = typeof(nominal.cables)
    if (effects[:, HOOK] < WINCH).any():
        effects[:, AFFECTED] = address_of(affected_cables, affected_signature(kind))
    if (effects[:, HOOK] >= ATTACHMENT).any():
        effects[:, ON_BAR] = address_of(effects_on_bar, on_bar_signature(kind))
    return nominal._replace(effects=effects, effect_parameters=effect_parameters)
