"""The gallery of robots, diagnosed: nothing false on healthy ones, and what is planted is found."""

import pytest

import cspm

pytestmark = [pytest.mark.slow, pytest.mark.compiled]
ROBOTS = (
    *("planar_kntu", "stadium_camera", "suspended_four"),
    *("robocrane", "ipanema", "cogiro"),
)
# One of each kind, on robots of different degrees of freedom.
PLANTED = [
    ("stadium_camera", "winch_coulomb_friction", "north_east", "torque", 0.02),
    ("ipanema", "cable_stiffness", "c3", "scale", 0.8),
    ("planar_kntu", "winch_drum_radius", "upper_left", "radius", 0.0255),
]


def diagnosed(name, testbed, folder):
    recording = cspm.simulate(name, testbed=testbed).save(folder / name)
    return cspm.diagnose(recording, testbed=name, closed_loop=False)


@pytest.mark.parametrize("name", ROBOTS)
def test_a_healthy_one_is_consistent(name, tmp_path):
    found = diagnosed(name, cspm.load_testbed(name), tmp_path)
    assert found.verdict == "consistent"
    assert found.findings == ()


@pytest.mark.parametrize(("name", "effect", "cable", "parameter", "value"), PLANTED)
def test_what_is_planted_is_found(name, effect, cable, parameter, value, tmp_path):
    worn = cspm.load_testbed(name).with_effect(effect, cable, **{parameter: value})
    (finding,) = diagnosed(name, worn, tmp_path).findings
    assert (finding.effect, finding.elements) == (effect, (cable,))
    low, high = finding.parameters[parameter].ci95
    assert low <= value <= high
