"""Energy and work along runs of the plant, booked with the independent machine's geometry."""

from typing import NamedTuple

import numpy as np
import pytest
from independent_plant import IndependentPlant, scaled_elongation, slope
from machines import LINEAR, build, general_content
from plant_samples import make_plant, random_motion, swell
from scipy.integrate import simpson
from scipy.interpolate import CubicHermiteSpline

from cspm_model.motion import Motion
from cspm_sim.plant import Plant

NODES, WEIGHTS = np.polynomial.legendre.leggauss(8)


def stored_curve(law):
    """∫ t dt/g(t): the elastic energy of an exponential cable, times a/l^b."""
    edges = np.concatenate([[0.0], np.geomspace(law.floor_tension, 200.0, 4000)])
    half = np.diff(edges)[:, None] / 2
    points = edges[:-1, None] + half * (1 + NODES)
    pieces = points / slope(law, np.maximum(points, law.floor_tension)) * WEIGHTS * half
    values = np.concatenate([[0.0], np.cumsum(pieces.sum(axis=1))])
    return CubicHermiteSpline(edges, values, edges / slope(law, np.maximum(edges, 0.05)))


def elongation(law, tension):
    """Elongation at a tension, times a/l^b."""
    if tension <= law.floor_tension:
        return tension / slope(law, law.floor_tension)
    return scaled_elongation(law, tension)


class Books(NamedTuple):
    """One instant: energy, and the powers that change it."""

    energy: float
    motors: float
    frame: float
    dampers: float
    winding: float  # stretched cable goes on the drum as unstretched: (2-16) against (2-18)
    stiffening: float  # the elastic length of a strained cable changes


class Bookkeeper:
    def __init__(self, testbed, motion):
        self.other = IndependentPlant(testbed, motion)
        self.testbed = testbed
        self.curves = [
            None if c.stiffness.law == "linear" else stored_curve(c.stiffness)
            for c in testbed.cables
        ]

    def elastic(self, tension, length, i):
        """Elastic energy of cable i and its slope over the elastic length at fixed elongation."""
        law = self.testbed.cables[i].stiffness
        if law.law == "linear":
            stretch = tension * length / law.axial_rigidity
            return 0.5 * tension * stretch, -0.5 * tension * stretch / length
        scale = law.a / length**law.b
        stored = float(self.curves[i](tension)) / scale
        stretch = elongation(law, tension) / scale
        return stored, law.b / length * (stored - tension * stretch)

    def at(self, time, state, torque):
        other, y = self.other, self.other.import_state(state)
        tension, elastic, rates, wound, unit = other.tensions(time, y)
        _, exit_rates, _, _ = other.ends(time, y)
        speeds = y[other.first + 2 * other.n :]
        energy = 0.5 * np.sum(other.inertias * speeds**2)
        if other.bar:
            velocity, spin = y[12:15] / other.bar.mass, y[15:18]
            turn = y[3:12].reshape(3, 3) @ state[9:12]
            energy += 0.5 * other.bar.mass * velocity @ velocity + 0.5 * spin @ turn
            energy -= other.bar.mass * self.testbed.gravity * y[2]
        stiffening = 0.0
        lengths = y[other.first : other.first + other.n] + other.offsets
        for i in range(other.n):
            stored, over_length = self.elastic(elastic[i], lengths[i], i)
            energy += stored
            stiffening += over_length * wound[i]
        drum = other.radii * speeds
        return Books(
            energy=energy,
            motors=float(np.clip(torque, -other.limits, other.limits) @ speeds),
            frame=-float(tension @ np.sum(unit * exit_rates, axis=1)),
            dampers=-float((tension - elastic) @ (rates - wound)),
            winding=-float(tension @ (wound + drum)),
            stiffening=stiffening,
        )


def book(plant, torque, steps, every=2):
    keeper = Bookkeeper(plant.testbed, plant.frame_motion)
    entries = [keeper.at(plant.time, plant.state, torque)]
    for k in range(steps):
        plant.step(torque)
        if (k + 1) % every == 0:
            entries.append(keeper.at(plant.time, plant.state, torque))
    return Books(*np.array(entries).T)


def work(power, plant, every=2):
    return simpson(power, dx=every * plant.period_ns * 1e-9)


@pytest.fixture(scope="module")
def machines(thesis, rig, general):
    linear = build(general_content(LINEAR))
    return {"thesis": thesis, "rig": rig, "general": general, "linear": linear}


@pytest.mark.parametrize("name", ["thesis", "rig", "general", "linear"])
def test_energy_changes_by_the_work_that_is_done(machines, name):
    plant = make_plant(machines[name], swell(share=0.4), period_ns=100_000)
    rng = np.random.default_rng(6)
    n = len(plant.tensions)
    torque = plant.parameters.cables[:, 18] * plant.tensions * rng.uniform(0.7, 1.4, n)
    books = book(plant, torque, steps=1600)
    works = {key: work(getattr(books, key), plant) for key in Books._fields[1:]}
    change = books.energy[-1] - books.energy[0]
    moved = np.sum(np.abs(list(works.values())))
    assert change == pytest.approx(sum(works.values()), abs=1e-7 * moved)
    # Each entry is there for a reason: without it the books are off by far more than that.
    still = {"frame"} if machines[name].winch_frame is None and name != "rig" else set()
    for key in set(works) - still:
        assert abs(works[key]) > 1e-5 * moved
    assert works["dampers"] < 0.0


@pytest.mark.slow
def test_energy_is_booked_where_cables_slacken_and_catch(machines):
    plant = make_plant(machines["general"], random_motion(seed=8), period_ns=50_000)
    plant.bar_state[6:] = [0.3, -0.2, 0.5, 1.0, -0.8, 0.6]
    books = book(plant, np.full(8, 0.05), steps=4000)
    works = [work(getattr(books, key), plant) for key in Books._fields[1:]]
    moved = np.sum(np.abs(works))
    assert books.energy[-1] - books.energy[0] == pytest.approx(sum(works), abs=1e-3 * moved)
    assert (books.dampers <= 1e-12).all()


def test_without_damping_and_work_the_energy_stays(machines):
    cables = tuple(
        c.model_copy(update={"damping": c.damping.model_copy(update={"factor": 0.0})})
        for c in machines["general"].cables
    )
    testbed = machines["general"].model_copy(update={"cables": cables})
    still = Motion.still(np.array([0.05, 0.02, 0.05, 0.01, -0.02, 0.03]))
    plant = Plant(testbed, still, 100_000, bar_pose=[0.05, 0, 2, 0, 0, 0], locked=True)
    plant.bar_state[6:] = [0.02, -0.02, 0.01, 0.05, 0.1, -0.1]
    keeper = Bookkeeper(testbed, still)
    none = np.zeros(8)
    start = keeper.at(0.0, plant.state, none).energy
    drift, kinetic = 0.0, 0.0
    for _ in range(20):
        for _ in range(500):
            plant.step(none)
        now = keeper.at(plant.time, plant.state, none).energy
        drift = max(drift, abs(now - start))
        kinetic = max(kinetic, plant.bar_state[6:9] @ plant.bar_state[6:9])
    assert kinetic > 1e-4
    assert drift < 1e-7
