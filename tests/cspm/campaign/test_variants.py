"""The runs that a campaign's axes give."""

import shlex

import numpy as np
import pytest

from cspm.campaign.campaign import command_of
from cspm.campaign.campaign_file import CampaignFile, Range, Sample
from cspm.campaign.variants import variants_of


def campaign(**keys):
    return CampaignFile(scenario="calm", **keys)


def span(low, high, **keys):
    return Range(**{"from": low, "to": high}, **keys)


def test_a_grid_is_every_combination_the_last_axis_fastest():
    found = variants_of(campaign(grid={"seed": span(1, 3), "duration": [2.0, 4.0]}))
    assert [tuple(each.values.values()) for each in found] == [
        *((1, 2.0), (1, 4.0), (2, 2.0)),
        *((2, 4.0), (3, 2.0), (3, 4.0)),
    ]
    assert [each.number for each in found] == [*range(6)]
    assert found[1].overrides == ("seed=1", "duration=4.0")


def test_without_axes_there_is_one_run():
    assert [each.values for each in variants_of(campaign())] == [{}]


def test_points_by_hand_go_with_the_grid():
    points = ({"duration": 1.0, "rates.plant": 500}, {"duration": 2.0})
    found = variants_of(campaign(grid={"seed": [1, 2]}, points=points))
    assert [each.values for each in found] == [
        {"seed": seed, **point} for seed in (1, 2) for point in points
    ]


@pytest.mark.parametrize("scale", ["linear", "log"])
def test_a_range_has_equal_steps_in_its_scale(scale):
    axis = {"duration": span(1.0, 16.0, count=5, scale=scale)}
    values = [each.values["duration"] for each in variants_of(campaign(grid=axis))]
    measure = np.log(values) if scale == "log" else np.array(values)
    np.testing.assert_allclose(np.diff(measure), np.diff(measure)[0])
    assert (values[0], values[-1]) == (1.0, 16.0)


@pytest.mark.parametrize("method", ["latin_hypercube", "sobol"])
def test_a_sample_has_one_point_in_each_sixteenth_of_each_range(method):
    ranges = {"duration": span(2.0, 10.0), "testbed.bar.mass": span(1.0, 4.0, scale="log")}
    found = variants_of(campaign(sample=Sample(method=method, count=16, ranges=ranges)))
    columns = np.array([[*each.values.values()] for each in found])
    unit = np.stack([(columns[:, 0] - 2.0) / 8.0, np.log(columns[:, 1]) / np.log(4.0)], axis=1)
    for column in unit.T:
        assert sorted((16 * column).astype(int)) == [*range(16)]
    assert abs(np.corrcoef(unit.T)[0, 1]) < 0.5


def test_a_sample_is_its_seeds():
    def drawn(seed):
        ranges = {"duration": span(2.0, 10.0)}
        return [
            each.values
            for each in variants_of(campaign(sample=Sample(count=5, seed=seed, ranges=ranges)))
        ]

    assert drawn(1) == drawn(1)
    assert drawn(1) != drawn(2)
    assert len(drawn(1)) == 5


def test_parameters_of_an_effect_are_one_entry_and_null_leaves_it_out():
    key = "effects.winch_stribeck_friction@sway_3"
    grid = {
        f"{key}:breakaway_torque": [0.03],
        f"{key}:coulomb_torque": [0.02],
        "effects.bar_mass:mass": [None, 0.3],
    }
    first, second = variants_of(campaign(grid=grid, effects=("cable_stiffness:scale=0.9",)))
    stribeck = "winch_stribeck_friction@sway_3:breakaway_torque=0.03,coulomb_torque=0.02"
    assert first.effects == ("cable_stiffness:scale=0.9", stribeck)
    assert second.effects == ("cable_stiffness:scale=0.9", stribeck, "bar_mass:mass=0.3")


def test_whole_effects_may_be_an_axis():
    worn = "winch_coulomb_friction@sway_3:torque=0.02"
    found = variants_of(campaign(grid={"effects": [None, worn, [worn, "bar_mass:mass=0.3"]]}))
    assert [each.effects for each in found] == [(), (worn,), (worn, "bar_mass:mass=0.3")]


def test_the_command_of_a_run_has_all_that_differs():
    grid = {"seed": [4], "testbed.bar.mass": [4.4], "effects.bar_com:x": [0.01]}
    (variant,) = variants_of(campaign(grid=grid, testbed="my rig.yaml"))
    words = shlex.split(command_of(variant, "mujoco"))
    assert words == [
        *("cspm", "run", "calm", "--testbed", "my rig.yaml", "--plant", "mujoco"),
        *("--set", "seed=4", "--set", "testbed.bar.mass=4.4", "--effect", "bar_com:x=0.01"),
    ]
