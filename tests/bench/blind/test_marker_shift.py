"""What shifted markers show: in the geometry by other roads, and against the noise of a reading."""

import numpy as np
import pytest
from machines import random_poses
from scipy.spatial.transform import Rotation

pytest.importorskip("mujoco", minversion="4.0", reason="the MuJoCo plant needs MuJoCo 4")
from bench.blind.concealed_run import believed, machine_of, watch
from bench.blind.reality.detection_limit import detection_limits, noise_of, rms, stiffnesses
from bench.blind.reality.faults import MarkerShift
from bench.blind.reality.marker_shift import length_changes, tension_changes, wrench_changes
from bench.blind.reality.reality import conceal
from cspm_model.kinematics import geometry
from cspm_sim.mujoco.influence import Scene
from cspm_sim.parameters import plant_parameters

TENSION = 5.0
SHIFT = 1e-4
QUARTER = np.pi / 2
ORIGIN = np.zeros(6)


def turned(pose):
    """R_world_body of x y z φ θ ψ."""
    return Rotation.from_euler("ZYX", pose[:2:-1]).as_matrix()


def scene(exits, attachments, pose, frame=ORIGIN, tensions=None):
    """Cables between a winch frame and a bar, both standing still."""
    pose, n = np.asarray(pose, dtype=float), len(exits)
    ends = np.vstack([frame[:3] + exits @ turned(frame).T, pose[:3] + attachments @ turned(pose).T])
    still = np.zeros(6)
    return Scene(
        0.0,
        *np.zeros((3, n)),
        np.full(n, TENSION) if tensions is None else tensions,
        np.ones(n),
        ends,
        np.concatenate([frame[:3], still]),
        np.concatenate([pose[:3], still]),
        turned(pose),
    )


def one_cable(place, angles=(0.0, 0.0, 0.0), attachment=(0.0, 0.0, 0.0)):
    """A cable from the world's origin to a bar whose origin is at a place."""
    return scene(np.zeros((1, 3)), np.array([attachment]), [*place, *angles])


def of_machine(machine, pose, frame=ORIGIN, tensions=None):
    exits, attachments = (np.array([getattr(c, end) for c in machine.cables])
                          for end in ("exit", "attachment"))  # fmt: skip
    return scene(exits, attachments, pose, frame, tensions)


@pytest.mark.parametrize(
    ("place", "angles", "longer"),
    [
        ((2.0, 0.0, 0.0), (0.0, 0.0, -QUARTER), 1.0),
        ((2.0, 0.0, 0.0), (0.0, 0.0, QUARTER), -1.0),
        ((2.0, 0.0, 0.0), (0.0, 0.0, 0.0), 0.0),
        ((0.0, 0.0, 2.0), (QUARTER, 0.0, 0.0), 1.0),
        ((0.0, -2.0, 0.0), (0.0, 0.3, 0.0), -1.0),
    ],
)
def test_a_cable_along_the_shift_is_longer_by_it(place, angles, longer):
    """A bar turned to port (ψ < 0) has its y, and with it the shift, along world x."""
    assert length_changes([one_cable(place, angles)]) == pytest.approx(np.array([[longer]]))


def test_a_hanging_bar_taken_to_be_at_starboard_is_taken_to_be_pulled_to_port():
    """−t/l for a cable across the shift, and its moment about the bar's origin."""
    hung = one_cable((-0.3, 0.0, 2.0), attachment=(0.3, 0.0, 0.0))
    side = -TENSION / 2.0
    expected = [0.0, side, 0.0, 0.0, 0.0, 0.3 * side]
    assert wrench_changes([hung])[0] == pytest.approx(expected, abs=1e-8)


@pytest.mark.parametrize(
    ("pose", "frame"),
    list(
        zip(
            random_poses(4, seed=3, centre=(0.0, 0.0, 2.0), reach=0.3, angle=0.4),
            random_poses(4, seed=4, centre=(0.0, 0.0, 0.0), reach=0.2, angle=0.3),
            strict=True,
        )
    ),
)
def test_it_is_what_the_model_makes_of_the_pose_that_such_markers_tell(general, pose, frame):
    """By the model's lengths and −Jᵀt at readings of the fault itself, 0.1 mm to either side."""
    tensions = np.random.default_rng(5).uniform(3.0, 8.0, len(general.cables))
    now = [of_machine(general, pose, frame, tensions)]
    ahead, behind = (
        geometry(plant_parameters(general).cables, MarkerShift(side)(pose, 0.0), frame)
        for side in (SHIFT, -SHIFT)
    )
    longer = (ahead.lengths - behind.lengths) / (2.0 * SHIFT)
    wrench = (behind.bar - ahead.bar).T @ tensions / (2.0 * SHIFT)
    assert length_changes(now)[0] == pytest.approx(longer, abs=1e-7)
    assert wrench_changes(now)[0] == pytest.approx(wrench, abs=1e-6)


def test_a_bar_that_stands_still_shows_nothing_in_tensions_but_is_pulled_aside(thesis):
    still = [of_machine(thesis, [0.02, 0.03, 2.0, 0.05, 0.0, 0.1])] * 5
    slopes = stiffnesses(still, thesis)
    assert np.max(np.abs(length_changes(still))) > 0.1
    assert tension_changes(still, slopes) == pytest.approx(np.zeros((5, 8)), abs=1e-6)
    assert np.linalg.norm(rms(wrench_changes(still))[:3]) > 1.0


def test_tensions_show_what_changes_as_the_bar_moves():
    """Cables that turn from across to along the shift: 0 and 1 m/m, with ½ between them."""
    across, along = one_cable((0.0, 0.0, 2.0)), one_cable((0.0, 2.0, 0.0))
    found = tension_changes([across, along], np.array([1000.0]))
    assert found == pytest.approx(np.array([[-500.0], [500.0]]))


def test_a_still_bars_limit_is_that_of_the_force_across_its_cables(thesis):
    """Of each cable t/l times what of the shift is across it."""
    now = of_machine(thesis, [0.0, 0.0, 2.0, 0.0, 0.0, 0.0])
    exits, ends = np.split(now.ends, 2)
    lengths = np.linalg.norm(ends - exits, axis=1)
    directions = (ends - exits) / lengths[:, None]
    across = np.array([0.0, 1.0, 0.0]) - directions[:, 1:2] * directions
    pull = np.linalg.norm((TENSION / lengths) @ across)
    still = [now._replace(time=0.005 * i) for i in range(5)]
    noise = noise_of(thesis, stiffnesses(still, thesis))
    (limit,) = detection_limits(still, thesis)["shifted markers"]
    assert limit == pytest.approx(noise.force / pull)


@pytest.mark.parametrize("scenario", ["worst_case_steep", "factor_six_mid"])
def test_where_the_bar_moves_markers_must_be_farther_out_than_a_reading_is_noisy(scenario):
    machine = machine_of(scenario)
    scenes = watch(believed(scenario, 10.0, 1), conceal(machine, {}, 0.0, 1), 7.0)[::10]
    slopes = stiffnesses(scenes, machine)
    noise = noise_of(machine, slopes)
    (limit,) = detection_limits(scenes, machine)["shifted markers"]
    assert 10.0 * noise.position < limit < 1e-2
