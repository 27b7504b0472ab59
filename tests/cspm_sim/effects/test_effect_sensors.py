"""Effects on sensors: what is measured changes, what is true does not."""

import numpy as np
import pytest
from machines import build, entry, general_content, rig_content

from cspm_model.kinematics import euler_rate_map, rotation
from cspm_msgs_py.errors import InputError
from cspm_msgs_py.sensor_spec import Sensor
from cspm_sim.effects import Channel, catalogue
from cspm_sim.effects.signals import PoseSignal
from cspm_sim.sensor_fault import Past, sensor_faults
from cspm_sim.sensors import SensorModel

DOFS = ("surge", "sway", "heave", "roll", "pitch", "yaw")
OFFSET = dict(zip(DOFS, (0.02, -0.03, 0.05, 0.1, -0.2, 0.3), strict=True))
NOISES = {"/winches/state": 3, "/cables/tension": 1}
READINGS = [e for e in catalogue().values() if e.signature.regression.channel is Channel.READING]


def machine(*effects):
    return build({**general_content(), "effects": list(effects)})


def sensor(testbed, topic, **spec):
    count = NOISES.get(topic, 2)
    zeros = (0.0,) * count
    found = Sensor(**{"noise": zeros, "resolution": zeros, "rate": 1000, **spec})
    return SensorModel(
        testbed.topics[topic],
        found,
        rate=1000,
        period_ns=1_000_000,
        seed=1,
        ideal=False,
        faults=sensor_faults(testbed, topic),
    )


def readings(model, values):
    """Rows that arrive when the quantities follow `values`, (steps, width), by stamp [ns]."""
    rows = {}
    for step, row in enumerate(values):
        arrival = model.observe(step, step * 1_000_000, row)
        if arrival:
            rows[arrival[0]] = arrival[1]
    return rows


def angles_of(quaternion):
    x, y, z, w = quaternion
    return np.array(
        [
            np.arctan2(2 * (w * x + y * z), 1 - 2 * (x * x + y * y)),
            np.arcsin(2 * (w * y - z * x)),
            np.arctan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z)),
        ]
    )


def test_bias_and_gain_change_one_cable_s_reading():
    testbed = machine(
        entry("tension_bias", ["c2"], bias=1.5), entry("tension_gain", ["c4"], gain=1.1)
    )
    values = np.arange(10.0, 18.0)
    kept = values.copy()
    row = readings(sensor(testbed, "/cables/tension"), [values])[0]
    expected = values.copy()
    expected[2] += 1.5
    expected[4] *= 1.1
    assert row == pytest.approx(expected, rel=1e-15)
    assert (values == kept).all()
    assert sensor_faults(testbed, "/winches/state") == []


def test_a_drift_grows_from_the_run_s_start_in_one_cell():
    testbed = machine(entry("tension_drift", ["c2"], rate=0.5), entry("tension_bias", bias=1.0))
    rows = readings(sensor(testbed, "/cables/tension"), np.full((2001, 8), 10.0))
    for stamp in (0, 400_000_000, 2_000_000_000):
        expected = [11.0 + 0.5e-9 * stamp * (i == 2) for i in range(8)]
        assert rows[stamp] == pytest.approx(expected, rel=1e-14)


def test_crosstalk_is_a_share_of_the_mean_of_all_others_whatever_their_own_crosstalk():
    testbed = machine(entry("tension_crosstalk", share=0.07))
    values = np.arange(8.0) ** 2
    row = readings(sensor(testbed, "/cables/tension"), [values])[0]
    assert row == pytest.approx(values + 0.01 * (values.sum() - values), rel=1e-14)


def test_a_single_load_cell_has_no_neighbours():
    rig = build({**rig_content(), "effects": [entry("tension_crosstalk", share=0.07)]})
    (row,) = readings(sensor(rig, "/cables/tension"), [np.array([12.0])]).values()
    assert row == pytest.approx([12.0])


