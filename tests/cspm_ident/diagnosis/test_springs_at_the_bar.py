"""Springs at the bar, and what readings that are noise alone must not be taken for.

The moment on a bar is its inertia times the second derivative of its angles. Where these are noise,
both correlate; a spring would be found on every machine that does not turn.
"""

import pytest

import cspm

SPRINGS = {"surge": 20.0, "sway": 20.0, "heave": 40.0, "rest_heave": 2.0}
ANGLES = ("roll", "pitch", "yaw")
ALL = {"surge": 15.0, "sway": 15.0, "heave": 30.0, "rest_heave": 2.0} | dict.fromkeys(ANGLES, 0.5)

pytestmark = [pytest.mark.compiled, pytest.mark.slow]


def diagnosed(folder, scenario, seed, duration, springs):
    scenario = cspm.load_scenario(scenario)
    machine = scenario.testbed
    if springs:
        machine = machine.with_effect("bar_restoring", **dict.fromkeys(ANGLES, 0.0) | springs)
    run = cspm.simulate(scenario, testbed=machine, seed=seed, duration=duration)
    recording = run.save(folder / "recorded")
    return cspm.diagnose(recording, testbed=scenario.testbed, closed_loop=False)


@pytest.mark.parametrize("seed", [1565, 1570])
def test_a_healthy_camera_that_does_not_turn_has_no_springs(tmp_path, seed):
    assert diagnosed(tmp_path, "stadium_camera", seed, 12.0, {}).verdict == "consistent"


def test_springs_along_what_moves_are_found_and_of_angles_nothing_is_said(tmp_path):
    found = diagnosed(tmp_path, "stadium_camera", 5, 12.0, SPRINGS)
    assert [each.effect for each in found.findings] == ["bar_restoring"]
    numbers = found.findings[0].parameters
    for name, value in SPRINGS.items():
        low, high = numbers[name].ci95
        assert low <= value <= high
        assert high - low < 0.5 * value
    assert [numbers[name].ci95 for name in ANGLES] == [None] * 3


def test_springs_are_not_taken_for_a_bar_without_mass(tmp_path):
    """A waving bar's spring and mass are nearly collinear, and a mass of 0 leaves no noise."""
    found = diagnosed(tmp_path, "calm", 5, 20.0, ALL)
    assert [each.effect for each in found.findings] == ["bar_restoring"]
    for name, value in ALL.items():
        low, high = found.findings[0].parameters[name].ci95
        assert low <= value <= high
