"""The experiments that a diagnosis asks for, as scenario files that `cspm run` takes."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

from cspm_ident.diagnosis.diagnosis import Diagnosis
from cspm_ident.diagnosis.reporting.verdict import named_in
from cspm_ident.diagnosis_file import IMPROVED
from cspm_ident.experiment.choice import Question, best_answer, most_showing, safe_plans
from cspm_msgs_py.scenario import Scenario
from cspm_msgs_py.yaml_file import dump_yaml
from cspm_sim.effects import catalogue

TESTBED = "testbed.yaml"
_KEY = "separating_experiment"


def write_experiments(
    folder: Path,
    found: Diagnosis,
    data: dict[str, Any],
    progress: Callable[[str], None] = lambda _: None,
) -> None:
    """Write an experiment for each tie and one for what was not testable, and name them in `data`.

    Each stays within the excursions and speeds of the recordings. Where no such motion would show
    more than the recordings did, nothing is written, and `data` says null.

    Args:
        folder: where; exists.
        found: the diagnosis.
        data: the same as `diagnosis.json` is to have it.
        progress: called with what is being done.
    """
    ties = list(_ties(found, data))
    silent = [catalogue()[each["effect"]] for each in data["not_excited"]]
    for each in data["not_excited"]:
        each[_KEY] = None
    if not ties and not silent:
        return
    progress("experiments")
    testbed = IMPROVED if data["model"] else TESTBED
    plans = safe_plans(found.searched[0], testbed)
    files = _Files(folder)
    for entry, question, title in ties:
        answer = best_answer(found.searched, found.noise, question, plans)
        if answer is not None:
            gain = (answer.separation / max(answer.recorded, 1e-12)) ** 2
            text = f"{title}: {gain:.3g} times what as long a recording showed so far, as planned."
            entry[_KEY] = files.add(answer.scenario, text)
    best = most_showing(silent, plans)
    if best is not None:
        name = files.add(best[0], f"Shows what was not testable: {', '.join(sorted(best[1]))}.")
        for each in data["not_excited"]:
            each[_KEY] = name if each["effect"] in best[1] else None
    if files.names and testbed == TESTBED:
        (folder / TESTBED).write_text(found.searched[0].testbed.text, encoding="utf-8")


class _Files:
    """The experiments written so far, each motion once."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        self.names: dict[str, str] = {}

    def add(self, scenario: Scenario, text: str) -> str:
        """Write a scenario if its motion is new; return its file's name."""
        count = len(self.names)
        if scenario.name not in self.names:
            name = "experiment.yaml" if not count else f"experiment_{count + 1}.yaml"
            self.names[scenario.name] = name
            described = scenario.model_copy(update={"description": text})
            (self._folder / name).write_text(_scenario_text(described), encoding="utf-8")
        return self.names[scenario.name]


def _scenario_text(scenario: Scenario) -> str:
    """Return a scenario as YAML, without the keys whose values are those that they have anyway."""
    usual = Scenario(name="", testbed="", duration=1.0).model_dump(mode="json")
    content = scenario.model_dump(mode="json")
    return dump_yaml({key: value for key, value in content.items() if value != usual[key]})


def _ties(found: Diagnosis, data: dict[str, Any]) -> Iterator[tuple[dict[str, Any], Question, str]]:
    """Yield every alternative's entry, what would distinguish it, and that in words."""
    for finding, reported in zip(found.reported, named_in(data), strict=True):
        truth = {own.candidate: own.values for own in finding.coefficients}
        for rival, entry in zip(finding.alternatives, reported["alternatives"], strict=True):
            title = f"Distinguishes {finding.hypothesis.words} from {rival.words}"
            yield entry, Question(truth, rival.candidates), title
