"""Effects that are other parameters, and machines with all effects at once."""

import numpy as np
import pytest
from machines import build, changed, entry, general_content, pulley_content, route_content

from cspm_model.equilibrium import gravity_wrench
from cspm_model.kinematics import geometry, rotation
from cspm_model.motion import Motion
from cspm_model.parameters import nominal_parameters
from cspm_msgs_py.errors import InputError
from cspm_sim.effects import Elements, catalogue
from cspm_sim.parameters import plant_parameters
from cspm_sim.plant import Plant

STILL = Motion.still(np.zeros(6))
POSE = [0.02, -0.03, 2.0, 0.05, -0.04, 0.1]
MS = 1_000_000
DOFS = ("surge", "sway", "heave", "roll", "pitch", "yaw")


def moved(point, offset):
    return (np.array(offset[:3]) + rotation(offset) @ np.array(point)).tolist()


OFFSET = dict(zip(DOFS, (0.01, 0.02, -0.03, 0.05, -0.04, 0.02), strict=True))
EXITS = {
    f"cables.{i}.exit": moved(c["exit"], list(OFFSET.values()))
    for i, c in enumerate(general_content()["cables"])
}
ALTERED = [
    (entry("winch_inertia", ["c2"], inertia=1e-4), {"cables.2.rotor_inertia": 3.4e-4}),
    (entry("winch_drum_radius", ["c2"], radius=0.005), {"cables.2.drum_radius": 0.03}),
    (entry("cable_length_offset", ["c2"], offset=-0.1), {"cables.2.offset_length": 0.2}),
    (
        entry("cable_exit_offset", ["c2"], x=0.01, y=-0.02, z=0.03),
        {"cables.2.exit": [-0.94, 0.73, -0.35]},
    ),
    (
        entry("cable_attachment_offset", ["c2"], x=0.01, y=-0.02, z=0.03),
        {"cables.2.attachment": [-0.40, 0.16, 0.09]},
    ),
    (
        entry("pulley_radius", ["c2"], radius=0.02),
        {"cables.2.pulley": {"radius": 0.02, "axis": [0.0, 0.0, -1.0]}},
    ),
    (entry("cable_axial_damping", ["c2"], scale=1.5), {"cables.2.damping.factor": 1.5}),
    (
        entry("cable_stiffness", ["c2"], scale=1.25),
        {"cables.2.stiffness.a": 8750.0, "cables.2.stiffness.youngs_modulus": 1.25 * 8.721e9},
    ),
    (entry("bar_mass", mass=-0.5), {"bar.mass": 4.5}),
    (entry("bar_com", x=0.01, y=0.02, z=-0.03), {"bar.com": [0.04, 0.0, 0.02]}),
    (
        entry("bar_inertia", ixx=0.01, iyy=-0.01, izz=0.01),
        {"bar.inertia.ixx": 0.09, "bar.inertia.iyy": 0.30, "bar.inertia.izz": 0.36},
    ),
    (entry("frame_pose_offset", **OFFSET), EXITS),
]


def test_all_that_alter_are_tested_here():
    alter = {effect.id for effect in catalogue().values() if effect.physics.alter}
    assert {with_effect["effect"] for with_effect, _ in ALTERED} == alter


@pytest.mark.parametrize(("with_effect", "numbers"), ALTERED, ids=[e["effect"] for e, _ in ALTERED])
def test_an_altered_machine_is_one_whose_file_says_so(with_effect, numbers):
    content = general_content()
    found = plant_parameters(build({**content, "effects": [with_effect]}))
    for path, value in numbers.items():
        content = changed(content, path, value)
    expected = plant_parameters(build(content))
    nominal = plant_parameters(build(general_content()))
    for name, a, b in zip(found._fields, found, expected, strict=True):
        assert a == pytest.approx(b, rel=1e-12, abs=1e-15), name
    assert any((a != b).any() for a, b in zip(found, nominal, strict=True))
    assert len(found.effects) == 0


@pytest.mark.parametrize("content", [pulley_content(), route_content()], ids=["pulleys", "routes"])
def test_pulleys_and_stops_go_with_a_frame_that_is_beside_where_it_seems(content):
    effect = entry("frame_pose_offset", **OFFSET)
    found = plant_parameters(build({**content, "effects": [effect]})).cables
    expected = geometry(nominal_parameters(build(content)).cables, POSE, list(OFFSET.values()))
    beside = geometry(found, POSE, np.zeros(6))
    assert beside.lengths == pytest.approx(expected.lengths, abs=1e-12)
    assert beside.bar == pytest.approx(expected.bar, abs=1e-12)


def test_an_end_takes_the_stop_of_its_route_with_it():
    for effect, at in (("cable_exit_offset", 0), ("cable_attachment_offset", 1)):
        content = route_content()
        offset = entry(effect, ["c1"], x=0.01, y=-0.02, z=0.03)
        found = plant_parameters(build({**content, "effects": [offset]}))
        place = content["cables"][1]["route"][at]["at"] + np.array([0.01, -0.02, 0.03])
        expected = build(changed(content, f"cables.1.route.{at}.at", place.tolist()))
        np.testing.assert_array_equal(found.cables, plant_parameters(expected).cables)


