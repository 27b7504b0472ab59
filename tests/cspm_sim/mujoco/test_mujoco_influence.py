"""Physics beside the test-bed's in the MuJoCo plant."""

import numpy as np
import pytest
from mujoco_pairs import MS, POSE, radii, still, waving

from cspm_msgs_py.testbed import EffectEntry
from cspm_sim.mujoco.plant import MujocoPlant


class Pushing:
    """Adds constants."""

    def __init__(self, **added):
        self.added, self.times = added, []

    def act(self, scene, acting):
        for name, value in self.added.items():
            getattr(acting, name)[:] += value

    def advance(self, scene, period):
        self.times.append((scene.time, period))


def plant(testbed, *influences, motion=None):
    motion = motion or still()
    return MujocoPlant(testbed, motion.at, MS, bar_pose=POSE, influences=influences)


def run(machine, steps=30):
    balance = radii(machine.testbed) * machine.tensions
    for _ in range(steps):
        machine.step(balance)
    return np.concatenate([machine.bar_state, machine.angles, machine.tensions])


@pytest.mark.compiled
def test_an_influence_that_adds_nothing_changes_nothing(general):
    idle = Pushing()
    free, watched = plant(general, motion=waving(1.0)), plant(general, idle, motion=waving(1.0))
    np.testing.assert_array_equal(run(free), run(watched))
    assert idle.times[-1] == (pytest.approx(0.03), pytest.approx(1e-3))
    assert len(idle.times) == 30


@pytest.mark.compiled
def test_a_torque_beside_that_of_the_drive_is_the_drives_raised_by_it(general):
    raised, pushed = plant(general), plant(general, Pushing(torque=0.003))
    torque = radii(general) * raised.tensions
    for _ in range(20):
        raised.step(torque + 0.003)
        pushed.step(torque)
    np.testing.assert_allclose(pushed.speeds, raised.speeds, rtol=1e-12)
    assert (pushed.speeds > 0.0).all()


@pytest.mark.compiled
def test_length_given_slackens_and_a_wider_drum_pulls_harder_on_the_shaft(general):
    free, longer = plant(general), plant(general, Pushing(length=1e-4))
    wider = plant(general, Pushing(radius=1e-3))
    assert (longer.tensions < free.tensions).all()
    torque = radii(general) * free.tensions
    wider.step(torque)
    assert (wider.speeds < 0.0).all()


@pytest.mark.compiled
def test_tension_held_beside_the_laws_is_felt_by_bar_and_winch(general):
    free, held = plant(general), plant(general, Pushing(tension=0.2))
    np.testing.assert_allclose(held.tensions - free.tensions, 0.2, rtol=1e-9)
    held.step(radii(general) * free.tensions)
    assert (held.speeds < 0.0).all()


@pytest.mark.compiled
def test_a_wrench_on_the_bar_acts_at_its_origin(general):
    free, pushed = plant(general), plant(general, Pushing(wrench=np.array([0, 3.0, 0, 0, 0, 0])))
    change = pushed._wrench - free._wrench
    arm = free._origin - free._centre
    assert np.abs(arm).max() > 0.005
    np.testing.assert_allclose(change[:3], [0.0, 3.0, 0.0], atol=1e-12)
    np.testing.assert_allclose(change[3:], np.cross(arm, [0.0, 3.0, 0.0]), atol=1e-12)


@pytest.mark.compiled
def test_bristles_slide_as_dry_friction_of_mujoco_does(general):
    """Two roads to dry friction: beyond the presliding range they go the same way."""
    from bench.blind.reality.friction import coulomb

    entry = EffectEntry(effect="winch_coulomb_friction", parameters={"torque": 0.02})
    dry = plant(general.model_copy(update={"effects": (*general.effects, entry)}))
    bristled, free = plant(general, coulomb(np.full(8, 0.02))), plant(general)
    torque = radii(general) * free.tensions + 0.06
    for machine in (dry, bristled, free):
        for _ in range(150):
            machine.step(torque)
    apart = np.abs(bristled.angles - dry.angles).max()
    assert apart < 0.1 * np.abs(free.angles - dry.angles).max()


class Halving:
    """A drive that gives half of what it was commanded a period ago."""

    def __init__(self):
        self.reported = None

    def deliver(self, command):
        return 0.5 * (command if self.reported is None else self.reported)

    def advance(self, command, period):
        assert period == pytest.approx(1e-3)
        self.reported = command.copy()


@pytest.mark.compiled
def test_a_drive_lies_between_command_and_torque_and_is_commanded_no_more_than_the_limit(general):
    direct = plant(general)
    driven = MujocoPlant(general, still().at, MS, bar_pose=POSE, drive=Halving())
    limits = np.array([cable.torque_limit for cable in general.cables])
    commands = [0.3 * limits, 9.0 * limits, 0.1 * limits]
    delivered = [0.15 * limits, 0.15 * limits, 0.5 * limits]
    for command, torque in zip(commands, delivered, strict=True):
        np.testing.assert_allclose(driven.applied_torque(command), torque)
        driven.step(command)
        direct.step(torque)
        np.testing.assert_allclose(driven.speeds, direct.speeds, rtol=1e-12)
