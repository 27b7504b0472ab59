import importlib
import pkgutil
import re
from pathlib import Path

import numpy as np
import pytest
from effect_snapshots import Snapshots
from machines import WINCH, build, changed, entry, general_content, rig_content

import cspm_sim.effects as effects_package
from cspm_model.motion import Motion
from cspm_msgs_py.dofs import DOFS
from cspm_msgs_py.errors import InputError
from cspm_msgs_py.testbed import EffectEntry
from cspm_sim.effect_entries import read_actions
from cspm_sim.effects import Block, Channel, Elements, Hook, catalogue
from cspm_sim.effects.signals import BarSignal, WinchSignal
from cspm_sim.kernels import affected_cables as cable_hooks
from cspm_sim.kernels import bar_effects as bar_hooks
from cspm_sim.kernels import winch as winch_kernel
from cspm_sim.kernels.plant import state_count
from cspm_sim.parameters import plant_parameters
from cspm_sim.plant import Plant
from cspm_sim.plant_blocks import PlantBlocks

STILL = Motion.still(np.zeros(6))
UNITS = {
    *(
        "N·m",
        "N·m·s/rad",
        "N·m·s²/rad²",
        "N·s/m",
        "N·s²/m²",
        "m/N",
        "N/m",
        "N·m/rad",
        "kg/m",
        "kg·m²",
    ),
    *("m", "rad", "rad/s", "kg", "s", "Hz", "N", "N/s", "1"),
}
WORDS = ("friction", "damping", "drag")
# A difference between two directions: what takes energy is the friction beside it.
SIGNED = [catalogue()["winch_directional_friction"], catalogue()["winch_curved_friction"]]
EFFECTS = list(catalogue().values())
# Public names: recordings and test-bed files of others rely on them.
CONTRACT = {
    "winch_viscous_friction": "coefficient",
    "winch_coulomb_friction": "torque",
    "winch_stribeck_friction": "breakaway_torque coulomb_torque stribeck_speed",
    "winch_load_friction": "coefficient",
    "winch_backlash": "width",
    "winch_torque_ripple": "amplitude order phase",
    "winch_directional_friction": "coefficient",
    "winch_curved_friction": "torque speed",
    "winch_unbalance": "cosine sine order",
    "winch_torque_gain": "gain",
    "winch_torque_offset": "torque",
    "winch_torque_lag": "time_constant",
    "winch_inertia": "inertia",
    "winch_drum_eccentricity": "eccentricity phase",
    "winch_drum_radius": "radius",
    "cable_stiffness": "scale",
    "cable_axial_damping": "scale",
    "cable_hysteresis": "force displacement",
    "cable_creep": "compliance time_constant",
    "cable_sag": "linear_density",
    "cable_length_offset": "offset",
    "cable_exit_offset": "x y z",
    "cable_attachment_offset": "x y z",
    "pulley_friction": "coefficient wrap",
    "pulley_radius": "radius",
    "cable_transverse_damping": "coefficient",
    "bar_mass": "mass",
    "bar_com": "x y z",
    "bar_inertia": "ixx iyy izz",
    "bar_linear_damping": "surge sway heave roll pitch yaw",
    "bar_quadratic_drag": "surge sway heave roll pitch yaw",
    "bar_constant_wrench": "surge sway heave roll pitch yaw",
    "bar_restoring": "surge sway heave roll pitch yaw rest_heave",
    "payload_swing": "mass length damping",
    "frame_pose_offset": "surge sway heave roll pitch yaw",
    "frame_flexibility": "frequency damping compliance",
    "tension_bias": "bias",
    "tension_gain": "gain",
    "pose_delay": "delay",
    "pose_offset": "surge sway heave roll pitch yaw",
    "encoder_scale": "scale",
    "clock_skew": "skew",
    "tension_crosstalk": "share",
    "tension_delay": "delay",
    "tension_drift": "rate",
    "tension_lag": "time_constant",
    "torque_delay": "delay",
}
# What kernels may change, by hook.
OUTPUTS = {
    Hook.FRAME: range(cable_hooks.FRAME_SHIFT, cable_hooks.FRAME_SHIFT + 6),
    Hook.CABLE: range(cable_hooks.RADIUS_ADDED, cable_hooks.CABLE_SIGNALS),
    Hook.LOADED_CABLE: range(0),
    Hook.LOADED_FRAME: range(0),
    Hook.DRIVE: (winch_kernel.REPORTED_TORQUE,),
    Hook.WINCH: (winch_kernel.RESISTANCE, winch_kernel.DRY_LIMIT),
    Hook.ATTACHMENT: range(bar_hooks.END_FORCE, bar_hooks.END_FORCE + 3),
    Hook.BAR: range(bar_hooks.WRENCH, bar_hooks.WRENCH + 6),
    Hook.PENDANT: range(bar_hooks.WRENCH, bar_hooks.WRENCH + 6),
}
KERNELS = [(effect, hook) for effect in EFFECTS for hook in effect.physics.kernels]


