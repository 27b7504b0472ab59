"""Whether the bar's mass is estimated from its heave, and from what else pulls on it."""

import numpy as np
import pytest
from run_samples import bundle_of

from bench.results.tracking import Case, assembled
from cspm_control.controllers.mass_observer import MassObserver
from cspm_control.stages.make import make_controller
from cspm_msgs_py.errors import InputError
from cspm_msgs_py.schedule import MOTION_CONTROLLER
from cspm_run.loop import Loop

PERIOD, NOMINAL, G = 1e-3, 4.0, 9.81
PAST = "worst_case_steep_past_thesis"
ON = "control.motion.mass_adaptation={}"
NO_PLAN = "control.motion.governor=null"


def reported(mass, *, pull=0.0, heave=2.0, seconds=10.0, largest=0.5):
    """Return the mass estimated of a bar in waves, pulled downwards by a steady force [N]."""
    found = MassObserver(NOMINAL, largest, period=PERIOD, settling=0.1)
    rng = np.random.default_rng(7)
    for time in np.arange(0.0, seconds, PERIOD):
        falls = heave * np.sin(2.7 * time)
        force = mass * (G - falls) + pull
        found.step(force, G - falls + rng.normal(0.0, 0.05))
    return found.mass


@pytest.mark.parametrize("mass", [3.2, 4.0, 4.8])
@pytest.mark.parametrize("pull", [-4.0, 0.0, 4.0])
def test_a_mass_is_estimated_and_a_steady_force_is_none(mass, pull):
    assert reported(mass, pull=pull) == pytest.approx(mass, rel=0.02)


def test_at_rest_a_force_cannot_be_distinguished_from_a_mass():
    """Nothing moves: whatever is carried is taken for mass, which is the likelier."""
    assert reported(4.8, heave=0.0) == pytest.approx(4.8, rel=0.02)
    assert reported(NOMINAL, pull=4.0, heave=0.0) == pytest.approx(NOMINAL + 4.0 / G, rel=0.02)


def test_no_more_is_believed_than_the_largest():
    assert reported(8.0, largest=0.2) == pytest.approx(1.2 * NOMINAL)
    assert reported(2.0, largest=0.2) == pytest.approx(0.8 * NOMINAL)


def test_after_a_restart_what_was_learnt_stays_and_what_settles_is_not_believed():
    found = MassObserver(NOMINAL, 0.5, period=PERIOD, settling=0.05)
    for time in np.arange(0.0, 5.0, PERIOD):
        falls = 2.0 * np.sin(2.7 * time)
        found.step(4.8 * (G - falls), G - falls)
    before = found.mass
    assert before == pytest.approx(4.8, rel=0.02)
    found.restart()
    for _ in range(50):
        found.step(4.8 * G, 0.0)
    assert found.mass == before
    found.step(4.8 * G, 0.0)
    assert found.mass > before


class Run:
    """A run of the worst case past the thesis on a machine that is not the nominal one."""

    def __init__(self, effects, *overrides, seconds=8.0):
        case = Case(PAST, (f"duration={seconds}", NO_PLAN, *overrides), effects)
        parts = assembled(case.bundle())
        self.motion = next(stage for stage in parts.stages if stage.node == MOTION_CONTROLLER)
        loop, reference = Loop(parts, {}, lambda *_: None), parts.references["/bar/reference"]
        errors = []
        for _ in range(round(1000 * seconds)):
            heave = parts.plant.bar_state[2]
            loop.step()
            errors.append(reference.values[2] - heave)
        # What is wrong at the start nobody can know.
        self.heave = np.sqrt(np.mean(np.square(errors[3000:])))

    @property
    def mass(self):
        return float(self.motion.status().values["bar_mass"].split()[0])


@pytest.mark.compiled
@pytest.mark.parametrize("share", [0.2, -0.2])
def test_a_wrong_mass_costs_little_once_it_is_known(share):
    wrong = (("bar_mass", (), {"mass": share * 4.06}),)
    without, with_it = Run(wrong), Run(wrong, ON)
    assert with_it.heave < 0.3 * without.heave
    assert with_it.mass == pytest.approx(4.06 * (1.0 + share), rel=0.03)


@pytest.mark.slow
@pytest.mark.compiled
def test_a_right_mass_stays_right_also_where_something_pulls():
    axes = ("surge", "sway", "heave", "roll", "pitch", "yaw")
    pulled = (("bar_constant_wrench", (), dict.fromkeys(axes, 0.0) | {"heave": 4.0}),)
    for effects in ((), pulled):
        assert Run(effects, ON, seconds=15.0).mass == pytest.approx(4.06, rel=0.03)


def test_no_stage_that_does_not_ask_is_given_a_mass():
    for overrides, expected in (((), {}), ((ON,), {"bar_mass": "4.060 kg"})):
        bundle = bundle_of(PAST, *overrides)
        stage = make_controller(MOTION_CONTROLLER, bundle.scenario, bundle.testbed.testbed)
        assert stage.status().values == expected


@pytest.mark.parametrize("largest", ["0", "1", "-0.2"])
def test_the_share_that_is_believed_is_one_of_the_mass(largest):
    with pytest.raises(InputError, match=r"mass_adaptation.largest: .*(greater|less) than"):
        bundle_of(PAST, f"control.motion.mass_adaptation={{largest: {largest}}}")
