"""Ropes with mass, a frame that gives way and drives that are late, against what defines them."""

from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("mujoco", minversion="4.0", reason="the MuJoCo plant needs MuJoCo 4")
from bench.blind.reality.alterations import surveyed
from bench.blind.reality.detection_limit import detection_limits
from bench.blind.reality.drive import SlowDrive
from bench.blind.reality.frame import YIELDING_HZ, YIELDING_SHARES, YieldingFrame
from bench.blind.reality.heavy_rope import LUMPS, THREAD, HeavyRope
from bench.blind.reality.modes import swung
from bench.blind.reality.moments import moment, turned
from cspm_msgs_py.testbed import load_testbed
from cspm_sim.mujoco.influence import Acting, Scene

MS, GRAVITY, LENGTH, DENSITY = 1e-3, 9.81, 2.0, 0.02
LEVEL, DOWN, SLOPING = np.array([[1, 0, 0]]), np.array([[0, 0, 1]]), np.array([[0.6, 0, 0.8]])

THESIS = Path(__file__).resolve().parents[3] / "scenarios/testbeds/thesis.yaml"


@pytest.fixture(scope="module")
def eight():
    return load_testbed(THESIS).testbed


def scene(along=DOWN, tension=5.0, body=(0, 0, 0), rate=(0, 0, 0), frame=(0, 0, 0), origin=None):
    """Cables from the origin; `body`, `frame`: velocities; the bar's origin is at the first end."""
    ends = LENGTH * np.asarray(along, dtype=float)
    n = len(ends)
    return Scene(
        0.0,
        *(np.zeros(n) for _ in range(3)),
        np.full(n, tension),
        np.full(n, LENGTH),
        np.vstack([np.zeros((n, 3)), ends]),
        np.array([0, 0, 0, *frame, 0, 0, 0], dtype=float),
        np.array([*(ends[0] if origin is None else origin), *body, *rate], dtype=float),
        np.eye(3),
    )


def test_a_survey_puts_exits_anywhere_and_attachments_along_the_bar(eight):
    def off(key, error, seed):
        found = surveyed(eight, error, np.random.default_rng(seed)).cables
        pairs = zip(found, eight.cables, strict=True)
        return np.array([np.subtract(getattr(a, key), getattr(b, key)) for a, b in pairs])

    exits = np.concatenate([off("exit", 1e-3, seed) for seed in range(50)])
    attachments = np.concatenate([off("attachment", 1e-3, seed) for seed in range(50)])
    assert exits.std(axis=0) == pytest.approx([1e-3] * 3, rel=0.15)
    assert attachments.std(axis=0) == pytest.approx([1e-3, 0.0, 0.0], rel=0.15)
    assert abs(exits.mean()) < 2e-4
    assert surveyed(eight, 0.0, np.random.default_rng(1)) == eight


def acted(influence, now):
    acting = Acting(len(now.tensions))
    influence.act(now, acting)
    return acting


def after(influence, now, seconds):
    for _ in range(round(seconds / MS)):
        influence.advance(now, MS)
    return acted(influence, now)


def rope(density=DENSITY, drag=0.0, gravity=GRAVITY):
    return HeavyRope(np.array([density]), np.array([drag]), gravity)


@pytest.mark.parametrize("along", [LEVEL, SLOPING, DOWN, -DOWN])
def test_half_of_a_ropes_weight_hangs_on_the_bar_and_half_on_the_exit(along):
    """By the rope's own balance: what exit and bar carry is its weight."""
    now, weight = scene(along), DENSITY * GRAVITY * LENGTH
    found = after(rope(), now, 0.1)
    assert found.tension == pytest.approx([0.5 * weight * along[0, 2]])
    # The plant lets the tension that the exit feels pull at the bar as well.
    bar = found.wrench[:3] - found.tension[0] * along[0]
    assert bar == pytest.approx([0.0, 0.0, 0.5 * weight])
    assert found.wrench[3:] == pytest.approx(np.zeros(3), abs=1e-12)


def test_a_level_rope_takes_the_length_of_its_parabola():
    """Irvine: (w·l)²·l/(24·t²), of a chain of N + 1 links 1/(N + 1)² less."""
    taken = -after(rope(), scene(LEVEL), 0.1).length[0]
    parabola = (DENSITY * GRAVITY * LENGTH / 5.0) ** 2 * LENGTH / 24.0
    assert taken == pytest.approx(parabola * (1.0 - 1.0 / (LUMPS + 1) ** 2))
    assert after(rope(), scene(DOWN), 0.1).length[0] == 0.0


