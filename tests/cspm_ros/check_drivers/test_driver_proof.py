"""The wiggle of each winch: good drivers pass it, wrong ones are refused with the reason."""

import numpy as np
import pytest
from run_samples import bundle_of
from scipy.spatial.transform import Rotation

from cspm_msgs_py.errors import InputError
from cspm_msgs_py.message import message_of
from cspm_msgs_py.ros_types import serialize
from cspm_msgs_py.scenario_keys.drive import TORQUE_DRIVE
from cspm_msgs_py.schedule import BAR_POSE, FRAME_POSE, TENSION, TORQUE_COMMAND, WINCH_STATE
from cspm_ros.check_drivers.driver_proof import SILENT_NS, DriverProof
from cspm_ros.check_drivers.winch_wiggle import FARTHEST
from cspm_run.assembly import assemble
from cspm_sim.simulator import Simulator

MEASURED = (FRAME_POSE, BAR_POSE, WINCH_STATE, TENSION)
RATE, CABLES = 200, 8
START_NS = 1_700_000_000_000_000_000
SURGE_1, SURGE_2, SWAY_1, SWAY_3 = 2, 3, 4, 6


def exchanged(one, other):
    order = np.arange(CABLES)
    order[[one, other]] = order[[other, one]]
    return lambda row: row.reshape(-1, CABLES)[:, order].ravel()


def scaled(factor, *places):
    factors = np.ones(CABLES)
    factors[list(places) or slice(None)] = factor
    return lambda row: np.concatenate([row[:CABLES] * factors, row[CABLES:]])


def frozen(place):
    return lambda row: np.where(np.arange(CABLES) == place, 5.0, row)


def turned(degrees):
    turn = Rotation.from_euler("z", degrees, degrees=True)
    return lambda row: np.concatenate(
        [turn.apply(row[:3]), (turn * Rotation.from_quat(row[3:])).as_quat()]
    )


class Lab:
    """The simulated machine behind drivers that change what they send and obey."""

    def __init__(self, bundle, changes):
        self.testbed, self._changes = bundle.testbed.testbed, changes
        with bundle.unpacked() as place:
            parts = assemble(bundle.scenario, self.testbed, place)
        self.plant, self._per = parts.plant, bundle.scenario.rates.plant // RATE
        self._simulator = Simulator(
            parts.plant, parts.sensors, {}, period_ns=parts.period_ns, controlled=True
        )
        self._radii = np.array([c.drum_radius / c.gear_ratio for c in self.testbed.cables])
        self._before = parts.plant.angles.copy()
        self.farthest = self.tautest = 0.0

    def measured(self, topic):
        return self._changes.get(topic, lambda row: row)(self._simulator.measured[topic])

    def go_on(self, torque):
        """Obey a torque for one period of the drivers; None: as before."""
        if torque is not None:
            self._simulator.torque = self._changes.get(TORQUE_COMMAND, lambda row: row)(torque)
        for _ in range(self._per):
            self._simulator.advance()
            self._simulator.observe()
        wound = np.abs(self.plant.angles - self._before) * self._radii
        self.farthest = max(self.farthest, wound.max())
        self.tautest = max(self.tautest, self.plant.tensions.max())

    def observe(self):
        self._simulator.observe()


@pytest.fixture(scope="module")
def bundle():
    return bundle_of("rest")


def proved(bundle, **changes):
    """Put drivers to the proof; return it and their lab, and the refusal, None if they passed."""
    names = {"torque": TORQUE_COMMAND, "winches": WINCH_STATE, "cells": TENSION, "bar": BAR_POSE}
    lab = Lab(bundle, {names[key]: change for key, change in changes.items()})
    rates = bundle.scenario.rates.model_copy(update={"motion_capture": RATE})
    proof, now = DriverProof(lab.testbed, rates, MEASURED, TORQUE_DRIVE), START_NS
    lab.observe()
    try:
        while not proof.passed:
            for name in MEASURED:
                payload = serialize(message_of(lab.testbed.topics[name], now, lab.measured(name)))
                proof.hear(name, payload)
            command = proof.command(now)
            lab.go_on(None if command is None else command[1])
            now += 1_000_000_000 // RATE
    except InputError as err:
        return lab, str(err)
    return lab, None


def test_good_drivers_pass_and_nothing_goes_far(bundle):
    lab, refusal = proved(bundle)
    assert refusal is None
    assert lab.farthest < FARTHEST
    assert lab.tautest < 8.0
    assert np.abs(lab.plant.bar_state[:3] - [0.0, 0.0, 2.0]).max() < 0.02


def test_drives_that_fall_silent_in_the_wiggle_are_refused(bundle):
    lab = Lab(bundle, {})
    proof = DriverProof(lab.testbed, bundle.scenario.rates, MEASURED, TORQUE_DRIVE)
    lab.observe()
    now, period = START_NS, 1_000_000_000 // RATE
    while not proof.under_way:
        for name in MEASURED:
            payload = serialize(message_of(lab.testbed.topics[name], now, lab.measured(name)))
            proof.hear(name, payload)
        proof.command(now)
        now += period
    assert proof.command(now) is None
    assert proof.command(now + SILENT_NS - 2 * period) is None
    with pytest.raises(InputError, match=r"nothing new of /cables/tension and /winches/state for"):
        proof.command(now + SILENT_NS + period)


@pytest.mark.parametrize(
    ("changes", "reason"),
    [
        ({"cells": exchanged(SURGE_1, SURGE_2)}, "surge_1: is not the tension of its winch's"),
        ({"cells": frozen(SWAY_1)}, "sway_1: is not the tension of its winch's torque in the"),
        ({"bar": turned(90.0)}, "poses turned or mirrored?"),
        (
            {key: exchanged(SWAY_1, SWAY_3) for key in ("torque", "winches", "cells")},
            "sway_1: is not the length that its winch unwound in the wiggle: that of sway_3",
        ),
    ],
    ids=["cells", "frozen", "yaw", "winches"],
)
def test_what_a_wiggle_shows_is_refused_by_name(bundle, changes, reason):
    lab, refusal = proved(bundle, **changes)
    assert reason in refusal
    assert refusal.startswith("drivers: /")
    assert lab.farthest < FARTHEST


@pytest.mark.parametrize(
    "changes",
    [
        {"torque": scaled(-1.0)},
        {"torque": scaled(0.5)},
        {"torque": exchanged(SURGE_1, SURGE_2)},
        {"winches": exchanged(SWAY_1, SWAY_3)},
    ],
    ids=["sign", "gain", "torques", "angles"],
)
def test_a_winch_that_runs_away_ends_the_proof(bundle, changes):
    lab, refusal = proved(bundle, **changes)
    assert refusal.startswith("drivers: wiggle: ")
    assert "is a sign inverted, or the torque in another unit?" in refusal
    # What a drive does until it misses the commands is its own watchdog's matter.
    assert lab.farthest < 2.5 * FARTHEST
    assert lab.tautest < 15.0