def test_an_encoder_s_scale_is_in_angle_and_speed_not_in_torque():
    testbed = machine(entry("encoder_scale", ["c1"], scale=1.02))
    values = np.arange(1.0, 25.0)
    row = readings(sensor(testbed, "/winches/state"), [values])[0]
    expected = values.copy()
    expected[[1, 9]] *= 1.02
    assert row == pytest.approx(expected, rel=1e-15)


def test_faults_act_before_noise_and_resolution():
    testbed = machine(entry("tension_bias", bias=0.3))
    model = sensor(testbed, "/cables/tension", resolution=(1.0,))
    assert readings(model, [np.full(8, 10.3)])[0] == pytest.approx(11.0)


def test_faults_remain_in_ideal_sensors():
    """Ideal leaves out noise, resolution and delay; an effect was asked for by name."""
    testbed = machine(entry("tension_bias", bias=0.3))
    spec = Sensor(noise=(1.0,), resolution=(1.0,), rate=1000)
    model = SensorModel(
        testbed.topics["/cables/tension"],
        spec,
        rate=1000,
        period_ns=1_000_000,
        seed=1,
        ideal=True,
        faults=sensor_faults(testbed, "/cables/tension"),
    )
    assert readings(model, [np.full(8, 10.0)])[0] == pytest.approx(10.3)


@pytest.mark.parametrize("delay", [0.005, 0.0125])
def test_a_late_pose_is_that_of_the_delay_before(delay):
    testbed = machine(entry("pose_delay", ["bar"], delay=delay))
    times = 1e-3 * np.arange(60)
    values = np.outer(times, [1.0, -2.0, 3.0, 0.1, -0.2, 0.3])
    rows = readings(sensor(testbed, "/bar/pose"), values)
    # A straight line: no error between instants. Before the first it stands still.
    for stamp, row in rows.items():
        then = max(0.0, stamp * 1e-9 - delay)
        assert row[:3] == pytest.approx(then * np.array([1.0, -2.0, 3.0]), abs=1e-12)
        assert angles_of(row[3:]) == pytest.approx(then * np.array([0.1, -0.2, 0.3]), abs=1e-12)
    assert sorted(rows) == [k * 1_000_000 for k in range(60)]
    assert sensor_faults(testbed, "/winch_frame/pose") == []


def test_late_load_cells_read_what_all_tensions_were():
    testbed = machine(entry("tension_delay", ["load_cells"], delay=0.0035))
    times = 1e-3 * np.arange(40)
    values = np.outer(times, np.arange(1.0, 9.0))
    rows = readings(sensor(testbed, "/cables/tension"), values)
    assert rows[30_000_000] == pytest.approx(0.0265 * np.arange(1.0, 9.0), abs=1e-12)
    assert sensor_faults(testbed, "/winches/state") == []
    with pytest.raises(InputError, match="tension_delay: no element 'bar', allowed: c0"):
        sensor_faults(machine(entry("tension_delay", ["bar"], delay=0.1)), "/cables/tension")


def test_one_late_load_cell_leaves_the_others_in_time():
    effects = entry("tension_delay", ["c1"], delay=0.0035), entry("tension_delay", delay=0.002)
    values = np.outer(1e-3 * np.arange(40), np.ones(8))
    rows = readings(sensor(machine(*effects), "/cables/tension"), values)
    expected = [0.0245 if i == 1 else 0.028 for i in range(8)]
    assert rows[30_000_000] == pytest.approx(expected, abs=1e-12)


def test_a_late_torque_leaves_angle_and_speed_of_its_winch_in_time():
    testbed = machine(entry("torque_delay", ["c1"], delay=0.0035))
    values = np.outer(1e-3 * np.arange(40), np.ones(24))
    rows = readings(sensor(testbed, "/winches/state"), values)
    expected = [0.0265 if i == 17 else 0.03 for i in range(24)]
    assert rows[30_000_000] == pytest.approx(expected, abs=1e-12)
    with pytest.raises(InputError, match="newer than their stamps cannot be simulated"):
        sensor_faults(machine(entry("torque_delay", ["c1"], delay=-0.002)), "/winches/state")


