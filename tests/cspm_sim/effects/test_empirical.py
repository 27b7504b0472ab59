"""Tables of values as effects: what they add to the plant, and how they are read back."""

import numpy as np
import pytest
from effect_snapshots import Snapshots
from machines import build, changed, entry, general_content

from cspm_model.motion import Motion
from cspm_msgs_py.errors import InputError
from cspm_msgs_py.testbed import EffectEntry
from cspm_msgs_py.testbed_keys.effect_table import EffectTable
from cspm_sim.effect_entries import read_actions
from cspm_sim.effects import catalogue
from cspm_sim.effects.empirical import table_effect
from cspm_sim.kernels.table import table_value
from cspm_sim.plant import Plant

MACHINE = build(general_content())
STILL = Motion.still(np.zeros(6))
POSE = [0.02, -0.03, 2.0, 0.05, -0.04, 0.1]
MS = 1_000_000
TORQUE = {
    "place": "winch_torque",
    "driver": "speed",
    "knots": [-3.0, -1.0, 0.5, 3.0],
    "values": [-0.04, -0.03, 0.02, 0.05],
}
TENSION = {
    "place": "cable_tension",
    "driver": "rate of elongation",
    "knots": [-0.2, 0.05, 0.2],
    "values": [-1.0, 0.5, 2.0],
}
WRENCH = {
    "place": "bar_wrench",
    "axis": "pitch",
    "driver": "pitch",
    "knots": [-0.2, 0.1, 0.3],
    "values": [0.5, -0.4, -2.0],
}
PLANE = {
    "place": "winch_torque",
    "driver": "speed",
    "knots": [-3.0, 0.1, 3.0],
    "second_driver": "tension",
    "second_knots": [0.0, 40.0],
    "values": [-0.01, -0.05, 0.0, 0.02, 0.01, 0.06],
}


def table(content):
    listed = {k: tuple(v) if isinstance(v, list) else v for k, v in content.items()}
    return EffectTable(**listed)


def planted(content):
    return EffectEntry(effect="empirical", parameters=table(content))


def left_and_model(content, cable):
    """What the nominal machine leaves over, and what the table's columns say of it."""
    snapshots, effect = Snapshots(MACHINE, [planted(content)]), table_effect(table(content))
    columns, weights = effect.regressors, np.array(content["values"])
    if content["place"] == "winch_torque":
        return snapshots.shaft_residual(cable), columns(snapshots.winch(cable)) @ weights
    if content["place"] == "cable_tension":
        return snapshots.tension_residual(cable), columns(snapshots.cable(cable)) @ weights
    return snapshots.wrench_residual(), columns(snapshots.bar()) @ weights


@pytest.mark.parametrize("content", [TORQUE, PLANE, TENSION, WRENCH], ids=lambda c: c["driver"])
@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_columns_times_values_are_what_the_nominal_machine_leaves_over(content, sign):
    content = {**content, "values": [sign * v for v in content["values"]]}
    left, model = left_and_model(content, 1)
    assert np.abs(left).max() > 1e-4
    assert model == pytest.approx(left, rel=1e-6, abs=1e-7 * np.abs(left).max())


def test_a_function_of_the_tension_is_read_at_the_whole_tension():
    """To first order in the table's slope: the driver is measured with the value in it."""
    slopes = []
    for slope in (0.02, 0.01):
        content = {**TENSION, "driver": "tension", "knots": [0.0, 200.0]}
        left, model = left_and_model({**content, "values": [0.0, 200.0 * slope]}, 4)
        slopes.append(np.abs(left - model).max() / np.abs(left).max())
    assert slopes[0] < 1e-3
    assert slopes[1] == pytest.approx(slopes[0] / 4.0, rel=0.1)


def test_between_knots_a_table_is_linear_and_beyond_the_ends_it_is_held():
    numbers = np.array([0, 3, 0, 0, 4, -1.0, 0.0, 2.0, 5.0, 1.0, 3.0])
    at = [-9.0, -1.0, -0.5, 0.0, 0.5, 2.0, 7.0]
    expected = np.interp(at, [-1.0, 0.0, 2.0], [5.0, 1.0, 3.0])
    assert [table_value(numbers, x, 0.0) for x in at] == pytest.approx(expected)


