"""The linear models of a machine about rest."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from cspm.analysis.machine import DEFAULT_SCENARIO, AnalyzedMachine, analyzed_machine
from cspm.scenario import AnyScenario
from cspm.testbed import AnyTestbed
from cspm_control.analysis.claim import Claim
from cspm_control.analysis.gain import condition
from cspm_control.analysis.linear import (
    LOW,
    LinearAnalyses,
    LinearAnalysis,
    SubsystemAnalysis,
    analyse_linear,
)
from cspm_control.analysis.mode import Mode
from cspm_control.analysis.published_linear import EXACT, FROZEN, linear_claims
from cspm_model.linearisation import StateSpace
from cspm_msgs_py.errors import InputError
from cspm_msgs_py.new_folder import new_folder
from cspm_run.output.json_file import write_json

if TYPE_CHECKING:
    import control

PICTURE = "linear.png"
MODEL = "model.json"
PARTS = ("plant", "motion", "tension")


@dataclass(frozen=True, eq=False, repr=False)
class Linear:
    """The linear models of a machine about a state of rest.

    Attributes:
        machine: what was analysed, and where.
        result: both models with modes and gains, internal.
        claims: the thesis's figures beside ours, where they are of this machine at this pose.
    """

    machine: AnalyzedMachine
    result: LinearAnalyses
    claims: tuple[Claim, ...]

    @property
    def modes(self) -> list[Mode]:
        """Modes of the exact model, slowest first: `frequency` [rad/s], `damping`, `words`."""
        return self.result.exact.modes

    def to_control(self, part: str = "plant", *, exact: bool = True) -> control.StateSpace:
        """Return a model for python-control, with named states, inputs and outputs.

        Args:
            part: `plant`, motor torques to pose, pose rate and tensions; `motion`, wanted wrench to
                pose; `tension`, motor torques to tensions.
            exact: whether cables turn; else their directions are held, as in the thesis.

        Raises:
            InputError: no such part.
        """
        from cspm_control.analysis.control_system import control_system

        models = _models(self.result.exact if exact else self.result.frozen)
        if part not in models:
            raise InputError(f"part {part}: allowed: {', '.join(models)}")
        return control_system(models[part])

    def data(self) -> dict[str, Any]:
        """Return everything as plain data: what `cspm analyze linear --json` writes."""
        return _data(self.machine, self.result, self.claims)

    def write(self, folder: str | Path) -> tuple[Path, Path]:
        """Write the picture and the models' matrices; return their paths.

        Args:
            folder: a new one.

        Raises:
            InputError: the folder exists.
        """
        place = new_folder(folder)
        from cspm.plots.linear_figure import draw_linear

        draw_linear(place / PICTURE, self.result, self.machine.testbed.cable_names)
        write_json(place / MODEL, _models_data(self.result))
        return place / PICTURE, place / MODEL


def analyze_linear(
    scenario: AnyScenario = DEFAULT_SCENARIO,
    *,
    testbed: AnyTestbed | None = None,
    pose: Sequence[float] | None = None,
) -> Linear:
    """Linearise a machine about rest: `cspm analyze linear`.

    Args:
        scenario: whose machine is analysed.
        testbed: a machine instead of the scenario's.
        pose: of the bar, x y z φ θ ψ in world_ned [m, rad]; None: where controllers are designed.

    Raises:
        InputError: no such scenario or test-bed, or a machine without bar.
        CspmError: the bar cannot hang there.

    Examples:
        >>> import cspm
        >>> linear = cspm.analyze_linear("worst_case")
        >>> linear.to_control("tension").ninputs
        8
    """
    return linear_of(analyzed_machine(scenario, testbed, pose))


def linear_of(machine: AnalyzedMachine) -> Linear:
    """Return the analysis of a machine; see `analyze_linear`."""
    found = analyse_linear(machine.testbed, machine.pose)
    names = machine.testbed.cable_names
    claims = linear_claims(found, names) if machine.is_published else []
    return Linear(machine, found, tuple(claims))


def _models(analysis: LinearAnalysis) -> dict[str, StateSpace]:
    models = (analysis.model, analysis.motion.system, analysis.tension.system)
    return dict(zip(PARTS, models, strict=True))


def _models_data(found: LinearAnalyses) -> dict[str, Any]:
    return {
        way: {name: _model_data(model) for name, model in _models(analysis).items()}
        for way, analysis in ((FROZEN, found.frozen), (EXACT, found.exact))
    }


def _model_data(model: StateSpace) -> dict[str, Any]:
    matrices = {name: getattr(model, name).tolist() for name in "ABCD"}
    return {**matrices, "states": model.states, "inputs": model.inputs, "outputs": model.outputs}


def _data(
    machine: AnalyzedMachine, found: LinearAnalyses, claims: Sequence[Claim]
) -> dict[str, Any]:
    point = found.point
    return {
        "testbed": machine.testbed.name,
        "pose": point.bar_pose.tolist(),
        "tensions": dict(zip(machine.testbed.cable_names, point.tensions.tolist(), strict=True)),
        "rank": found.rank,
        FROZEN: _analysis_data(found.frozen),
        EXACT: _analysis_data(found.exact),
        "claims": [claim.data() for claim in claims],
    }


def _analysis_data(analysis: LinearAnalysis) -> dict[str, Any]:
    return {
        "modes": [
            {
                "pole": [mode.pole.real, mode.pole.imag],
                "frequency": mode.frequency,
                "damping": mode.damping,
                "shape": mode.words,
            }
            for mode in analysis.modes
        ],
        "poles_at_zero": analysis.drifting,
        "motion": _subsystem_data(analysis.motion),
        "tension": _subsystem_data(analysis.tension),
    }


def _subsystem_data(part: SubsystemAnalysis) -> dict[str, Any]:
    return {
        "at_rad_s": LOW,
        "singular_values": part.low.gains.tolist(),
        "condition": condition(part.low.gains),
        "relative_gains": part.relative[0].real.tolist(),
    }
