"""What a reference needs: by linear programmes, differences of lengths, and the run itself."""

import numpy as np
import pytest
from run_samples import bundle_of
from scipy.optimize import linprog

from cspm_control.analysis.reference_demand import first_unmet, reference_demand
from cspm_control.controllers.bar_dynamics import wrench_for
from cspm_control.stages.make import governed, wanted_tension_limits
from cspm_model.kernels.cable import INERTIA, RADIUS
from cspm_model.kinematics import geometry
from cspm_run.motions import motions_of

STEP = 0.01


@pytest.fixture(scope="module", params=["worst_case_steep", "ipanema"])
def asked(request):
    """A scenario's motions, its machine as governed, and what its reference needs."""
    bundle = bundle_of(request.param, "duration=20")
    scenario, testbed = bundle.scenario, bundle.testbed.testbed
    with bundle.unpacked() as folder:
        motions = motions_of(scenario, testbed, folder)
    bar, frame = motions["/bar/reference"], motions["/winch_frame/reference"]
    machine = governed(scenario, testbed, wanted_tension_limits(scenario.control, testbed))
    return request.param, machine, bar, frame, reference_demand(machine, bar, frame, 20.0, STEP)


def can_be_met(machine, bar, frame, time):
    """Whether any tensions within the limits give the wrench, by a linear programme."""
    pose, rate, acceleration = bar.at(time).reshape(3, 6)
    wrench, axes = np.empty(6), list(machine.axes)
    wrench_for(pose, rate, acceleration, machine.bar, wrench)
    structure = -geometry(machine.cables, pose, frame.at(time)[:6]).bar.T
    wanted = (wrench - machine.known_wrench)[axes]
    found = linprog(
        np.zeros(structure.shape[1]), A_eq=structure[axes], b_eq=wanted, bounds=machine.limits
    )
    return found.status == 0


def test_the_wrench_is_met_where_a_linear_programme_finds_tensions(asked):
    name, machine, bar, frame, demand = asked
    few = range(0, len(demand.times), 7)
    expected = [can_be_met(machine, bar, frame, demand.times[k]) for k in few]
    assert np.mean(demand.met[::7] == expected) > 0.99
    assert all(expected) == (name == "ipanema")
    assert (demand.worst is None) == demand.met.all() == (name == "ipanema")


def test_where_it_is_met_tensions_are_within_their_limits(asked):
    _, machine, _, _, demand = asked
    tensions = demand.tensions[demand.met]
    assert (tensions >= machine.limits[:, 0] - 1e-6).all()
    assert (tensions <= machine.limits[:, 1] + 1e-6).all()
    assert np.abs(demand.missing[demand.met]).max() < 0.01


def test_speeds_and_torques_follow_from_lengths(asked):
    _, machine, bar, frame, demand = asked
    cables, h = machine.cables, 1e-4
    radius, inertia = cables[:, RADIUS], cables[:, INERTIA]

    def lengths(time):
        return geometry(cables, bar.at(time)[:6], frame.at(time)[:6]).lengths

    for k in range(100, len(demand.times) - 100, 397):
        before, here, after = (lengths(demand.times[k] + d) for d in (-h, 0.0, h))
        assert demand.speeds[k] == pytest.approx(-(after - before) / (2.0 * h * radius), abs=1e-3)
        bent = -(after - 2.0 * here + before) / h**2
        expected = radius * demand.tensions[k] + inertia * bent / radius
        assert demand.torques[k] == pytest.approx(expected, rel=1e-2, abs=1e-3)


def test_the_facets_find_the_first_instant_that_a_linear_programme_cannot_meet(asked):
    name, machine, bar, frame, _ = asked
    found = first_unmet(machine, bar, frame, 20.0, 301)
    if name == "ipanema":
        assert found is None
        return
    times = np.linspace(0.0, 20.0, 301)
    assert found == next(t for t in times if not can_be_met(machine, bar, frame, t))


def test_what_is_to_fall_faster_than_gravity_misses_heave():
    falling = "{type: sines, sines: {heave: [{amplitude: 0.2, frequency: 1.5}]}}"
    bundle = bundle_of("stadium_camera", "duration=5", f"target.motion={falling}")
    scenario, testbed = bundle.scenario, bundle.testbed.testbed
    with bundle.unpacked() as folder:
        motions = motions_of(scenario, testbed, folder)
    bar, frame = motions["/bar/reference"], motions["/winch_frame/reference"]
    machine = governed(scenario, testbed, wanted_tension_limits(scenario.control, testbed))
    demand = reference_demand(machine, bar, frame, 5.0, STEP)
    time, dof = demand.worst
    assert not demand.met[round(time / STEP)]
    assert dof == "heave"
    assert bar.at(time)[14] > 9.81