def test_a_plucked_rope_swings_as_a_string():
    """Half a wave between the ends: f = sqrt(t/ρ)/(2·l), of a chain a little less."""
    plucked = rope()
    plucked.advance(scene(LEVEL), MS)
    loose = scene(LEVEL, tension=4.0)
    pulls = [after(plucked, loose, MS).wrench[2] for _ in range(1500)]
    rising = np.flatnonzero(np.diff(np.sign(pulls - np.mean(pulls))) > 0) * MS
    chain = np.sin(0.5 * np.pi / (LUMPS + 1)) / (0.5 * np.pi / (LUMPS + 1))
    string = np.sqrt(4.0 / DENSITY) / (2.0 * LENGTH)
    assert 1.0 / np.mean(np.diff(rising[:4])) == pytest.approx(string * chain, rel=0.03)


def test_what_falls_freely_has_no_weight():
    falling = rope()
    for step in range(1, 4):
        speed = (0.0, 0.0, GRAVITY * MS * step)
        falling.advance(scene(DOWN, body=speed, frame=speed), MS)
    found = acted(falling, scene(DOWN))
    assert found.tension == pytest.approx([0.0], abs=1e-12)
    assert found.wrench == pytest.approx(np.zeros(6), abs=1e-12)


def test_slow_drag_on_a_string_meets_the_ends_motion_across_it_alone():
    string = rope(THREAD, 0.4, 0.0)
    found = after(string, scene(body=(0.3, 0.0, -0.5)), 2.0)
    assert found.wrench == pytest.approx([-0.4 * 0.3, 0.0, 0.0, 0.0, 0.0, 0.0], abs=1e-9)


def test_drag_on_a_string_has_the_moment_of_its_force():
    """A turning bar with the attachment off its origin, by vector products."""
    rate, origin = np.array([0.3, -0.2, 0.5]), np.array([0.2, -0.4, 1.9])
    now = scene(body=(0.1, 0.2, 0.3), rate=rate, origin=origin)
    wrench = after(rope(THREAD, 0.4, 0.0), now, 2.0).wrench
    arm = LENGTH * DOWN[0] - origin
    end = np.array([0.1, 0.2, 0.3]) + np.cross(rate, arm)
    force = -0.4 * np.array([end[0], end[1], 0.0])
    assert wrench[:3] == pytest.approx(force)
    assert wrench[3:] == pytest.approx(np.cross(arm, force))


def test_a_fast_motion_bends_a_string_that_drags_and_meets_less():
    string, rows = rope(THREAD, 0.4, 0.0), []
    for step in range(2000):
        speed = np.sin(2.0 * np.pi * 8.0 * step * MS)
        rows.append((speed, after(string, scene(body=(speed, 0.0, 0.0)), MS).wrench[0]))
    speeds, forces = np.array(rows[1000:]).T
    felt = -(speeds @ forces) / (speeds @ speeds)
    assert 0.3 * 0.4 < felt < 0.9 * 0.4


def test_ropes_without_mass_do_nothing():
    one = HeavyRope(np.array([0.0, DENSITY]), np.zeros(2), GRAVITY)
    found = after(one, scene(np.vstack([LEVEL, LEVEL])), 0.1)
    assert found.length[0] == 0.0 > found.length[1]
    assert found.wrench[2] == pytest.approx(0.5 * DENSITY * GRAVITY * LENGTH)


def test_a_frame_gives_way_to_what_has_changed_since_the_start():
    """Exits move towards the bar: the cable has so much more length."""
    frame = YieldingFrame(1e-3)
    assert after(frame, scene(tension=5.0), 1.0).length == pytest.approx([0.0])
    found = after(frame, scene(tension=7.0), 12.0)
    assert found.length == pytest.approx([1e-3 * 2.0], rel=1e-6)
    assert found.wrench == pytest.approx(np.zeros(6), abs=1e-12)


def test_cables_across_a_frames_shift_are_turned_by_it():
    """Two cables at right angles; exact lengths and directions from the shifted exit."""
    along = np.vstack([DOWN, LEVEL])
    frame = YieldingFrame(1e-3)
    frame.advance(scene(along, tension=0.0), MS)
    now = scene(along, tension=5.0)
    found = after(frame, now, 12.0)
    lines = LENGTH * along - 1e-3 * 5.0 * np.array([1.0, 0.0, 1.0])
    lengths = np.linalg.norm(lines, axis=1)
    assert found.length == pytest.approx(LENGTH - lengths, rel=1e-5)
    pulls = -5.0 * lines / lengths[:, None] + 5.0 * along
    assert found.wrench[:3] == pytest.approx(pulls.sum(axis=0), rel=1e-4)
    arms = LENGTH * (along - along[0])
    assert found.wrench[3:] == pytest.approx(np.cross(arms, pulls).sum(axis=0), rel=1e-4)


