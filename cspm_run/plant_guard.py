"""The simulated plant's watchdog as a scenario describes it."""

from __future__ import annotations

from cspm_control.safe_state import make_safe_state
from cspm_msgs_py.scenario import Scenario
from cspm_sim.any_plant import AnyPlant
from cspm_sim.watchdog import Watchdog


def make_watchdog(scenario: Scenario, plant: AnyPlant, oldest_ns: int | None = None) -> Watchdog:
    """Return the watchdog of a scenario's plant.

    `oldest_ns` is how old the state may be that the torques in force answer [ns]; None: any age.

    Raises:
        InputError: it is to hold the bar where the bar cannot hang.
    """
    state = make_safe_state(scenario, plant.testbed)
    return Watchdog(plant, state, scenario.safety.watchdog, oldest_ns)