def test_two_drivers_are_bilinear_as_by_an_independent_interpolation():
    interpolate = pytest.importorskip("scipy.interpolate")
    rng = np.random.default_rng(4)
    first, second = np.array([-1.0, 0.5, 2.0]), np.array([0.0, 3.0])
    values = rng.normal(size=(3, 2))
    numbers = np.concatenate([[0, 3, 1, 2, 4], first, second, values.ravel()])
    points = rng.uniform([-1.0, 0.0], [2.0, 3.0], (20, 2))
    expected = interpolate.RegularGridInterpolator((first, second), values)(points)
    assert [table_value(numbers, *p) for p in points] == pytest.approx(expected)


def final_speeds(effects):
    machine = build({**general_content(), "effects": effects})
    plant = Plant(machine, STILL, MS, bar_pose=POSE)
    held = plant.tensions * plant.parameters.cables[:, 0] * 0.0
    for _ in range(200):
        plant.step(held)
    return plant.speeds.copy()


def test_a_table_of_dry_friction_is_the_effect_of_that_name():
    """Two knots on either side of rest, closer than any speed, are Coulomb friction."""
    tabled = {"effect": "empirical", "elements": ["c2"], "parameters": None}
    tabled["parameters"] = {**TORQUE, "knots": [-1e-9, 1e-9], "values": [-0.03, 0.03]}
    named = entry("winch_coulomb_friction", ["c2"], torque=0.03)
    free = final_speeds([])
    assert final_speeds([tabled]) == pytest.approx(final_speeds([named]), rel=1e-3)
    assert np.abs(final_speeds([named]) - free).max() > 1e-2 * np.abs(free).max()


def test_a_table_of_zeros_changes_nothing():
    zeros = [
        {"effect": "empirical", "parameters": {**c, "values": [0.0] * len(c["values"])}}
        for c in (TORQUE, TENSION, WRENCH)
    ]
    assert final_speeds(zeros) == pytest.approx(final_speeds([]), abs=1e-12)


def test_an_entry_written_back_is_the_same_entry():
    content = {**WRENCH, "unit": "N·m", "note": "as measured"}
    (action,) = read_actions(MACHINE.model_copy(update={"effects": (planted(content),)}))
    assert action.effect.entry(("bar",), action.values) == EffectEntry(
        effect="empirical", elements=("bar",), parameters=table(content)
    )


def test_tables_of_one_winch_are_distinguished_and_no_named_effect_is_a_table():
    by_speed, by_tension = (
        table_effect(table({**TORQUE, "driver": d})) for d in ("speed", "angle")
    )
    assert by_speed.id == by_tension.id == "empirical"
    assert by_speed.key != by_tension.key
    assert "empirical" not in catalogue()


@pytest.mark.parametrize(
    ("wrong", "line"),
    [
        (
            {"knots": [1.0, 0.0, 2.0, 3.0]},
            "parameters.knots: [1.0, 0.0, 2.0, 3.0] …, allowed: two or",
        ),
        (
            {"driver": "heat"},
            "parameters.driver: 'heat', allowed at winch_torque: speed, angle, ten",
        ),
        ({"values": [1.0, 2.0]}, "parameters.values: 2 of them, allowed: 4, one per knot"),
        ({"axis": "surge"}, "parameters.axis: 'surge', allowed: none, as winch_torque has no axes"),
        ({"unit": "N"}, "parameters.unit: 'N', allowed: N·m or none"),
        ({"second_driver": "tension"}, "parameters.second_knots: [] …, allowed: two or more"),
        ({"second_knots": [0.0, 1.0]}, "parameters.second_knots: 2 of them, allowed: two or more"),
        (
            {"place": "bar_wrench", "driver": "surge"},
            "parameters.axis: missing, allowed: surge, sw",
        ),
    ],
)
def test_a_table_that_cannot_be_used_is_refused_by_name(wrong, line):
    content = changed(general_content(), "effects", [])
    content["effects"] = [{"effect": "empirical", "parameters": {**TORQUE, **wrong}}]
    with pytest.raises(InputError) as refused:
        build(content)
    assert f"effects[0].{line}" in str(refused.value)


@pytest.mark.parametrize(
    ("effect", "parameters"), [("empirical", {"torque": 0.1}), ("winch_torque_offset", TORQUE)]
)
def test_numbers_and_tables_are_not_taken_for_each_other(effect, parameters):
    with pytest.raises(InputError, match="another kind, allowed: a table of knots and values"):
        build({**general_content(), "effects": [{"effect": effect, "parameters": parameters}]})


def test_a_table_on_a_machine_without_the_part_is_refused():
    with pytest.raises(InputError, match="no element 'c9', allowed: "):
        read_actions(
            MACHINE.model_copy(
                update={
                    "effects": (
                        EffectEntry(effect="empirical", elements=("c9",), parameters=table(TORQUE)),
                    )
                }
            )
        )
