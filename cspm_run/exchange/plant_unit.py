"""The plant of a scenario as a unit of FMI 2 for co-simulation, in PythonFMU's terms."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
from pythonfmu import Boolean, Fmi2Causality, Fmi2Slave, Fmi2Variability, Real
from pythonfmu.default_experiment import DefaultExperiment
from pythonfmu.enums import Fmi2Status

from cspm_model.kernels.rows import bar_twist_row
from cspm_msgs_py.errors import CspmError
from cspm_run.assembly import assemble_simulator
from cspm_run.bundle import read_bundle
from cspm_sim.fmu.variables import (
    ANGLE,
    BRAKE,
    COMMAND,
    FRAME,
    LENGTH,
    MEANINGS,
    POSE,
    RUN_FOLDER,
    SPEED,
    TENSION,
    TORQUE,
    TWIST,
    names_of,
    outputs_of,
)

# A step may miss a whole number of periods by so much of one.
TOLERANCE = 1e-6


class PlantUnit(Fmi2Slave):  # type: ignore[misc] # PythonFMU has no types
    """The plant of a scenario: torques in, pose, angles and tensions out, without sensors.

    It moves by whole periods of the scenario's plant, with the torques held.
    """

    def __init__(self, **given: object) -> None:
        """Put the plant at rest; `given` has PythonFMU's `instance_name` and `resources`."""
        super().__init__(**given)
        folder = Path(str(given["resources"])) / RUN_FOLDER
        files = {path.name: path.read_bytes() for path in folder.iterdir()}
        bundle = read_bundle(files, str(folder))
        with bundle.unpacked() as place:
            scenario, testbed = bundle.scenario, bundle.testbed.testbed
            self._plant, _, _ = assemble_simulator(scenario, testbed, place, bundle.plant)
        self.modelName, self.author = scenario.name, "cspm"
        self.description = f"{testbed.name}, in the scenario {scenario.name}"
        self._period = 1.0 / scenario.rates.plant
        self.default_experiment = DefaultExperiment(0.0, scenario.duration, self._period)
        radii = np.array([cable.wound_radius for cable in testbed.cables])
        self._torque = radii * self._plant.tensions
        self._twist = np.zeros(6)
        self._register()

    def do_step(self, current_time: float, step_size: float) -> bool:
        """Advance by whole periods; return whether the plant could."""
        periods = round(step_size / self._period)
        if periods < 1 or abs(step_size - periods * self._period) > TOLERANCE * self._period:
            self.log(
                f"step of {step_size:g} s, allowed: multiples of {self._period:g} s",
                Fmi2Status.error,
            )
            return False
        try:
            for _ in range(periods):
                self._plant.step(self._torque)
        except CspmError as err:
            self.log(str(err), Fmi2Status.error)
            return False
        return True

    def _register(self) -> None:
        testbed, plant = self._plant.testbed, self._plant
        for i, name in enumerate(names_of(COMMAND, testbed)):
            self._add(name, COMMAND, self._element(lambda: self._torque, i), self._setter(i))
        brake = Boolean(
            BRAKE,
            causality=Fmi2Causality.input,
            variability=Fmi2Variability.discrete,
            description="holds all motors still",
            start=plant.locked,
            getter=lambda: plant.locked,
            setter=lambda value: setattr(plant, "locked", bool(value)),
        )
        self.register_variable(brake, nested=False)
        sources: dict[str, Callable[[], object]] = {
            POSE: lambda: plant.bar_state,
            TWIST: self._bar_twist,
            FRAME: lambda: plant.frame,
            ANGLE: lambda: plant.angles,
            SPEED: lambda: plant.speeds,
            TORQUE: lambda: plant.applied_torque(self._torque),
            TENSION: lambda: plant.tensions,
            LENGTH: lambda: plant.unstretched_lengths,
        }
        for quantity in outputs_of(testbed):
            for i, name in enumerate(names_of(quantity, testbed)):
                self._add(name, quantity, self._element(sources[quantity], i))

    def _add(
        self,
        name: str,
        quantity: str,
        getter: Callable[[], float],
        setter: Callable[[float], None] | None = None,
    ) -> None:
        """Register an input, where there is a setter, or an output."""
        causality = Fmi2Causality.output if setter is None else Fmi2Causality.input
        variable = Real(
            name,
            causality=causality,
            variability=Fmi2Variability.continuous,
            description=MEANINGS[quantity],
            start=None if setter is None else getter(),
            getter=getter,
            setter=setter,
        )
        self.register_variable(variable, nested=False)

    def _element(self, source: Callable[[], object], i: int) -> Callable[[], float]:
        return lambda: float(np.asarray(source())[i])

    def _setter(self, i: int) -> Callable[[float], None]:
        def set_torque(value: float) -> None:
            self._torque[i] = value

        return set_torque

    def _bar_twist(self) -> object:
        bar_twist_row(self._plant.bar_state, self._twist)
        return self._twist