def bench(entries, **winch):
    """One winch without cable."""
    cables = [{"name": "w", **WINCH, "rotor_inertia": 1e-3, **winch}]
    return build({"name": "bench", "cables": cables, "effects": entries})


def middle(effect):
    return np.array([0.5 * (p.minimum + p.maximum) for p in effect.parameters])


def called(effect, hook, signals, states):
    """Signals and rates after the effect's kernel."""
    after, rates = signals.copy(), np.zeros(effect.physics.states)
    memory = (states, rates) if effect.physics.states else ()
    effect.physics.kernels[hook](middle(effect), after, *memory)
    return after, rates


def test_each_file_declares_one_effect_of_its_name():
    found = pkgutil.walk_packages(effects_package.__path__, "cspm_sim.effects.")
    modules = {info.name.rpartition(".")[2]: importlib.import_module(info.name) for info in found}
    declared = {name: m.EFFECT for name, m in modules.items() if hasattr(m, "EFFECT")}
    assert declared == catalogue()
    assert all(effect.id == name for name, effect in declared.items())
    assert list(catalogue()) == sorted(catalogue())


def test_nothing_else_names_an_effect():
    package = Path(effects_package.__file__).parents[1]
    for path in package.rglob("*.py"):
        # MuJoCo has some of them built in.
        if not {"effects", "mujoco"} & set(path.relative_to(package).parts):
            words = set(re.findall(r"\w+", path.read_text(encoding="utf-8")))
            assert not words & catalogue().keys(), path


@pytest.mark.parametrize("effect", EFFECTS, ids=lambda e: e.id)
def test_an_effect_declares_all_that_its_readers_need(effect):
    assert effect.parameters
    names = [parameter.name for parameter in effect.parameters]
    assert len(set(names)) == len(names)
    for parameter in effect.parameters:
        assert parameter.unit in UNITS
        assert np.isfinite([parameter.minimum, parameter.maximum]).all()
        assert parameter.minimum < parameter.maximum
    words = effect.description
    for text in (words.equation, words.shows, words.separating_experiment, words.reference):
        assert len(text) > 10
        assert "\n" not in text
    assert words.confounded_with
    assert effect.id not in words.confounded_with
    assert len(set(words.confounded_with)) == len(words.confounded_with)


@pytest.mark.parametrize("effect", EFFECTS, ids=lambda e: e.id)
def test_confounded_effects_name_each_other(effect):
    for other in effect.description.confounded_with:
        if other in catalogue():
            assert effect.id in catalogue()[other].description.confounded_with


def test_the_catalogue_is_the_contract():
    needed = {e.id: " ".join(p.name for p in e.parameters if p.default is None) for e in EFFECTS}
    assert needed == CONTRACT


@pytest.mark.parametrize("effect", EFFECTS, ids=lambda e: e.id)
def test_an_effect_acts_in_one_way(effect):
    """As kernels, as other parameters or on sensors; with memory only as kernels."""
    physics = effect.physics
    ways = [bool(physics.kernels), physics.alter is not None, physics.sense is not None]
    assert sum(ways) == 1
    assert (effect.block is Block.SENSOR) == (effect.physics.sense is not None)
    assert effect.physics.kernels or not effect.physics.states
    assert effect.signature.regression.channel in Channel