@pytest.mark.parametrize(("elements", "slow"), [(["load_cells"], range(8)), (["c1"], [1])])
def test_a_low_pass_follows_a_ramp_late_and_a_sine_smaller(elements, slow):
    constant, times = 0.01, 1e-3 * np.arange(1001)
    fast = 2 * np.pi * 20.0
    values = np.outer(np.where(times < 0.5, times, 0.5), np.ones(8))
    values[:, 7] = 1.0 - np.cos(fast * times)
    testbed = machine(entry("tension_lag", elements, time_constant=constant))
    rows = readings(sensor(testbed, "/cables/tension"), values)
    read = np.array([rows[k * 1_000_000] for k in range(1001)])
    ramp = 0.3 - constant * (1.0 - np.exp(-0.3 / constant))
    assert read[300, 1] == pytest.approx(ramp, abs=1e-12)
    assert read[1000, 1] == pytest.approx(0.5, abs=1e-12)
    others = [i for i in range(8) if i not in slow]
    assert (read[:, others] == values[:, others]).all()
    if 7 in slow:
        swing = np.ptp(read[800:, 7]) / 2
        assert swing == pytest.approx(1.0 / np.hypot(1.0, fast * constant), rel=2e-3)


def test_a_late_pose_and_a_delayed_message_add_up():
    """The message's own delay moves its arrival; the effect its content."""
    testbed = machine(entry("pose_delay", ["bar"], delay=0.004))
    values = np.outer(np.arange(20.0), np.ones(6)) * 1e-3
    rows = readings(sensor(testbed, "/bar/pose", delay=0.003), values)
    assert sorted(rows) == [k * 1_000_000 for k in range(17)]
    assert rows[10_000_000][0] == pytest.approx(6e-3, abs=1e-12)


@pytest.mark.parametrize("topic", ["/bar/pose", "/bar/twist", "/winch_frame/pose"])
def test_a_skewed_clock_grows_older(topic):
    testbed = machine(entry("clock_skew", skew=0.01))
    times = 1e-3 * np.arange(3000)
    values = np.outer(times, np.ones(6)) * 0.1
    rows = readings(sensor(testbed, topic), values)
    for stamp in (0, 500_000_000, 2_999_000_000):
        assert rows[stamp][0] == pytest.approx(0.1 * stamp * 1e-9 / 1.01, abs=1e-9)


def test_an_offset_pose_is_the_pose_followed_by_the_offset():
    testbed = machine(entry("pose_offset", ["bar"], **OFFSET))
    pose = np.array([0.3, -0.2, 2.0, 0.2, -0.1, 0.7])
    row = readings(sensor(testbed, "/bar/pose"), [pose])[0]
    offset = np.array(list(OFFSET.values()))
    assert row[:3] == pytest.approx(pose[:3] + rotation(pose) @ offset[:3], rel=1e-12)
    x, y, z, w = row[3:]
    turned = np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
            [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
            [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
        ]
    )
    assert turned == pytest.approx(rotation(pose) @ rotation(offset), abs=1e-12)


def test_without_faults_a_sensor_keeps_no_past():
    model = sensor(machine(), "/bar/pose")
    assert model._past is None
    assert sensor(machine(entry("pose_delay", delay=0.01)), "/bar/pose")._past is not None


def test_the_past_forgets_what_is_asked_for_no_more():
    past = Past()
    for k in range(1000):
        past.note(1e-3 * k, np.array([float(k)]))
        assert past.at(np.array([1e-3 * k - 0.0105])) == pytest.approx(max(0.0, k - 10.5), abs=1e-9)
    assert len(past._rows) <= 13


