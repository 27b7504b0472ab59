"""A diagnosis whose numbers are given, not computed."""

from dataclasses import replace

import numpy as np
from run_samples import SCENARIOS

from cspm_ident.block_simulation import Input
from cspm_ident.diagnosis.diagnosis import Diagnosis
from cspm_ident.diagnosis.finding import (
    Finding,
    HoldOut,
    Improvement,
    Shape,
    Unexplained,
    reported_status,
)
from cspm_ident.diagnosis.parameter import Coefficients
from cspm_ident.diagnosis.regression.block_regression import Gain
from cspm_ident.diagnosis.regression.hypothesis import Hypothesis
from cspm_ident.diagnosis.residuals.regressors import Candidate, Place
from cspm_ident.diagnosis.residuals.residual_equation import Equation
from cspm_ident.diagnosis.validation.detection_limits import Limit
from cspm_ident.diagnosis.validation.holdout_residuals import HeldOut
from cspm_ident.diagnosis.validation.holdout_simulation import Output, SimulatedFit
from cspm_ident.diagnosis.validation.remainder import Remainder, Stretch
from cspm_ident.diagnosis.validation.residual_curves import held_out_curves
from cspm_ident.signals.measurement import Measurement
from cspm_ident.signals.samples import Samples
from cspm_msgs_py.testbed import load_testbed
from cspm_sim.effects import Channel, catalogue

THESIS = load_testbed(SCENARIOS / "testbeds" / "thesis.yaml")
TORQUE, NOISE = 0.03, 0.001
PLACE = Place(Channel.SHAFT, "surge_2")
RUBBING = Candidate(catalogue()["winch_coulomb_friction"], "surge_2")
BAR_POSE = np.array([0.0, 0.0, 1.8, 0.0, 0.0, 0.0])


def equation(seed=1):
    """A winch's equation with dry friction in it, and a signal that has nothing to do with it."""
    rng = np.random.default_rng(seed)
    times = 0.01 * np.arange(3000)
    speed, other = np.cos(2.0 * times), rng.standard_normal(3000)
    column = np.sign(speed)[:, None, None]
    target = TORQUE * np.sign(speed) + NOISE * rng.standard_normal(3000)
    measured = 0.2 * np.sin(times) + target
    signals = {"tension [N]": other, "speed [rad/s]": speed}
    return Equation(
        PLACE, times, target[:, None], {RUBBING: column}, measured[:, None], signals=signals
    )


OUTPUT = Output(Input.SHAFT, "winches/angle/surge_2", "rad", "surge_2", Channel.SHAFT)


def diagnosis(named=True, alternatives=(), unknown=(), rejected=(), lines=(), region=None):
    part = equation()
    poses = Samples(np.array([0.0, 1.0]), np.array([BAR_POSE, BAR_POSE]))
    measured = Measurement(SCENARIOS / "today", "ab" * 32, THESIS, bar_pose=poses)
    weights = {RUBBING: np.array([TORQUE])} if named else {}
    finding = Finding(
        Hypothesis(RUBBING.effect, (RUBBING,)),
        Gain(900.0, 10.0),
        0.99,
        tuple(alternatives),
        holdout=HoldOut.CONFIRMED,
        coefficients=(Coefficients(RUBBING, np.array([TORQUE]), np.array([0.001])),),
        region=region,
        improvement=Improvement(OUTPUT.name, OUTPUT.unit, 1.46, 0.0071),
    )
    shape = Shape(np.linspace(0.0, 1.0, 7), np.arange(7.0) - 3.0)
    unexplained = tuple(Unexplained(*each, shape) for each in unknown)
    found = Diagnosis(
        searched=(measured,),
        held_out=(),
        findings=(*((finding,) if named else ()), *rejected),
        unexplained=unexplained,
        tested=485,
        fit=(held_out(NOISE),),
        simulated=(SimulatedFit(OUTPUT, 3.5, 1.46, 1.45, 0.0071, 0.0049),),
        lines=tuple(lines),
        limits=(
            Limit("winch_viscous_friction", "sway_1", "coefficient", 2.1e-6, "N·m·s/rad", True),
        ),
        not_excited=(("winch_backlash", ("sway_1",)),),
        places=(PLACE,),
        curves=held_out_curves([[part]], weights),
        noise={PLACE: np.array([NOISE])},
    )
    return judged(found, found.findings)


def held_out(after, measured=0.15, steady=None):
    """A winch's residual on held-out data, with so much left after the findings."""
    left = remainder(after if steady is None else steady, measured)
    return HeldOut(PLACE, measured, TORQUE, TORQUE, after, NOISE, NOISE, (left,), steady)


def remainder(rms, measured=0.15, place=PLACE, component=""):
    """What is left of a residual of 1000 rows, half of it a function of the angle."""
    stretch = Stretch(3.0, 4.0, 0.6)
    sizes = rms, NOISE, 1000, measured, float("nan")
    return Remainder(place, component, *sizes, "angle [rad]", 0.5, 0.6, stretch)


def judged(found, findings, aliased=()):
    """Return a diagnosis with other findings, those that are reported with their status."""
    return replace(
        found,
        findings=tuple(
            replace(each, status=reported_status(each, aliased)) if each.is_reported else each
            for each in findings
        ),
    )