@pytest.mark.parametrize(
    ("effect", "hook"), KERNELS, ids=[f"{effect.id}-{hook.name}" for effect, hook in KERNELS]
)
def test_a_kernel_adds_to_what_others_added(effect, hook):
    """Two effects on one element add up, and a kernel changes nothing that is only to be read."""
    rng = np.random.default_rng(4)
    signals, states = np.abs(rng.normal(size=30)) + 0.1, 0.3 * np.ones(effect.physics.states)
    once, rates = called(effect, hook, signals, states)
    twice, same_rates = called(effect, hook, once, states)
    outputs = list(OUTPUTS[hook])
    others = np.setdiff1d(np.arange(30), outputs)
    assert (once[others] == signals[others]).all()
    assert (rates == same_rates).all()
    if hook is not Hook.DRIVE:
        added = once - signals
        assert twice - signals == pytest.approx(2.0 * added, rel=1e-12, abs=1e-12)
    assert np.isfinite(once).all()


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize(
    "effect",
    [e for e in EFFECTS if e.physics.kernels and any(w in e.id for w in WORDS) and e not in SIGNED],
    ids=lambda e: e.id,
)
def test_friction_and_damping_take_energy_from_any_motion(effect, seed):
    values = {p.name: p.minimum + 0.2 * (p.maximum - p.minimum) for p in effect.parameters}
    on = EffectEntry(effect=effect.id, parameters=values)
    seen = Snapshots(build(general_content()), [on], seed=seed, frame_moves=0.0)
    if effect.signature.regression.channel is Channel.SHAFT:
        for i in range(8):
            assert (seen.shaft_residual(i)[:, 0] * seen.winch(i)[:, WinchSignal.SPEED] > 0.0).all()
        return
    twist = seen.bar()[:, BarSignal.VELOCITY : BarSignal.VELOCITY + 6]
    assert (np.sum(seen.wrench_residual() * twist, axis=1) < 0.0).all()


@pytest.mark.parametrize("coefficient", [1e-3, 2e-2])
def test_viscous_friction_makes_speed_decay_exponentially(coefficient):
    machine = bench([entry("winch_viscous_friction", ["w"], coefficient=coefficient)])
    plant = Plant(machine, STILL, 1_000_000)
    plant.speeds[:] = 7.0
    for _ in range(300):
        plant.step(np.zeros(1))
    decay = np.exp(-coefficient / 1e-3 * 0.3)
    assert plant.speeds[0] == pytest.approx(7.0 * decay, rel=1e-5)
    assert plant.angles[0] == pytest.approx(7.0 * (1 - decay) * 1e-3 / coefficient, rel=1e-5)


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_coulomb_friction_stops_a_winch_at_constant_deceleration(side):
    machine = bench([entry("winch_coulomb_friction", torque=0.02)])
    plant = Plant(machine, STILL, 1_000_000)
    plant.speeds[:] = side * 5.0
    speeds = []
    for _ in range(400):
        plant.step(np.zeros(1))
        speeds.append(plant.speeds[0])
    times = 1e-3 * np.arange(1, 401)
    expected = side * np.maximum(0.0, 5.0 - 20.0 * times)
    assert speeds[:249] == pytest.approx(expected[:249], abs=1e-12)
    # The last of the speed goes geometrically.
    assert speeds[250] == pytest.approx(side * 0.02 * (3 / 8) ** 2, rel=1e-6)
    assert np.abs(speeds[280:]).max() < 1e-12
    assert plant.angles[0] == pytest.approx(side * 5.0**2 / 40.0, rel=1e-4)


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_coulomb_friction_sticks_below_its_limit_and_breaks_away_above(side):
    plant = Plant(bench([entry("winch_coulomb_friction", torque=0.02)]), STILL, 1_000_000)
    for torque in (0.0, 0.01, 0.0199, 0.02):
        for _ in range(100):
            plant.step(np.array([side * torque]))
        assert plant.speeds[0] == pytest.approx(0.0, abs=1e-12)
        assert plant.angles[0] == pytest.approx(0.0, abs=1e-12)
    for _ in range(100):
        plant.step(np.array([side * 0.03]))
    assert plant.speeds[0] == pytest.approx(side * 0.01 / 1e-3 * 0.1, rel=1e-9)


def test_coulomb_friction_holds_a_loaded_winch_still():
    """A cable that pulls with 0.5 N·m, a motor that gives 0.45: friction bears the rest."""
    content = {**rig_content(), "effects": [entry("winch_coulomb_friction", torque=0.1)]}
    plant = Plant(build(content), STILL, 1_000_000, tensions=[20.0])
    begin = plant.state.copy()
    for _ in range(500):
        plant.step(np.array([0.45]))
    assert plant.state == pytest.approx(begin, abs=1e-9)
    for _ in range(500):
        plant.step(np.array([0.35]))
    assert plant.tensions[0] < 19.5
    assert plant.tensions[0] == pytest.approx((0.35 + 0.1) / 0.025, abs=1.0)


