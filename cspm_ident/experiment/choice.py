"""The experiment that best separates explanations, of those that are safe on the machine."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from cspm_ident.diagnosis.residuals.recorded_equations import equations_of
from cspm_ident.diagnosis.residuals.regressors import Candidate, Place, shapes_of
from cspm_ident.diagnosis.residuals.residual_equation import Equation, steady
from cspm_ident.experiment.excitations import excitations
from cspm_ident.experiment.plan import Plan, planned
from cspm_ident.experiment.separation import decided, with_shape
from cspm_ident.signals.measurement import Measurement
from cspm_msgs_py.errors import SingularityError
from cspm_msgs_py.scenario import Scenario
from cspm_msgs_py.testbed import Testbed
from cspm_sim.effects import Effect

Array = NDArray[np.float64]

_SHARES = (1.0, 0.5, 0.25)
# Of the largest tensions and torques that the test-bed file allows.
_LOAD_SHARE = 0.9
# A wrench is missed for a moment where cables reach their least tension; not for long.
_MISSED, _MISSED_TIME = 0.05, 0.1
# Standard errors by which an experiment has to separate explanations.
_TELLS = 3.0


@dataclass(frozen=True, eq=False)
class Question:
    """What an experiment is to answer.

    Attributes:
        truth: one explanation, its candidates with the weights found.
        rivals: the other's candidates; empty: whether the first shows at all.
    """

    truth: Mapping[Candidate, Array]
    rivals: tuple[Candidate, ...]

    @property
    def effects(self) -> list[Effect]:
        """Both explanations' effects, each with its own nonlinear parameters alone."""
        return list({c.effect_id: with_shape(c) for c in (*self.truth, *self.rivals)}.values())


class Answer(NamedTuple):
    """The best experiment for a question.

    Attributes:
        scenario: what to run.
        separation: of the planned experiment, see `decided`, per root of a second.
        recorded: of the recordings so far, likewise.
    """

    scenario: Scenario
    separation: float
    recorded: float


def safe_plans(measurement: Measurement, testbed: str) -> list[tuple[Scenario, Plan]]:
    """Return each excitation, as large as tensions, torques and wrench allow, with its plan.

    Args:
        measurement: whose excursions and speeds none exceeds.
        testbed: the test-bed file's name, as the scenarios are to have it.
    """
    found: dict[str, tuple[Scenario, Plan]] = {}
    for share in _SHARES:
        for scenario in excitations(measurement, testbed, share):
            if scenario.name in found:
                continue
            try:
                plan = planned(scenario, measurement.testbed)
            except SingularityError:
                continue
            if is_safe(plan, measurement.machine):
                found[scenario.name] = scenario, plan
    return list(found.values())


def is_safe(plan: Plan, machine: Testbed) -> bool:
    """Return whether tensions and torques keep clear of their limits and the bar can follow."""
    measured = plan.measurement
    torques, tensions = measured.torque, measured.tension
    limit = _LOAD_SHARE * np.array([cable.torque_limit for cable in machine.cables])
    if torques is not None and np.any(np.abs(torques.values) > limit):
        return False
    if tensions is not None:
        limits = [cable.tension_limits or (0.0, np.inf) for cable in machine.cables]
        low, high = np.array(limits).T
        if np.any(tensions.values > _LOAD_SHARE * high) or np.any(tensions.values < low - 1e-6):
            return False
    return float(np.mean(plan.missed > _MISSED)) <= _MISSED_TIME


def best_answer(
    recorded: Sequence[Measurement],
    noise: Mapping[Place, Array],
    question: Question,
    plans: Sequence[tuple[Scenario, Plan]],
) -> Answer | None:
    """Return the experiment that answers a question best.

    None where none beats the recordings, or none separates the pair: two that do the same to every
    residual differ by rounding alone, or by less than the model-form error.

    Args:
        recorded: the recordings so far.
        noise: of each residual.
        question: what is to be separated.
        plans: what may be run.
    """
    effects = question.effects
    parts = steady([equations_of(measurement, effects) for measurement in recorded])
    so_far = _rate([e for part in parts for e in part], noise, question, recorded)
    answers = []
    for scenario, plan in plans:
        (equations,) = steady([equations_of(plan.measurement, effects)])
        rate = _rate(equations, noise, question, [plan.measurement])
        answers.append(Answer(scenario, rate, so_far))
    best = max(answers, key=lambda answer: answer.separation, default=None)
    if best is None or best.separation <= so_far:
        return None
    return best if best.separation * best.scenario.duration**0.5 > _TELLS else None


def _rate(
    equations: Sequence[Equation],
    noise: Mapping[Place, Array],
    question: Question,
    measured: Sequence[Measurement],
) -> float:
    whole = decided(equations, noise, question.truth, question.rivals)
    return whole / float(np.sqrt(sum(each.duration for each in measured)))


def most_showing(
    effects: Sequence[Effect], plans: Sequence[tuple[Scenario, Plan]]
) -> tuple[Scenario, frozenset[str]] | None:
    """Return the experiment in which most of some effects show, and their ids; None if none does.

    Args:
        effects: those that recordings so far could not show.
        plans: what may be run.
    """
    # Whether an effect shows at all does not hang on where in its grid it is.
    effects = [with_shape(Candidate(e, "", next(shapes_of(e)))) for e in effects]
    shown = []
    for scenario, plan in plans:
        columns = [e.columns.items() for e in equations_of(plan.measurement, effects)]
        seen = {
            term.effect_id
            for items in columns
            for term, values in items
            if isinstance(term, Candidate) and np.any(values)
        }
        shown.append((scenario, frozenset(seen)))
    best = max(shown, key=lambda each: len(each[1]), default=None)
    return best if best is not None and best[1] else None
