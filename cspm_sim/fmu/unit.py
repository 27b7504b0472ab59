"""A unit of FMI 2 for co-simulation, loaded by FMPy."""

from __future__ import annotations

import weakref
from collections.abc import Callable, Iterable, Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from cspm_msgs_py.errors import DivergenceError, InputError
from cspm_msgs_py.installed.extra_library import extra_library
from cspm_msgs_py.new_folder import ScratchFolder
from cspm_sim.fmu.unit_file import UnitFile

Array = NDArray[np.float64]

EXTRA = "fmu"


class Places(NamedTuple):
    """Where a unit has some of a plant's numbers.

    Attributes:
        references: of its variables.
        scales: the plant's values over the unit's, (k,).
    """

    references: tuple[int, ...]
    scales: Array


class Unit:
    """An instance of a unit, ready to step from t = 0; it goes with its last reference.

    Attributes:
        path: of the unit.
    """

    def __init__(self, file: UnitFile) -> None:
        """Load a unit.

        Raises:
            InputError: FMPy is not installed, or the file is no unit for co-simulation that runs
                here.
        """
        self.path, self._file = file.fmu, file
        self._said: list[str] = []
        library = extra_library("fmpy", EXTRA, f"plant {file.fmu}")
        interface = extra_library("fmpy.fmi2", EXTRA, f"plant {file.fmu}")
        described = self._tried(lambda: library.read_model_description(str(file.fmu)))
        if described.fmiVersion != "2.0" or described.coSimulation is None:
            raise InputError(
                f"plant {file.fmu}: FMI {described.fmiVersion}, allowed: FMI 2.0 for co-simulation"
            )
        self._references = {
            each.name: int(each.valueReference) for each in described.modelVariables
        }
        self._slave = self._tried(lambda: self._loaded(library, interface, described))

    def _loaded(self, library: Any, interface: Any, described: Any) -> Any:  # noqa: ANN401
        folder = ScratchFolder("fmu")
        library.extract(str(self.path), unzipdir=folder.path)
        slave = interface.FMU2Slave(
            guid=described.guid,
            unzipDirectory=str(folder.path),
            modelIdentifier=described.coSimulation.modelIdentifier,
            instanceName="plant",
        )
        slave.instantiate(callbacks=_callbacks(interface, self._said))
        slave.setupExperiment(startTime=0.0)
        weakref.finalize(self, _free, slave, folder)
        return slave

    def begin(self) -> None:
        """Give the parameters, and end the unit's initialisation.

        Raises:
            InputError: it has no such parameter, or refuses to begin.
        """
        given = self._file.parameters
        places = self.places(given)
        if places is None:
            raise InputError(f"plant {self.path}: {self.absent(given)}")
        self._tried(lambda: self._begun(places, list(given.values())))

    def _begun(self, places: Places, values: Sequence[float]) -> None:
        if values:
            self._slave.setReal(places.references, values)
        self._slave.enterInitializationMode()
        self._slave.exitInitializationMode()

    def places(self, names: Iterable[str]) -> Places | None:
        """Return where the plant's variables of these names are; None where the unit lacks one."""
        wanted = [self._file.variable(name) for name in names]
        if any(each.name not in self._references for each in wanted):
            return None
        scales = np.array([each.scale for each in wanted], dtype=float)
        return Places(tuple(self._references[each.name] for each in wanted), scales)

    def absent(self, names: Iterable[str]) -> str:
        """Return in words which variables of these names the unit lacks, and which it has."""
        wanted = [self._file.variable(name).name for name in names]
        lacked = [name for name in wanted if name not in self._references]
        return f"no variable {lacked[0]}, it has: {', '.join(sorted(self._references))}"

    def read(self, places: Places) -> Array:
        """Return numbers of the plant (k,)."""
        return np.asarray(self._slave.getReal(places.references)) * places.scales

    def write(self, places: Places, values: Array) -> None:
        """Set numbers of the plant (k,)."""
        self._slave.setReal(places.references, (values / places.scales).tolist())

    def switch(self, places: Places, on: bool) -> None:
        """Set a Boolean variable."""
        self._slave.setBoolean(places.references, [on])

    def step(self, time: float, step: float) -> None:
        """Advance from `time` by `step` [s].

        Raises:
            DivergenceError: the unit gives up.
        """
        try:
            self._slave.doStep(currentCommunicationPoint=time, communicationStepSize=step)
        except Exception as err:
            reason = self._said[-1] if self._said else str(err)
            raise DivergenceError(f"t = {time:.3f} s: {self.path.name}: {reason}") from None

    def _tried(self, act: Callable[[], Any]) -> Any:  # noqa: ANN401 - whatever it returns
        """Return what an act returns that meets somebody else's file.

        Raises:
            InputError: it fails.
        """
        try:
            return act()
        except InputError:
            raise
        except Exception as err:
            reason = " ".join((self._said[-1] if self._said else str(err)).split())
            raise InputError(
                f"plant {self.path}: does not load ({reason}), allowed: a unit of FMI 2.0 for"
                " co-simulation on this system"
            ) from None


def _callbacks(interface: Any, said: list[str]) -> Any:  # noqa: ANN401 - a structure of ctypes
    """Return a unit's callbacks, which keep what it says instead of printing it."""

    def log(_: object, __: object, ___: int, ____: object, text: bytes | None) -> None:
        said.append((text or b"").decode(errors="replace"))

    found = interface.fmi2CallbackFunctions()
    found.logger = interface.fmi2CallbackLoggerTYPE(log)
    found.allocateMemory = interface.defaultCallbacks.allocateMemory
    found.freeMemory = interface.defaultCallbacks.freeMemory
    return found


def _free(slave: Any, folder: ScratchFolder) -> None:  # noqa: ANN401 - of a library without types
    slave.freeInstance()
    folder.close()
