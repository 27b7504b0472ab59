"""The wiggle of each winch: good drivers pass it, wrong ones are refused with the reason."""

import pytest
from ros_graph import load_ros
from run_samples import bundle_of

load_ros()

from bench.faults.driver_lab import (  # noqa: E402
    MEASURED,
    PERIOD_NS,
    START_NS,
    DriverLab,
    WrongDrivers,
    started,
)
from bench.faults.drivers import FARTHEST_M, WRONG  # noqa: E402
from cspm_msgs_py.errors import InputError  # noqa: E402
from cspm_msgs_py.scenario_keys.drive import TORQUE_DRIVE  # noqa: E402
from cspm_ros.check_drivers.driver_proof import SILENT_NS, DriverProof  # noqa: E402
from cspm_ros.check_drivers.winch_wiggle import FARTHEST, TRAVEL  # noqa: E402

RUNAWAY = "is a sign inverted, or the torque in another unit?"


@pytest.fixture(scope="module")
def bundle():
    return bundle_of("rest")


@pytest.mark.parametrize("drive", ["torque", "tension"])
def test_good_drivers_pass_and_nothing_goes_far(drive):
    bundle = bundle_of("rest", f"drive={drive}")
    radii = [each.drum_radius / each.gear_ratio for each in bundle.testbed.testbed.cables]
    wound = {"/winches/torque_command": lambda row: row * radii} if drive == "tension" else {}
    found = started(bundle, WrongDrivers(rows=wound))
    assert found.refusal is None
    assert TRAVEL <= found.farthest < FARTHEST
    assert found.astray < 0.02
    assert found.tautest < 0.5


@pytest.mark.parametrize(
    ("name", "reason"),
    [
        ("order", "drivers: /cables/tension: all messages: order sway_4 "),
        ("degrees", "drivers: /cables/tension: all: does not answer the wiggle"),
        ("exchanged cells", "drivers: /cables/tension: surge_1: is not the tension of its winch's"),
        ("yaw 90°", "or are poses turned or mirrored?"),
        ("sign of torques", RUNAWAY),
        ("exchanged angles", RUNAWAY),
    ],
)
def test_wrong_drivers_are_refused_and_nothing_breaks(bundle, name, reason):
    # Without brakes the drives go on for as long as their watchdogs wait.
    found = started(bundle, WRONG[name], brakes=False)
    assert reason in found.refusal
    assert found.astray < FARTHEST_M
    assert found.tautest < 1.0


def test_drives_that_fall_silent_in_the_wiggle_are_refused(bundle):
    lab = DriverLab(bundle, WrongDrivers())
    proof = DriverProof(lab.testbed, lab.rates, MEASURED, TORQUE_DRIVE)
    step = 0
    while not proof.under_way:
        for name, payload in lab.payloads(step).items():
            proof.hear(name, payload)
        proof.command(START_NS + step * PERIOD_NS)
        step += 1
    now_ns = START_NS + step * PERIOD_NS
    assert proof.command(now_ns) is None
    assert proof.command(now_ns + SILENT_NS - 2 * PERIOD_NS) is None
    with pytest.raises(InputError, match=r"nothing new of /cables/tension and /winches/state for"):
        proof.command(now_ns + SILENT_NS + PERIOD_NS)
