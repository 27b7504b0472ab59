"""What a bar's distance from its reference may be by default: three times what a run shows."""

import numpy as np
import pytest
from run_samples import bundle_of, run_to

from cspm_control.plausibility.make import body_points, machine_size
from cspm_ros.runtime.tracking_error import following_error, tracking_error

SHORT = "duration=20"
HALF = 0.5
"""Of the thesis's machine [m]."""


def recorded_error(folder, *overrides):
    """Return how far attachments were from their reference in a recorded run [m]."""
    _, rows = run_to(folder, *overrides)
    found, wanted = rows["/truth/bar/pose"], rows["/bar/reference"]
    points = body_points(bundle_of(*overrides).testbed.testbed)[1]
    stamps, first, second = np.intersect1d(
        found.stamp_ns, wanted.stamp_ns, assume_unique=True, return_indices=True
    )
    assert len(stamps) > 100
    apart = [
        placed(found.rows[i], points) - placed(wanted.rows[k], points)
        for i, k in zip(first, second, strict=True)
    ]
    return np.linalg.norm(apart, axis=2).max()


def placed(row, points):
    x, y, z, w = row[3:7]
    cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    rotation = np.eye(3) + 2.0 * (w * cross + cross @ cross)
    return row[:3] + points @ rotation.T


@pytest.mark.parametrize("name", ["worst_case", "worst_case_steep", "calm"])
def test_it_is_that_of_the_run(tmp_path, name):
    found = recorded_error(tmp_path / "bag", name, SHORT)
    required = tracking_error(bundle_of("rest", "duration=1"))
    assert tracking_error(bundle_of(name, SHORT)) == pytest.approx(max(found, required), rel=0.1)


def test_at_rest_it_is_what_the_scenario_requires():
    arm = np.linalg.norm(body_points(bundle_of("rest").testbed.testbed)[1], axis=1).max()
    bundle = bundle_of("rest", "duration=1")
    assert tracking_error(bundle) == pytest.approx(0.002 + 0.004 * arm)
    assert following_error(bundle) == pytest.approx(3.0 * (0.002 + 0.004 * arm))
    larger = bundle_of("rest", "duration=1", "requirement.position=0.02")
    assert tracking_error(larger) == pytest.approx(0.02 + 0.004 * arm)


def test_the_scenarios_own_number_counts():
    assert following_error(bundle_of("rest", "safety.following_error=0.3")) == 0.3


def test_it_is_never_more_than_half_the_machine():
    bundle = bundle_of("worst_case_4m", "duration=60")
    assert tracking_error(bundle) is None
    assert following_error(bundle) == 0.5 * machine_size(bundle.testbed.testbed) == HALF


def test_faults_are_no_part_of_it():
    fault = 'faults=[{"at": 0.2, "fault": "sensor_biased", "on": "/bar/pose", "amount": 0.2}]'
    bundle = bundle_of("rest", "duration=3", fault)
    assert tracking_error(bundle) == tracking_error(bundle_of("rest", "duration=3"))