@pytest.mark.parametrize("frequency", [0.5, 2.0, 8.0])
def test_coulomb_friction_takes_four_times_torque_times_amplitude_per_cycle(frequency):
    """A winch made to swing by its torque, with and without friction: the motors' extra work."""
    limit, amplitude = 0.05, 0.6
    omega = 2 * np.pi * frequency
    period_ns = round(1e9 / frequency / 8000)
    machine = bench([entry("winch_coulomb_friction", torque=limit)], torque_limit=100.0)
    plant = Plant(machine, STILL, period_ns)
    step, inertia = period_ns * 1e-9, 1e-3
    plant.speeds[:] = amplitude * omega
    plant.angles[:] = 0.0
    work, tops = 0.0, []
    for k in range(16000):
        time = (k + 0.5) * step
        wanted_speed = amplitude * omega * np.cos(omega * time)
        # Feed forward all that the wanted swing needs, friction included.
        torque = -inertia * amplitude * omega**2 * np.sin(omega * time)
        torque += limit * np.sign(wanted_speed)
        before = plant.angles[0]
        plant.step(np.array([torque]))
        if k >= 8000:
            work += torque * (plant.angles[0] - before)
            tops.append(plant.angles[0])
    swing = 0.5 * (max(tops) - min(tops))
    assert swing == pytest.approx(amplitude, rel=0.01)
    assert work == pytest.approx(4.0 * limit * swing, rel=0.01)


def test_bar_damping_acts_in_world_axes():
    """Slack cables, no gravity: each axis's velocity decays by its own coefficient."""
    coefficients = dict(
        zip(
            ("surge", "sway", "heave", "roll", "pitch", "yaw"),
            (5.0, 10.0, 20.0, 0.0, 0.0, 0.0),
            strict=True,
        )
    )
    content = {**general_content(), "gravity": 0.0}
    content["effects"] = [entry("bar_linear_damping", ["bar"], **coefficients)]
    content = changed(content, "bar.com", [0.0, 0.0, 0.0])
    plant = Plant(build(content), STILL, 1_000_000, bar_pose=[0, 0, 2, 0, 0, 0], locked=True)
    plant.unstretched_lengths += 2.0
    plant.bar_state[3:6] = [0.4, -0.7, 1.2]
    plant.bar_state[6:9] = [1.0, 2.0, -3.0]
    for _ in range(200):
        plant.step(np.zeros(8))
    decay = np.exp(-np.array([5.0, 10.0, 20.0]) / 5.0 * 0.2)
    assert plant.bar_state[6:9] == pytest.approx(decay * [1.0, 2.0, -3.0], rel=1e-10)
    assert (plant.bar_state[9:] == 0.0).all()


@pytest.mark.parametrize("axis", range(3))
def test_bar_damping_slows_a_turn_about_its_world_axis(axis):
    content = {**general_content(), "gravity": 0.0}
    content = changed(content, "bar.com", [0.0, 0.0, 0.0])
    content = changed(content, "bar.inertia", {"ixx": 0.1, "iyy": 0.1, "izz": 0.1})
    names = ("surge", "sway", "heave", "roll", "pitch", "yaw")
    values = dict.fromkeys(names, 0.0) | {names[3 + axis]: 0.2}
    content["effects"] = [entry("bar_linear_damping", **values)]
    plant = Plant(build(content), STILL, 1_000_000, bar_pose=[0, 0, 2, 0, 0, 0], locked=True)
    plant.unstretched_lengths += 2.0
    plant.bar_state[3:6] = [0.0, 0.0, np.pi / 2]
    # Yawed by 90°, world x is the bar's −y, world y its x.
    world = np.array([0.5, 0.4, 0.3])
    plant.bar_state[9:] = [world[1], -world[0], world[2]]
    for _ in range(3):
        plant.step(np.zeros(8))
    x, y, z = plant.bar_state[9:]
    expected = world.copy()
    expected[axis] *= np.exp(-0.2 / 0.1 * 0.003)
    assert [-y, x, z] == pytest.approx(expected, abs=1e-5)


