"""What was not searched is simulated from earlier on, and judged by itself."""

import numpy as np
import pytest
from run_samples import bundle_of

from cspm_ident.block_simulation import Input
from cspm_ident.diagnosis.finding import Improvement
from cspm_ident.diagnosis.residuals.regressors import Candidate
from cspm_ident.diagnosis.validation import holdout_simulation
from cspm_ident.diagnosis.validation.holdout_simulation import (
    Baselines,
    Output,
    SimulatedFit,
    baselines_of,
    improvement_by,
)
from cspm_ident.signals.measurement import read_measurement
from cspm_msgs_py.dofs import DOFS
from cspm_run.recorded_run import run
from cspm_sim.effects import Channel, catalogue


@pytest.fixture(scope="module")
def recording(tmp_path_factory):
    """Eight seconds of the worst sea."""
    folder = tmp_path_factory.mktemp("simulation") / "bag"
    run(bundle_of("worst_case_steep", "duration=8"), folder)
    return read_measurement(folder)


@pytest.mark.parametrize("start", [0.0, 6.0])
def test_only_what_was_not_searched_is_judged(recording, start):
    found = baselines_of([recording], [start], {})
    (part,) = found.parts
    assert part.bar_pose.times[0] == recording.bar_pose.times[0]
    inside = recording.bar_pose.times >= start
    spreads = {out.name: spread for out, (spread, _) in found.described.items()}
    for k, dof in enumerate(DOFS):
        expected = np.std(recording.bar_pose.values[inside, k])
        assert spreads[f"bar/pose/{dof}"] == pytest.approx(expected, rel=0.02)


@pytest.mark.parametrize(
    ("effect", "element", "drive", "reported"),
    [
        ("cable_stiffness", "sway_1", Input.WINCH, True),
        ("cable_stiffness", "sway_1", Input.TENSION, False),
        ("winch_coulomb_friction", "sway_1", Input.WINCH, False),
        ("bar_mass", "bar", Input.TENSION, True),
    ],
)
def test_a_pose_depends_on_cables_where_motor_angles_drive_both(effect, element, drive, reported):
    pose = Output(drive, "bar/pose/yaw", "rad", "bar", Channel.WRENCH)
    fit = SimulatedFit(pose, 1.0, before=0.4, retuned=0.4, after=0.3, floor=0.1)
    own = {Candidate(catalogue()[effect], element): np.array([0.1])}
    found = improvement_by(Baselines((), (), {}, {}), [fit], own, own)
    assert found == (Improvement(pose.name, pose.unit, 0.4, 0.3) if reported else None)


@pytest.mark.parametrize(("nominal", "without"), [(0.25, 0.25), (9.0, 0.4)])
def test_of_two_effects_that_compensate_neither_improves(monkeypatch, nominal, without):
    """Without one of them the simulation is worse than without both."""
    pose = Output(Input.TENSION, "bar/pose/heave", "m", "bar", Channel.WRENCH)
    fit = SimulatedFit(pose, 1.0, before=nominal, retuned=nominal, after=0.24, floor=0.1)
    mass, other = (Candidate(catalogue()[name], "bar") for name in ("bar_mass", "bar_com"))
    found = {mass: np.array([0.2]), other: np.array([-0.2])}
    monkeypatch.setattr(holdout_simulation, "_errors", lambda *_: {pose: (1.0, 0.4)})
    improvement = improvement_by(Baselines((), (), {}, {}), [fit], found, [mass])
    assert improvement == Improvement(pose.name, pose.unit, without, 0.24)
