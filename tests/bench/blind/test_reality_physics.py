"""Each piece of concealed physics against what defines it."""

from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("mujoco", minversion="4.0", reason="the MuJoCo plant needs MuJoCo 4")
from bench.blind.reality import air, alterations, faults, friction, payload, rope, shaft
from bench.blind.reality.detection_limit import likeness
from bench.blind.reality.late import Late, LateFault
from bench.blind.reality.phenomena import LOOSENING_ONSET, PHENOMENA
from bench.blind.scoring.operating_region import ACTS, LOOSENING, VIBRATION
from cspm_msgs_py.testbed import load_testbed
from cspm_sim.mujoco.influence import Acting, Scene

MS = 1e-3
TESTBEDS = Path(__file__).resolve().parents[3] / "scenarios/testbeds"
THESIS = TESTBEDS / "thesis.yaml"
EXIT, END = np.array([[0.0, 0.0, 0.0]]), np.array([[0.0, 0.0, 2.0]])


@pytest.fixture(scope="module")
def one_winch():
    return load_testbed(TESTBEDS / "one_winch.yaml").testbed


def scene(time=0.0, angle=0.0, speed=0.0, tension=5.0, length=2.0, body=None, torque=0.0):
    ends = np.vstack([EXIT, END * length / 2.0])
    return Scene(
        time,
        np.array([angle]),
        np.array([speed]),
        np.array([torque]),
        np.array([tension]),
        np.array([1.99]),
        ends,
        np.zeros(9),
        np.zeros(9) if body is None else np.array(body, dtype=float),
        np.eye(3),
    )


def acted(influence, now, radius=0.0):
    acting = Acting(1)
    acting.clear(np.array([radius]))
    influence.act(now, acting)
    return acting


def slide(influence, speed, seconds, **state):
    for _ in range(round(seconds / MS)):
        influence.advance(scene(speed=speed, **state), MS)
    return acted(influence, scene(speed=speed, **state)).torque[0]


@pytest.mark.parametrize("speed", [0.3, -0.3, 40.0])
def test_sliding_bristles_resist_at_their_level(speed):
    one = np.ones(1)
    assert slide(friction.coulomb(0.02 * one), speed, 0.5) == pytest.approx(-np.sign(speed) * 0.02)
    loaded = friction.load_dependent(0.1 * one, 0.025 * one)
    expected = -np.sign(speed) * 0.1 * 0.025 * 8.0
    assert slide(loaded, speed, 0.5, tension=8.0) == pytest.approx(expected)


def test_bristles_give_way_as_a_spring_before_they_slide():
    bristles = friction.coulomb(np.array([0.02]))
    bristles.advance(scene(speed=0.1), MS)
    bent = -0.02 * 0.1 * MS / friction.PRESLIDING
    assert acted(bristles, scene()).torque[0] == pytest.approx(bent, rel=0.02)


def test_breakaway_falls_with_speed():
    one = np.ones(1)
    slow, fast = (slide(friction.stribeck(0.8 * one, one, 1.5), v, 2.0) for v in (0.05, 15.0))
    assert slow == pytest.approx(-1.8, rel=1e-2)
    assert fast == pytest.approx(-1.0, rel=1e-2)


def test_a_pulley_makes_the_winch_carry_more_when_it_winds_in():
    def torque(speed):
        capstan = friction.CapstanFriction(np.array([0.1]), np.array([0.025]))
        return slide(capstan, speed, 0.5, tension=10.0)

    carried = 10.0 * np.exp(0.1 * np.pi / 2)
    assert torque(1.0) == pytest.approx(-0.025 * (carried - 10.0))
    assert torque(-1.0) == pytest.approx(0.025 * (10.0 - 100.0 / carried))


@pytest.mark.parametrize("drag", [shaft.GreaseDrag, shaft.EddyCurrentDrag])
def test_drags_on_a_shaft_take_energy(drag):
    for speed in (-30.0, -1.0, 0.5, 8.0):
        assert acted(drag(np.array([0.1])), scene(speed=speed)).torque[0] * speed < 0.0


