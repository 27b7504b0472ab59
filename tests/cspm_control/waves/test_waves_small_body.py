"""The laws are checked against the moving water surface itself, differentiated numerically."""

import numpy as np
import pytest

from cspm_control.waves.small_body import small_body_response

K, OMEGA = 0.4, np.sqrt(0.4 * 9.81)
DIRECTIONS = [0.0, 0.5, np.pi / 2, 2.2, np.pi, 4.0, -0.8]


def elevation(x, y, t, direction):
    return np.cos(OMEGA * t - K * (x * np.cos(direction) + y * np.sin(direction)))


def drift(x, y, t, direction):
    """Horizontal displacement of a particle: its rate is along travel and greatest at the crest."""
    along = np.sin(OMEGA * t - K * (x * np.cos(direction) + y * np.sin(direction)))
    return along * np.array([np.cos(direction), np.sin(direction)])


def body(t, direction, yaw=0.0):
    response = small_body_response(np.array([direction]), np.array([K]), yaw)[0]
    return np.real(response * np.exp(1j * OMEGA * t))


def rotation(roll, pitch, yaw):
    cr, sr, cp, sp, cy, sy = (f(a) for a in (roll, pitch, yaw) for f in (np.cos, np.sin))
    rz = np.array([[cy, -sy, 0], [sy, cy, 0], [0, 0, 1]])
    ry = np.array([[cp, 0, sp], [0, 1, 0], [-sp, 0, cp]])
    rx = np.array([[1, 0, 0], [0, cr, -sr], [0, sr, cr]])
    return rz @ ry @ rx


@pytest.mark.parametrize("direction", DIRECTIONS)
@pytest.mark.parametrize("t", [0.0, 0.3, 0.9, 1.7])
def test_floats_on_the_surface(direction, t):
    assert body(t, direction)[2] == pytest.approx(-elevation(0, 0, t, direction))


@pytest.mark.parametrize("direction", DIRECTIONS)
def test_moves_with_the_wave_under_a_crest_and_against_it_in_a_trough(direction):
    travel = np.array([np.cos(direction), np.sin(direction)])
    for t, side in ((0.0, 1.0), (np.pi / OMEGA, -1.0)):
        rate = (body(t + 1e-6, direction) - body(t - 1e-6, direction))[:2] / 2e-6
        assert elevation(0, 0, t, direction) == pytest.approx(side)
        assert rate == pytest.approx(side * OMEGA * travel, abs=1e-6)


@pytest.mark.parametrize("direction", DIRECTIONS)
@pytest.mark.parametrize("yaw", [0.0, 0.7, -2.0])
def test_its_deck_stays_parallel_to_the_surface(direction, yaw):
    h = 1e-5
    for t in (0.2, 0.8, 1.4):
        slope = [
            (elevation(h, 0, t, direction) - elevation(-h, 0, t, direction)) / (2 * h),
            (elevation(0, h, t, direction) - elevation(0, -h, t, direction)) / (2 * h),
        ]
        # The surface is z = -η; the normal that points down is (∂η/∂x, ∂η/∂y, 1). Small angles:
        small = 1e-4
        normal = np.array([small * slope[0], small * slope[1], 1.0])
        roll, pitch = small * body(t, direction, yaw)[3:5]
        down = rotation(roll, pitch, yaw)[:, 2]
        assert down == pytest.approx(normal, abs=1e-7)


@pytest.mark.parametrize("direction", DIRECTIONS)
@pytest.mark.parametrize("yaw", [0.0, 0.7])
def test_a_slender_body_turns_with_the_water(direction, yaw):
    ahead, abeam = np.array([np.cos(yaw), np.sin(yaw)]), np.array([-np.sin(yaw), np.cos(yaw)])
    h = 1e-5
    for t in (0.0, 0.2, 0.8):
        bow, stern = drift(*(h * ahead), t, direction), drift(*(-h * ahead), t, direction)
        turn = float((bow - stern) @ abeam / (2 * h))
        assert body(t, direction, yaw)[5] == pytest.approx(turn, abs=1e-8)


def test_bow_rises_first_in_meeting_waves_and_stern_first_in_following_waves():
    quarter_before_crest = -0.5 * np.pi / OMEGA
    assert body(quarter_before_crest, np.pi)[4] == pytest.approx(K)
    assert body(quarter_before_crest, 0.0)[4] == pytest.approx(-K)


def test_waves_from_port_lift_the_port_side_first():
    quarter_before_crest = -0.5 * np.pi / OMEGA
    assert body(quarter_before_crest, np.pi / 2)[3] == pytest.approx(K)
    assert body(quarter_before_crest, -np.pi / 2)[3] == pytest.approx(-K)


def test_turning_the_waves_about_flips_surge_and_pitch_against_heave():
    ahead, astern = (
        small_body_response(np.array([heading]), np.array([K]))[0] for heading in (0.3, 0.3 + np.pi)
    )
    assert astern[[0, 1, 3, 4]] == pytest.approx(-ahead[[0, 1, 3, 4]])
    assert astern[[2, 5]] == pytest.approx(ahead[[2, 5]])


def test_following_waves_move_nothing_sideways():
    response = small_body_response(np.array([0.0]), np.array([K]))[0]
    assert np.abs(response[[1, 3, 5]]).max() == 0.0
    assert np.abs(response[[0, 2, 4]]).min() > 0.1