def test_a_frame_swings_by_its_modes():
    frame = YieldingFrame(1e-3)
    frame.advance(scene(tension=0.0), MS)
    lengths = [after(frame, scene(tension=5.0), MS).length[0] for _ in range(1000)]
    crossing = np.flatnonzero(np.diff(np.sign(np.array(lengths) - 5e-3)) > 0) * MS
    assert 1.0 / np.mean(np.diff(crossing[:4])) == pytest.approx(YIELDING_HZ[0, 0], rel=0.1)
    assert YIELDING_SHARES.sum() == pytest.approx(1.0)
    assert max(lengths) > 1.5 * 5e-3


def test_a_drive_is_late_by_its_lag_where_others_are_not():
    drive, lag = SlowDrive(np.array([0.004, 0.0])), 0.004
    times = np.arange(0.0, 0.5, MS)
    held = []
    for time in times:
        command = np.full(2, 3.0 * time)
        held.append(drive.deliver(command))
        drive.advance(command, MS)
    late, healthy = np.array(held)[-1]
    assert healthy == 3.0 * times[-1]
    # A command that is held for 1 ms is late by half of it in the mean.
    assert late == pytest.approx(3.0 * (times[-1] - lag - 0.5 * MS), rel=1e-3)


def test_a_drive_begins_with_what_was_commanded_first_and_follows_without_overshoot():
    drive = SlowDrive(np.array([0.003]))
    assert drive.deliver(np.array([2.0])) == 2.0
    drive.advance(np.array([2.0]), MS)
    torques = []
    for _ in range(40):
        torques.append(drive.deliver(np.array([5.0]))[0])
        drive.advance(np.array([5.0]), MS)
    assert torques[0] == 2.0
    assert (np.diff(torques) > 0.0).all()
    assert torques[-1] == pytest.approx(5.0, abs=1e-4)


def test_a_mode_keeps_its_energy_and_its_period_and_loses_what_it_is_to():
    """q̈ = −ω²·q has q̇² + ω²·q² for ever; with loss q̇ decays by exp(−loss·t/2)."""
    omega = 2.0 * np.pi
    place, speed = np.ones(1), np.zeros(1)
    for _ in range(1000):
        place, speed = swung(place, speed, omega**2, 0.0, np.zeros(1), MS)
    assert speed**2 + (omega * place) ** 2 == pytest.approx(omega**2)
    assert place == pytest.approx([1.0], abs=1e-4)
    for _ in range(1000):
        place, speed = swung(place, speed, omega**2, 0.8, np.zeros(1), MS)
    assert np.hypot(speed / omega, place) == pytest.approx([np.exp(-0.4)], rel=0.02)


def test_moments_are_those_of_vector_products():
    rng = np.random.default_rng(1)
    arms, forces, rate = rng.normal(size=(4, 3)), rng.normal(size=(4, 3)), rng.normal(size=3)
    assert moment(arms, forces) == pytest.approx(np.cross(arms, forces).sum(axis=0))
    assert turned(rate, arms) == pytest.approx(np.cross(rate, arms))


def test_limits_of_drives_and_clocks_are_no_less_than_what_healthy_ones_do(eight):
    """A period of the commands, and the 25 ppm of quartz, however noiseless readings are."""
    moving = [
        scene(LEVEL.repeat(8, axis=0), body=(900.0 * np.sin(9.0 * k), 0, 0))._replace(
            time=0.005 * k, torque=np.full(8, 50.0 * (-1.0) ** k)
        )
        for k in range(40)
    ]
    limits = detection_limits(moving, eight)
    assert limits["slow drive"] == pytest.approx([1e-3] * 8)
    assert limits["fast clock"] == pytest.approx([25e-6])
    assert limits["late tracker"] == pytest.approx([0.25e-3])
    slow = [each._replace(torque=np.full(8, 1e-4 * k)) for k, each in enumerate(moving)]
    rate, machine = 1e-4 / 0.005, eight.sensors["/winches/state"]
    noise = np.hypot(machine.noise[2], machine.resolution[2] / np.sqrt(12.0))
    assert detection_limits(slow, eight)["slow drive"] == pytest.approx([noise / rate] * 8)
    calm = [
        scene(LEVEL.repeat(8, axis=0), body=(0.05, 0, 0))._replace(time=0.005 * k) for k in range(4)
    ]
    position = eight.sensors["/bar/pose"].noise[0]
    assert position / 0.05 > 0.25e-3
    assert detection_limits(calm, eight)["late tracker"] == pytest.approx([position / 0.05])