def test_elements_are_those_named_and_all_when_none_is_named():
    content = general_content()
    content["effects"] = [entry("winch_viscous_friction", ["c2", "c5"], coefficient=0.01)]
    assert plant_parameters(build(content)).effects[:, 1].tolist() == [2, 5]
    content["effects"] = [entry("winch_viscous_friction", coefficient=0.01)]
    assert plant_parameters(build(content)).effects[:, 1].tolist() == list(range(8))
    content["effects"] = [
        entry(
            "bar_linear_damping",
            **dict.fromkeys(("surge", "sway", "heave", "roll", "pitch", "yaw"), 1.0),
        )
    ]
    assert plant_parameters(build(content)).effects[:, :2].tolist() == [[Hook.BAR, 0]]


def test_rows_are_in_the_kernels_order_however_a_file_lists_effects():
    entries = [
        entry("bar_linear_damping", **dict.fromkeys(DOFS, 1.0)),
        entry("winch_viscous_friction", ["c5", "c2"], coefficient=0.01),
        entry("pulley_friction", ["c1"], coefficient=0.02, wrap=1.5),
        entry("winch_coulomb_friction", ["c2", "c0"], torque=0.01),
    ]
    found = [
        plant_parameters(build({**general_content(), "effects": list(order)}))
        for order in (entries, entries[::-1])
    ]
    for parameters in found:
        keys = [tuple(row) for row in parameters.effects[:, :2].tolist()]
        assert keys == sorted(keys)
    one, other = ({tuple(row) for row in p.effects[:, :3].tolist()} for p in found)
    assert one == other
    assert len(one) == 6


def test_rows_in_another_order_are_refused():
    content = {**general_content(), "effects": [entry("winch_coulomb_friction", torque=0.01)]}
    parameters = plant_parameters(build(content))
    PlantBlocks(parameters, STILL, 1_000_000)
    wrong = parameters._replace(effects=parameters.effects[::-1].copy())
    with pytest.raises(ValueError, match=r"^effects: rows of .*, allowed: ascending, as"):
        PlantBlocks(wrong, STILL, 1_000_000)


def test_an_effect_acts_on_its_element_alone():
    content = general_content()
    content["effects"] = [entry("winch_viscous_friction", ["c2"], coefficient=0.05)]
    with_friction, without = (
        Plant(build({**content, "effects": e}), STILL, 1_000_000, bar_pose=[0, 0, 2, 0, 0, 0])
        for e in (content["effects"], [])
    )
    for plant in (with_friction, without):
        plant.unstretched_lengths += 1.0
        plant.speeds[:] = 5.0
        plant.step(np.zeros(8))
    same = with_friction.speeds == without.speeds
    assert same.tolist() == [True, True, False, True, True, True, True, True]
    assert with_friction.speeds[2] < without.speeds[2]


@pytest.mark.parametrize(
    ("effects", "text"),
    [
        (
            [entry("winch_friction", torque=1.0)],
            "effects: winch_friction: no such effect, allowed: "
            + ", ".join((*catalogue(), "empirical"))
            + "; did you mean winch_load_friction, winch_curved_friction or"
            " winch_viscous_friction?",
        ),
        (
            [entry("winch_coulomb_friction", ["c9"], torque=0.1)],
            "effects: winch_coulomb_friction: no element 'c9', allowed: c0, c1, c2, c3, c4, c5, c6,"
            " c7",
        ),
        (
            [entry("winch_coulomb_friction", ["c1"], tork=0.1)],
            "effects: winch_coulomb_friction: parameters ['tork'], allowed: exactly ['torque']",
        ),
        (
            [entry("winch_coulomb_friction", ["c1"])],
            "effects: winch_coulomb_friction: parameters [], allowed: exactly ['torque']",
        ),
        (
            [entry("winch_coulomb_friction", ["c1"], torque=-0.1)],
            "effects: winch_coulomb_friction: torque = -0.1 N·m, allowed: 0 to 1e+06",
        ),
        (
            [entry("winch_viscous_friction", ["c1"], coefficient=2e5)],
            "effects: winch_viscous_friction: coefficient = 200000 N·m·s/rad, allowed: 0 to 100000",
        ),
        (
            [
                entry(
                    "bar_linear_damping",
                    ["c1"],
                    **dict.fromkeys(("surge", "sway", "heave", "roll", "pitch", "yaw"), 1.0),
                )
            ],
            "effects: bar_linear_damping: elements ['c1'], allowed: [bar] or none",
        ),
    ],
)
def test_faulty_entries_are_refused_in_one_line(effects, text):
    with pytest.raises(InputError) as caught:
        plant_parameters(build({**general_content(), "effects": effects}))
    assert str(caught.value) == text


