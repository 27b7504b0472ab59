"""Wrong drivers, one after another, at the start of a run on hardware.

    python -m bench.faults.drivers [NAME…] [--no-brakes]

Each drives the simulated machine of `rest`, whose drives hold it. A run begins as with `--plant
external`: it listens for a second and wiggles each winch. Safe means that the drivers are refused,
tensions stay below their limits, and the bar within 0.1 m of where it hung. A refusal sets the
brakes; drives without any miss the commands for 50 ms, and then hold.
"""

from __future__ import annotations

import argparse
import sys

import numpy as np
from scipy.spatial.transform import Rotation

from bench.faults.driver_lab import Array, Change, WrongDrivers, renamed, started
from cspm_msgs_py.scenario import load_scenario
from cspm_msgs_py.schedule import BAR_POSE, TENSION, TORQUE_COMMAND, WINCH_STATE
from cspm_msgs_py.testbed import load_testbed
from cspm_run.assembly import resolve
from cspm_run.bundle import make_bundle
from cspm_run.library import find_scenario

CABLES = 8
SURGE_1, SURGE_2, SWAY_1, SWAY_2, SWAY_3 = 2, 3, 4, 5, 6
FARTHEST_M = 0.1


def exchanged(one: int, other: int) -> Change:
    """Return what exchanges two cables in all parts of a row."""
    order = np.arange(CABLES)
    order[[one, other]] = order[[other, one]]
    return lambda row: row.reshape(-1, CABLES)[:, order].ravel()


def scaled(factor: float, *places: int) -> Change:
    """Return what multiplies numbers of a row, the first of all cables unless some are named."""

    def change(row: Array) -> Array:
        found = row.copy()
        found[list(places) or slice(CABLES)] *= factor
        return found

    return change


def turned(degrees: float) -> Change:
    """Return what turns a pose about the world's z."""
    turn = Rotation.from_euler("z", degrees, degrees=True)
    return lambda row: np.concatenate(
        [turn.apply(row[:3]), (turn * Rotation.from_quat(row[3:])).as_quat()]
    )


def _frozen(row: Array) -> Array:
    return np.where(np.arange(CABLES) == SWAY_2, 5.0, row)


def _upwards(row: Array) -> Array:
    return row * [1.0, -1.0, -1.0, 1.0, -1.0, -1.0, 1.0]


_SWAYS = exchanged(SWAY_1, SWAY_3)
WRONG: dict[str, WrongDrivers] = {
    "order": WrongDrivers(
        rows={TENSION: lambda row: row[::-1]}, topics={TENSION: renamed(*range(CABLES)[::-1])}
    ),
    "missing joint": WrongDrivers(topics={TENSION: renamed(*range(CABLES - 1))}),
    "grams": WrongDrivers(rows={TENSION: scaled(1e3 / 9.80665)}),
    "kilograms": WrongDrivers(rows={TENSION: scaled(1.0 / 9.80665)}),
    "millimetres": WrongDrivers(rows={BAR_POSE: scaled(1e3, 0, 1, 2)}),
    "degrees": WrongDrivers(rows={WINCH_STATE: scaled(180.0 / np.pi)}),
    "z up": WrongDrivers(rows={BAR_POSE: _upwards}),
    "w first": WrongDrivers(rows={BAR_POSE: lambda row: row[[0, 1, 2, 6, 3, 4, 5]]}),
    "NaN": WrongDrivers(rows={BAR_POSE: scaled(np.nan, 0)}),
    "other clock": WrongDrivers(late_ns=20_000_000_000),
    "quarter rate": WrongDrivers(every=4),
    "gain 0.5": WrongDrivers(rows={TORQUE_COMMAND: scaled(0.5)}),
    "frozen cell": WrongDrivers(rows={TENSION: _frozen}),
    "sign of torques": WrongDrivers(rows={TORQUE_COMMAND: scaled(-1.0)}),
    "sign of one torque": WrongDrivers(rows={TORQUE_COMMAND: scaled(-1.0, SWAY_1)}),
    "sign of one angle": WrongDrivers(rows={WINCH_STATE: scaled(-1.0, SURGE_1, SURGE_1 + CABLES)}),
    "exchanged cells": WrongDrivers(rows={TENSION: exchanged(SURGE_1, SURGE_2)}),
    "exchanged torques": WrongDrivers(rows={TORQUE_COMMAND: exchanged(SURGE_1, SURGE_2)}),
    "exchanged angles": WrongDrivers(rows={WINCH_STATE: _SWAYS}),
    "exchanged winches": WrongDrivers(
        rows=dict.fromkeys((TORQUE_COMMAND, WINCH_STATE, TENSION), _SWAYS)
    ),
    "yaw 90°": WrongDrivers(rows={BAR_POSE: turned(90.0)}),
}


def main() -> int:
    """Let them drive; return 0 where all were refused and nothing unsafe came of it."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("names", nargs="*", help=f"some of: {', '.join(WRONG)}; all if absent")
    parser.add_argument("--no-brakes", action="store_true", help="the winches have none")
    options = parser.parse_args()
    wanted = options.names or list(WRONG)
    path = find_scenario("rest")
    scenario = load_scenario(path)
    testbed = load_testbed(path.parent / scenario.testbed)
    bundle = make_bundle(resolve(scenario, testbed.testbed, path.parent), testbed, path.parent)
    unsafe = 0
    for name in wanted:
        found = started(bundle, WRONG[name], brakes=not options.no_brakes)
        bad = found.refusal is None or found.tautest > 1.0 or found.astray > FARTHEST_M
        unsafe += bad
        print(
            f"{'UNSAFE ' if bad else ''}{name}: {found.refusal or 'not refused'}\n"
            f"    cable at most {1e3 * found.farthest:.1f} mm, bar {1e3 * found.astray:.1f} mm,"
            f" tension {100.0 * found.tautest:.0f} % of its limit"
        )
    print(f"{len(wanted)} wrong drivers, {unsafe} unsafe")
    return 1 if unsafe else 0


if __name__ == "__main__":
    sys.exit(main())
