"""How old the state may be that a command to the drives answers, by the scenario's loops."""

from __future__ import annotations

import math

from cspm_control.analysis.delay_margin import largest_age
from cspm_msgs_py.errors import ConvergenceError, InputError
from cspm_msgs_py.schedule import FORCE_CONTROLLER
from cspm_run.bundle import Bundle


def lateness_ns(bundle: Bundle) -> int | None:
    """Return the largest age [ns]: `safety.lateness`, else what the loops' margin allows.

    None where nothing says: no closed loop, a force controller of the user's own, or rates that
    `cspm analyze design` cannot follow.
    """
    scenario = bundle.scenario
    wanted = scenario.safety.lateness
    if wanted is not None:
        return round(wanted * 1e9)
    if scenario.control.mode != "closed_loop" or FORCE_CONTROLLER in scenario.controllers:
        return None
    try:
        found = largest_age(scenario, bundle.testbed.testbed)
    except (InputError, ConvergenceError):
        return None
    return None if math.isinf(found) else round(found * 1e9)