@pytest.mark.parametrize(
    ("effects", "text"),
    [
        (
            [entry("pose_delay", ["c1"], delay=0.1)],
            "effects: pose_delay: elements ['c1'], allowed: [winch_frame, bar] or none",
        ),
        (
            [entry("tension_bias", ["bar"], bias=0.1)],
            "effects: tension_bias: no element 'bar', allowed: c0, c1, c2, c3, c4, c5, c6, c7",
        ),
        (
            [entry("clock_skew", skew=-0.02)],
            "effects: clock_skew: skew = -0.02 1, allowed: -0.01 to 0.01",
        ),
        (
            [entry("pose_delay", ["bar"], delay=-0.0002)],
            "effects: pose_delay: readings newer than their stamps cannot be simulated, allowed in"
            " a simulation: no number below 0",
        ),
        (
            [entry("clock_skew", ["bar"], skew=-1e-5)],
            "effects: clock_skew: readings newer than their stamps cannot be simulated, allowed in"
            " a simulation: no number below 0",
        ),
    ],
)
def test_faulty_entries_are_refused_in_one_line(effects, text):
    with pytest.raises(InputError) as caught:
        sensor_faults(machine(*effects), "/bar/pose")
    assert str(caught.value) == text


def test_without_bodies_no_pose_is_late():
    rig = build({**rig_content(), "effects": [entry("pose_delay", delay=0.1)]})
    with pytest.raises(InputError, match="nothing moves here, allowed: a test-bed with bar or fra"):
        sensor_faults(rig, "/cables/tension")


def small(effect):
    """A small effect."""
    return {
        p.name: (p.absent or 0.0) + 1e-4 * (k + 1) * min(1.0, p.maximum)
        for k, p in enumerate(effect.parameters)
    }


@pytest.mark.parametrize("effect", READINGS, ids=lambda e: e.id)
def test_columns_are_what_the_reading_has_too_much(effect):
    """A body or winch on a smooth path, read by a faulty sensor: the reading less the truth."""
    values, sense = small(effect), effect.physics.sense
    parameters = np.array(list(values.values()))
    times = np.linspace(0.2, 2.0, 50)

    def truth(t):
        return 0.3 * np.sin(np.outer(np.atleast_1d(t), [1.0, 1.3, 0.7, 1.1, 0.9, 1.6]) + 0.4)

    step = 1e-5
    rates = (truth(times + step) - truth(times - step)) / (2 * step)
    late = [sense.lateness(t, parameters) if sense.lateness else 0.0 for t in times]
    read = np.vstack([truth(t - old) for t, old in zip(times, late, strict=True)])
    if sense.reading:
        read = np.array([sense.reading(row, 0, parameters) for row in read])
    if sense.time_constant:
        read = read - sense.time_constant(parameters) * rates
    if sense.added:
        read[:, 0] += [sense.added(t, truth(t)[0], 0, parameters) for t in times]
    left = read - truth(times)
    if len(effect.regressors(np.zeros((1, 13)))[0]) == 6:
        signals = np.zeros((50, 13))
        signals[:, PoseSignal.TIME] = times
        signals[:, PoseSignal.POSE : PoseSignal.POSE + 6] = truth(times)
        signals[:, PoseSignal.RATE : PoseSignal.RATE + 6] = rates
    else:
        own, *others = truth(times).T
        signals = np.column_stack([times, own, rates[:, 0], np.mean(others, axis=0)])
        left = left[:, :1]
    model = effect.regressors(signals) @ effect.weights(values)
    assert np.abs(left).max() > 1e-7
    # The second order is a share of about 1e-3 of the first.
    assert model == pytest.approx(left, abs=5e-3 * np.abs(left).max())


def test_the_offset_s_columns_turn_small_rotations_into_euler_angles():
    pose = np.array([0.0, 0.0, 0.0, 0.3, -0.4, 0.9])
    signals = np.zeros((1, 13))
    signals[0, PoseSignal.POSE : PoseSignal.POSE + 6] = pose
    columns = catalogue()["pose_offset"].regressors(signals)[0]
    assert euler_rate_map(pose) @ columns[3:, 3:] == pytest.approx(rotation(pose), abs=1e-12)