def test_eddy_currents_brake_most_at_their_speed():
    torques = [acted(shaft.EddyCurrentDrag(np.ones(1), 2.0), scene(speed=v)).torque[0]
               for v in (1.0, 2.0, 4.0)]  # fmt: skip
    assert torques == pytest.approx([-0.8, -1.0, -0.8])


def test_a_runout_repeats_with_the_drum_and_not_with_the_motor():
    runout = shaft.DrumRunout(np.array([1e-3]), np.array([10.0]), 0.0)
    radii = [acted(runout, scene(angle=a), 2.5e-3).radius[0] for a in (0.0, 2 * np.pi, 20 * np.pi)]
    assert radii[0] == pytest.approx(2.5e-3 + 1.125e-4)
    assert radii[2] == pytest.approx(radii[0])
    assert radii[1] < 0.99 * radii[0]


def stretched(influence, elongation_path):
    for elongation in elongation_path:
        influence.advance(scene(length=1.99 + elongation), MS)
    return acted(influence, scene()).tension[0]


def test_internal_friction_saturates_and_loses_energy_in_a_cycle():
    up, down = np.linspace(0.0, 0.02, 200), np.linspace(0.02, 0.0, 200)
    slip = rope.MaxwellSlip(np.array([0.5]))
    assert stretched(slip, up) == pytest.approx(0.5)
    assert stretched(slip, down) == pytest.approx(-0.5)
    assert 0.0 < stretched(rope.MaxwellSlip(np.array([0.5])), np.linspace(0.0, 5e-4, 50)) < 0.5


def test_creep_ends_at_its_compliance_in_two_steps_of_time():
    creep = rope.Creep(np.array([1e-3]))
    creep.advance(scene(tension=5.0), MS)
    lengths = {}
    for step in range(1, 60_001):
        creep.advance(scene(tension=7.0), MS)
        if step in (1500, 60_000):
            lengths[step] = acted(creep, scene()).length[0]
    assert lengths[60_000] == pytest.approx(2e-3, rel=2e-3)
    share = 0.5 * (1 - np.exp(-1.0)) + 0.5 * (1 - np.exp(-1.5 / 9.0))
    assert lengths[1500] == pytest.approx(2e-3 * share, rel=1e-3)


def test_slip_lets_rope_out_whichever_way_the_drum_turns():
    for speed in (2.0, -2.0):
        slip = rope.DrumSlip(np.array([1e-2]), np.array([0.025]))
        slide(slip, speed, 1.0, tension=10.0)
        assert acted(slip, scene()).length[0] == pytest.approx(1e-2 * 0.025 * 2.0)


def test_an_anchor_holds_until_it_loosens():
    anchor = rope.LooseningAnchor(np.array([1e-3]), 12.0)
    found = [acted(anchor, scene(time=t)).length[0] for t in (0.0, 12.0, 100.0)]
    assert found == pytest.approx([0.0, 0.0, 1e-3])


def test_drag_on_a_rope_meets_the_ends_motion_across_it_alone():
    drag = rope.SegmentDrag(np.array([0.4]))
    moving = [0.0, 0.0, 2.0, 0.3, 0.0, -0.5, 0.0, 0.0, 0.0]
    wrench = acted(drag, scene(body=moving)).wrench
    assert wrench == pytest.approx([-0.4 * 0.3, 0.0, 0.0, 0.0, 0.0, 0.0])


def test_drag_on_strips_is_quadratic_and_resists_turning():
    drag = air.StripDrag(2.0, 1.0)
    slow, fast = (acted(drag, scene(body=[0, 0, 0, 0, v, 0, 0, 0, 0])).wrench for v in (0.1, 0.2))
    assert slow[1] == pytest.approx(-2.0 * 0.1**2)
    assert fast[1] == pytest.approx(4.0 * slow[1])
    turning = acted(drag, scene(body=[0, 0, 0, 0, 0, 0, 0, 0, 1.0])).wrench
    assert turning[5] < 0.0
    assert turning[:5] == pytest.approx(np.zeros(5), abs=1e-15)


