"""Faults of load cells: named alone, with an interval that holds what was planted."""

import pytest

import cspm

pytestmark = [pytest.mark.compiled, pytest.mark.slow]


def diagnosed(folder, *effects):
    """A rig with faults, each an effect, its element and its numbers, by its file without them."""
    scenario = cspm.load_scenario("one_winch")
    machine = scenario.testbed
    for effect, element, numbers in effects:
        machine = machine.with_effect(effect, element, **numbers)
    run = cspm.simulate(scenario, testbed=machine, seed=3, duration=15.0)
    recording = run.save(folder / "recorded")
    return cspm.diagnose(recording, testbed=scenario.testbed, closed_loop=False)


def test_healthy_load_cells_have_no_fault(tmp_path):
    found = diagnosed(tmp_path)
    assert (found.verdict, found.findings) == ("consistent", ())


@pytest.mark.parametrize(
    ("effect", "element", "numbers"),
    [("tension_drift", "surge", {"rate": 0.01})],
    ids=lambda each: each if isinstance(each, str) else "",
)
def test_a_fault_of_a_load_cell_is_named_alone(tmp_path, effect, element, numbers):
    (finding,) = diagnosed(tmp_path, (effect, element, numbers)).findings
    assert (finding.effect, list(finding.elements)) == (effect, [element])
    for name, truth in numbers.items():
        low, high = finding.parameters[name].ci95
        assert low <= truth <= high