def test_what_a_file_leaves_out_has_its_default():
    given = {"coefficient": 2.0}
    for left_out, values in ((1.0, given), (-0.5, {**given, "exit_share": -0.5})):
        content = {**general_content(), "effects": [entry("cable_transverse_damping", **values)]}
        actions = read_actions(build(content))
        assert all(a.values == {"coefficient": 2.0, "exit_share": left_out} for a in actions)


def test_an_unknown_parameter_is_refused_beside_a_default():
    effects = [entry("cable_transverse_damping", coefficient=2.0, share=0.5)]
    with pytest.raises(InputError) as caught:
        read_actions(build({**general_content(), "effects": effects}))
    assert str(caught.value) == (
        "effects: cable_transverse_damping: parameters ['coefficient', 'share'], allowed: exactly"
        " ['coefficient'], and exit_share"
    )


def test_an_effect_on_a_bar_needs_a_bar():
    values = dict.fromkeys(("surge", "sway", "heave", "roll", "pitch", "yaw"), 1.0)
    with pytest.raises(InputError) as caught:
        plant_parameters(bench([entry("bar_linear_damping", **values)]))
    assert str(caught.value) == (
        "effects: bar_linear_damping: this test-bed has no bar, allowed: effects on winches"
    )


def test_an_effect_with_memory_acts_once_on_an_element():
    values = {"force": 1.0, "displacement": 1e-3}
    twice = [entry("cable_hysteresis", ["c1", "c2"], **values)] * 2
    with pytest.raises(InputError) as caught:
        plant_parameters(build({**general_content(), "effects": twice}))
    assert str(caught.value) == (
        "effects: cable_hysteresis: twice on c1, allowed: once per element"
    )
    split = [entry("cable_hysteresis", [name], **values) for name in ("c1", "c2")]
    assert state_count(plant_parameters(build({**general_content(), "effects": split}))) == 38


def test_a_cable_effect_needs_a_cable():
    with pytest.raises(InputError) as caught:
        plant_parameters(bench([entry("cable_stiffness", scale=1.1)]))
    assert str(caught.value) == (
        "effects: cable_stiffness: w has no cable, allowed: effects on winches"
    )


def test_a_parameter_that_leaves_its_bounds_is_one_line():
    content = {**general_content(), "effects": [entry("bar_mass", mass=-5.5)]}
    with pytest.raises(InputError) as caught:
        plant_parameters(build(content))
    assert str(caught.value).startswith("effects: bar_mass: altered bar: mass")
    assert "\n" not in str(caught.value)


def absent(effect):
    """Parameters at which the effect is not there."""
    return {
        p.name: 0.5 * (p.minimum + p.maximum) if p.absent is None else p.absent
        for p in effect.parameters
    }


@pytest.mark.parametrize(
    "effect", [e for e in EFFECTS if e.is_absent(absent(e))], ids=lambda e: e.id
)
def test_an_absent_effect_leaves_the_machine_exactly_as_it_was(effect):
    content = general_content()
    content["effects"] = [entry(effect.id, **absent(effect))]
    nominal = plant_parameters(build(general_content()))
    found = plant_parameters(build(content))
    assert all((a == b).all() for a, b in zip(found, nominal, strict=True))
    assert len(found.effects) == 0


def test_only_a_lag_is_never_absent():
    """Its one parameter is a time constant, which an integration cannot take to zero."""
    assert [e.id for e in EFFECTS if not e.is_absent(absent(e))] == ["winch_torque_lag"]


@pytest.mark.parametrize("share", [0.0, 0.3, 1.0])
@pytest.mark.parametrize("effect", EFFECTS, ids=lambda e: e.id)
def test_bounds_themselves_are_allowed(effect, share):
    values = {p.name: p.minimum + share * (p.maximum - p.minimum) for p in effect.parameters}
    machine = build({**general_content(), "effects": [entry(effect.id, **values)]})
    actions = read_actions(machine)
    count = {Elements.CABLES: 8, Elements.BODIES: 2}.get(effect.acts_on, 1)
    assert len(actions) == (0 if effect.is_absent(values) else count)