def test_what_begins_late_does_nothing_before():
    late = Late(shaft.TorqueOffset(np.array([0.1])), 5.0)
    assert acted(late, scene(time=4.999)).torque[0] == 0.0
    assert acted(late, scene(time=5.0)).torque[0] == 0.1
    fault = LateFault(faults.CellOffset(np.array([0.3])), 5.0)
    assert [fault(np.ones(1), t)[0] for t in (4.9, 5.1)] == [1.0, 1.3]


@pytest.mark.parametrize("delay", [0.2 * MS, 0.6 * MS, 3.0 * MS, 0.02])
def test_a_filtered_tracker_is_late_by_its_delay_on_slow_motion(delay):
    """However short the delay is against the plant's step."""
    late = faults.FilteredDelay(delay)
    times = np.arange(0.0, 2.0, MS)
    seen = np.array([late(np.full(6, 3.0 * t), t)[0] for t in times])
    assert seen[-1] == pytest.approx(3.0 * (times[-1] - delay), abs=1e-9)


def test_shifted_markers_turn_with_the_bar():
    shift = faults.MarkerShift(0.01)
    assert shift(np.zeros(6), 0.0)[:3] == pytest.approx([0.0, 0.01, 0.0])
    yawed = shift(np.array([0, 0, 0, 0, 0, np.pi / 2]), 0.0)
    assert yawed[:3] == pytest.approx([-0.01, 0.0, 0.0])
    rolled = shift(np.array([0, 0, 0, np.pi / 2, 0, 0]), 0.0)
    assert rolled[:3] == pytest.approx([0.0, 0.0, 0.01])


def test_drag_on_a_rope_has_the_moment_of_its_force():
    """A turning bar with the attachment off its origin, by vector products."""
    drag = rope.SegmentDrag(np.array([0.4]))
    rate, origin = np.array([0.3, -0.2, 0.5]), np.array([0.2, -0.4, 1.9])
    wrench = acted(drag, scene(body=[*origin, 0.1, 0.2, 0.3, *rate])).wrench
    arm = END[0] - origin
    end = np.array([0.1, 0.2, 0.3]) + np.cross(rate, arm)
    force = -0.4 * np.array([end[0], end[1], 0.0])
    assert wrench[:3] == pytest.approx(force)
    assert wrench[3:] == pytest.approx(np.cross(arm, force))


def test_a_strapped_load_hangs_by_its_weight_and_swings_as_a_pendulum():
    load = payload.StrappedLoad(0.2, 9.81)
    still = scene(body=np.zeros(9))
    for _ in range(2000):
        load.advance(still, MS)
    weight = acted(load, still).wrench
    assert weight[:3] == pytest.approx([0.0, 0.0, 0.2 * 9.81], abs=1e-3)
    assert weight[3:] == pytest.approx(np.zeros(3))
    # The bar is put beside its load, which swings across from there on.
    beside = scene(body=[0.02, *np.zeros(8)])
    pulls = []
    for _ in range(6000):
        load.advance(beside, MS)
        pulls.append(acted(load, beside).wrench[0])
    crossings = np.flatnonzero(np.diff(np.sign(pulls)) > 0) * MS
    period = np.mean(np.diff(crossings))
    assert pulls[0] < 0.0
    assert period == pytest.approx(2.0 * np.pi * np.sqrt(payload.STRAP / 9.81), rel=0.02)


def test_a_strap_does_not_push():
    load = payload.StrappedLoad(0.2, 9.81)
    load.advance(scene(body=np.zeros(9)), MS)
    fallen = scene(body=[0.0, 0.0, 0.3, *np.zeros(6)])
    assert acted(load, fallen).wrench == pytest.approx(np.zeros(6))