@pytest.mark.parametrize(
    ("path", "value", "message"),
    [
        (
            "cables.0.route",
            route_content()["cables"][0]["route"],
            "c0 has a route, allowed: cables",
        ),
        ("cables.0.parts", 2, "c0 has 2 parts, allowed: cables of one part"),
    ],
)
def test_what_is_derived_for_one_span_is_refused_of_several(path, value, message):
    content = {**general_content(), "effects": [entry("cable_sag", ["c0"], linear_density=0.01)]}
    plant_parameters(build(content))
    if path.endswith("route"):
        content = changed(changed(content, "cables.0.exit", None), "cables.0.attachment", None)
    with pytest.raises(InputError, match=message):
        plant_parameters(build(changed(content, path, value)))


@pytest.mark.parametrize("effect", [e for e, _ in ALTERED], ids=lambda e: e["effect"])
def test_controllers_know_the_machine_without_effects(effect):
    testbed = build({**general_content(), "effects": [effect]})
    known, nominal = nominal_parameters(testbed), plant_parameters(build(general_content()))
    assert all((a == b).all() for a, b in zip(known, nominal, strict=True))


def test_two_alterations_add_up():
    twice = [entry("bar_mass", mass=1.0), entry("bar_mass", mass=0.5)]
    assert plant_parameters(build({**general_content(), "effects": twice})).bar[0] == 6.5


def modest(effect):
    """Parameters near the effect's absence, and in the middle of the grid where it has one."""
    values = {}
    for p in effect.parameters:
        grid = effect.signature.nonlinear.get(p.name)
        if grid:
            values[p.name] = grid[len(grid) // 2]
        elif p.absent is None:
            values[p.name] = min(0.05, p.maximum)
        else:
            values[p.name] = p.absent + 1e-3 * min(1.0, p.maximum - p.absent)
    return values


MODEST = [
    entry(e.id, **modest(e)) for e in catalogue().values() if e.acts_on is not Elements.BODIES
]


@pytest.mark.parametrize("every", [1, 2])
def test_a_machine_with_all_effects_at_once_starts_at_rest(every):
    content = {**general_content(), "effects": MODEST[::every]}
    plant = Plant(build(content), STILL, MS, bar_pose=POSE, locked=True)
    tensions = plant.tensions.copy()
    assert len(plant.state) == 36 + sum(
        catalogue()[e["effect"]].physics.states
        * (8 if catalogue()[e["effect"]].acts_on is Elements.CABLES else 1)
        for e in MODEST[::every]
    )
    for _ in range(200):
        plant.step(np.zeros(8))
    assert np.isfinite(plant.state).all()
    # The load is worked out at the pose before the bar gave way to it.
    assert plant.bar_state[:3] == pytest.approx(POSE[:3], abs=2e-4)
    assert plant.tensions == pytest.approx(tensions, abs=0.05)


@pytest.mark.parametrize(
    "load",
    [
        entry("payload_swing", mass=1.0, length=0.5, damping=0.1),
        entry(
            "bar_constant_wrench", **dict(zip(DOFS, (0.5, -0.5, 8, 0.02, 0.05, -0.03), strict=True))
        ),
        entry("frame_flexibility", frequency=5.0, damping=0.1, compliance=1e-4),
        entry("cable_sag", linear_density=0.01),
        entry("cable_creep", compliance=1e-3, time_constant=1.0),
    ],
    ids=lambda load: load["effect"],
)
def test_a_loaded_machine_starts_at_rest(load):
    plant = Plant(
        build({**general_content(), "effects": [load]}), STILL, MS, bar_pose=POSE, locked=True
    )
    start = plant.state.copy()
    for _ in range(300):
        plant.step(np.zeros(8))
    # Sag's end weights turn with the pose that they are worked out at; all else is exact.
    assert plant.state == pytest.approx(start, abs=1e-6)


def test_a_constant_wrench_is_held_by_the_cables():
    wrench = dict(zip(DOFS, (0.5, -0.5, 8.0, 0.02, 0.05, -0.03), strict=True))
    testbed = build({**general_content(), "effects": [entry("bar_constant_wrench", **wrench)]})
    plant = Plant(testbed, STILL, MS, bar_pose=POSE)
    _, jacobian, _ = geometry(plant.parameters.cables, plant.bar_state[:6], np.zeros(6))
    borne = jacobian.T @ plant.tensions
    weight = gravity_wrench(plant.parameters, plant.bar_state[:6])
    assert borne - weight == pytest.approx(list(wrench.values()), abs=1e-7)


def test_states_of_effects_have_names():
    hysteresis = entry("cable_hysteresis", ["c3"], force=1.0, displacement=1e-3)
    payload = entry("payload_swing", mass=1.0, length=0.5, damping=0.1)
    content = {**general_content(), "effects": [hysteresis, payload]}
    plant = Plant(build(content), STILL, MS, bar_pose=POSE)
    assert plant.state_name(35) == "motor speed of c7"
    assert plant.state_name(36) == "state 0 of cable_hysteresis of c3"
    assert plant.state_name(40) == "state 3 of payload_swing of bar"
    assert len(plant.state) == 41


@pytest.mark.parametrize(
    ("breakaway", "coulomb", "plausible"),
    [(1.0, 0.5, True), (1.0, 1.0, True), (1.0, 0.49, False), (0.99, 1.0, False)],
)
def test_dry_friction_falls_to_half_of_breakaway_at_most(breakaway, coulomb, plausible):
    values = {"breakaway_torque": breakaway, "coulomb_torque": coulomb, "stribeck_speed": 1.0}
    assert catalogue()["winch_stribeck_friction"].is_plausible(values) is plausible
