"""A cable-suspended test-bed in software: simulate it, record it, and say what the model lacks.

    import cspm

    thesis = cspm.load_testbed("thesis")
    worn = thesis.with_effect("winch_coulomb_friction", "sway_3", torque=0.03)
    run = cspm.simulate("calm", testbed=worn, duration=30)
    print(run.tension["sway_3"].max())

All quantities are in SI units and radians, z points down. Whatever is wrong with what is given,
`InputError` carries one line: what, where, what is allowed.

What meets a ROS 2 graph is in the submodule `cspm.graph`: `replay`, `run_node`, `check_drivers`.
Other names that are not in `__all__` are internal and change without notice.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from cspm.analysis.design import analyze_design as analyze_design
    from cspm.analysis.linear import analyze_linear as analyze_linear
    from cspm.analysis.manipulability import analyze_manipulability as analyze_manipulability
    from cspm.analysis.workspace import analyze_workspace as analyze_workspace
    from cspm.catalogue import effects as effects
    from cspm.catalogue import use_effects as use_effects
    from cspm.comparison import compare as compare
    from cspm.controller import Controller as Controller
    from cspm.controller import builtin_controller as builtin_controller
    from cspm.diagnosis import Diagnosis as Diagnosis
    from cspm.diagnosis import Finding as Finding
    from cspm.diagnosis import diagnose as diagnose
    from cspm.identification.cables import identify_damping as identify_damping
    from cspm.identification.cables import identify_stiffness as identify_stiffness
    from cspm.identification.geometry import identify_geometry as identify_geometry
    from cspm.identification.identified import Identification as Identification
    from cspm.identification.system import identify_system as identify_system
    from cspm.identification.winches import identify_winch as identify_winch
    from cspm.importing import import_recording as import_recording
    from cspm.many import simulate_many as simulate_many
    from cspm.recorded import Recording as Recording
    from cspm.recorded import open as open
    from cspm.scenario import Scenario as Scenario
    from cspm.scenario import load_scenario as load_scenario
    from cspm.signals import Signal as Signal
    from cspm.simulation import Run as Run
    from cspm.simulation import simulate as simulate
    from cspm.testbed import Testbed as Testbed
    from cspm.testbed import load_testbed as load_testbed
    from cspm_msgs_py.errors import CspmError as CspmError
    from cspm_msgs_py.errors import InputError as InputError

# Loaded when they are first asked for, so that `import cspm` is quick and needs little.
_PLACES = {
    "Controller": "cspm.controller",
    "CspmError": "cspm_msgs_py.errors",
    "Diagnosis": "cspm.diagnosis",
    "Finding": "cspm.diagnosis",
    "Identification": "cspm.identification.identified",
    "InputError": "cspm_msgs_py.errors",
    "Recording": "cspm.recorded",
    "Run": "cspm.simulation",
    "Scenario": "cspm.scenario",
    "Signal": "cspm.signals",
    "Testbed": "cspm.testbed",
    "analyze_design": "cspm.analysis.design",
    "analyze_linear": "cspm.analysis.linear",
    "analyze_manipulability": "cspm.analysis.manipulability",
    "analyze_workspace": "cspm.analysis.workspace",
    "builtin_controller": "cspm.controller",
    "compare": "cspm.comparison",
    "diagnose": "cspm.diagnosis",
    "effects": "cspm.catalogue",
    "identify_damping": "cspm.identification.cables",
    "identify_stiffness": "cspm.identification.cables",
    "identify_geometry": "cspm.identification.geometry",
    "identify_system": "cspm.identification.system",
    "identify_winch": "cspm.identification.winches",
    "import_recording": "cspm.importing",
    "load_scenario": "cspm.scenario",
    "load_testbed": "cspm.testbed",
    "open": "cspm.recorded",
    "simulate": "cspm.simulation",
    "simulate_many": "cspm.many",
    "use_effects": "cspm.catalogue",
}
__all__ = [*_PLACES]


def __getattr__(name: str) -> Any:  # noqa: ANN401 - whatever the door leads to
    if name not in _PLACES:
        raise AttributeError(f"module 'cspm' has no attribute {name!r}")
    found = getattr(import_module(_PLACES[name]), name)
    globals()[name] = found
    return found


def __dir__() -> list[str]:
    return sorted(__all__)