def test_a_bar_is_changed_in_the_numbers_that_are_meant():
    machine = load_testbed(THESIS).testbed
    turned = alterations.harder_to_turn(machine, np.array([0.3])).bar
    assert turned.inertia.iyy - machine.bar.inertia.iyy == pytest.approx(0.3)
    assert turned.inertia.izz - machine.bar.inertia.izz == pytest.approx(0.3)
    assert turned.inertia.ixx == machine.bar.inertia.ixx
    moved = alterations.off_centre(machine, np.array([-0.01])).bar
    assert np.subtract(moved.com, machine.bar.com) == pytest.approx([-0.01, 0.0, 0.0])
    rig = load_testbed(THESIS.with_name("one_winch.yaml")).testbed
    assert alterations.harder_to_turn(rig, np.ones(1)) is rig
    assert alterations.off_centre(rig, np.ones(1)) is rig


@pytest.mark.parametrize(("speed", "share"), [(1e-3, 1.0), (20.0, 2.0**-0.1), (180.0, 0.1**0.1)])
def test_thinned_grease_is_less_of_a_straight_line_the_faster_it_is(one_winch, speed, share):
    there_and_back = [scene(speed=side * speed) for side in (1.0, -1.0, 1.0)]
    assert likeness("grease", there_and_back, one_winch) == pytest.approx([share], rel=1e-4)


def test_what_has_the_catalogues_form_is_its_parameter(one_winch):
    assert likeness("bristles", [scene(speed=3.0)] * 3, one_winch) == [1.0]


def test_a_straight_line_is_fitted_where_the_motion_is(one_winch):
    """By least squares: Σ thinned·q̇ over Σ q̇²."""
    speeds = np.array([1.0, -5.0, 30.0, 100.0])
    thinned = speeds / (1.0 + abs(speeds) / 20.0) ** 0.1
    found = likeness("grease", [scene(speed=speed) for speed in speeds], one_winch)
    assert found == pytest.approx([thinned @ speeds / (speeds @ speeds)])


def on_a_shaft(name, machine, **state):
    """What a phenomenon adds in the end to a winch's torque [N·m] at steady speed and tension."""
    now = scene(torque=0.025 * state["tension"], **state)
    influence = PHENOMENA[name].influence(np.array([0.01]), machine, np.random.default_rng(1))
    for _ in range(20_000):
        influence.advance(now, MS)
    acting = acted(influence, now)
    return float((acting.torque - acting.radius * state["tension"])[0])


@pytest.mark.parametrize(
    "name",
    [
        *("bristles", "breakaway", "loaded bristles", "grease", "cogging", "drive zero"),
        *("drive scale", "runout", "eddy currents", "capstan"),
    ],
)
def test_what_counts_as_its_operating_region_is_what_a_shaft_feels_it_by(name, one_winch):
    usual, others = (
        dict(angle=0.3, speed=1.0, tension=5.0),
        dict(angle=0.9, speed=-1.0, tension=8.0),
    )
    before = on_a_shaft(name, one_winch, **usual)
    after = {s: on_a_shaft(name, one_winch, **usual | {s: other}) for s, other in others.items()}
    changed = {s for s, torque in after.items() if torque != pytest.approx(before, rel=1e-6)}
    assert changed == {acts.signal for acts in ACTS[name]} & set(usual)
    # What goes by speed resists in both directions.
    assert (after["speed"] * before < 0.0) == ("speed" in changed)


def test_operating_regions_are_known_of_all():
    assert set(ACTS) == set(PHENOMENA)
    assert LOOSENING == LOOSENING_ONSET
    outside = {name: each.driver for name, each in PHENOMENA.items() if each.driver}
    assert {name: ACTS[name][0].signal for name in outside} == outside


def test_the_vibration_has_the_frequency_that_counts_as_right():
    vibration = air.OutsideVibration(1.0)
    forces = [acted(vibration, scene(time=t)).wrench[1] for t in np.arange(0.0, 30.0, 0.01)]
    strongest = np.argmax(np.abs(np.fft.rfft(forces)))
    assert np.fft.rfftfreq(len(forces), 0.01)[strongest] == pytest.approx(VIBRATION)
