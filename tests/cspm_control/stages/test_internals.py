"""What controllers record of themselves: that it adds up to what they command."""

import numpy as np
import pytest
from run_samples import THESIS_CABLES, bundle_of, recorded, run_to

import cspm
from cspm_ident.diagnosis.validation.controller_parity import controller_parity
from cspm_model.kernels.rotation import euler_from_quaternion
from cspm_msgs_py.dofs import DOFS
from cspm_msgs_py.errors import InputError
from cspm_msgs_py.recording import Recording
from cspm_msgs_py.schedule import (
    BAR_POSE,
    BAR_REFERENCE,
    DISTRIBUTION_INTERNALS,
    FORCE_INTERNALS,
    INTERNALS,
    MOTION_INTERNALS,
    TENSION,
    TENSION_COMMAND,
    TORQUE_COMMAND,
    WRENCH,
    schedule_of,
)
from cspm_run.recorded_run import run
from cspm_run.resim import resimulate

pytestmark = pytest.mark.compiled

ON = "control.record_internals=true"
# Every rate equal, so that rows of one instant belong together.
FAST = tuple(
    f"rates.{name}=1000" for name in ("motion_capture", "motion_controller", "tension_distribution")
)
STEPS = 400
THESIS = bundle_of("rest").testbed.testbed


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    place = tmp_path_factory.mktemp("internals") / "bag"
    run(bundle_of("worst_case", ON, *FAST), place, steps=STEPS)
    return place


@pytest.fixture(scope="module")
def rows(folder):
    return {name: found.rows for name, found in recorded(folder).items()}


@pytest.fixture(scope="module")
def motion(rows):
    """Error, proportional, integral and derivative terms, each (k, 6)."""
    return rows[MOTION_INTERNALS].reshape(-1, 4, 6).transpose(1, 0, 2)


def euler(pose_rows):
    return np.array([euler_from_quaternion(row[3:7]) for row in pose_rows])


def test_the_error_is_reference_less_pose(rows, motion):
    reference, pose = rows[BAR_REFERENCE], rows[BAR_POSE]
    np.testing.assert_allclose(motion[0, :, :3], reference[:, :3] - pose[:, :3], atol=1e-15)
    np.testing.assert_allclose(motion[0, :, 3:], euler(reference) - euler(pose), atol=1e-12)


def test_the_terms_and_the_weight_are_the_wanted_force(rows, motion):
    weight = np.zeros(6)
    weight[2] = -THESIS.bar.mass * THESIS.gravity
    np.testing.assert_allclose(motion[1:].sum(axis=0) + weight, rows[WRENCH], atol=1e-9)
    assert np.abs(motion[1:]).max(axis=(1, 2)).min() > 1e-3


def test_each_term_is_what_its_name_says(motion):
    gains = bundle_of("worst_case", ON, *FAST).scenario.control.motion.gains
    error, proportional, integral, derivative = motion
    for d, dof in enumerate(DOFS):
        if dof not in gains:
            assert not motion[1:, :, d].any()
            continue
        np.testing.assert_allclose(proportional[:, d], gains[dof].kp * error[:, d], rtol=1e-12)
        steps = gains[dof].ki * 1e-3 * error[1:, d]
        np.testing.assert_allclose(np.diff(integral[:, d]), steps, atol=1e-12)
        # A derivative that follows the error's change, with a pole at 200 rad/s.
        change = gains[dof].kd * 200.0 * np.diff(error[:, d])
        expected = (derivative[:-1, d] + change) / 1.2
        np.testing.assert_allclose(derivative[1:, d], expected, atol=1e-9)


def test_unlimited_tensions_and_the_limits_that_hold_them(rows):
    unlimited, active = np.split(rows[DISTRIBUTION_INTERNALS], 2, axis=1)
    limits = np.array([cable.tension_limits for cable in THESIS.cables])
    commands = rows[TENSION_COMMAND]
    np.testing.assert_array_equal(np.clip(unlimited, limits[:, 0], limits[:, 1]), commands)
    np.testing.assert_array_equal(active, 1.0 * (commands == limits[:, 1]) - (commands == 2.0))
    assert set(np.unique(active)) == {-1.0, 0.0}
    assert (unlimited[active < 0.0] <= 2.0).all()
    assert (unlimited < 1.9).any()


def test_an_upper_limit_counts_as_one(tmp_path):
    prescribed = "control.tension_distribution={method: prescribed, null_space: [90, 0, 0]}"
    _, found = run_to(tmp_path / "bag", "rest", ON, prescribed, steps=1)
    unlimited, active = np.split(found[DISTRIBUTION_INTERNALS].rows[0], 2)
    assert unlimited[0] > 60.0
    assert active[0] == 1.0
    assert active[4] == -1.0


def test_the_force_controllers_terms_are_their_torque_up_to_its_limit(rows):
    proportional, integral = np.split(rows[FORCE_INTERNALS], 2, axis=1)
    limits = np.array([cable.torque_limit for cable in THESIS.cables])
    torque = proportional + integral
    np.testing.assert_allclose(np.clip(torque, -limits, limits), rows[TORQUE_COMMAND], atol=1e-12)
    gains = bundle_of("worst_case", ON, *FAST).scenario.control.force.gains
    error = rows[TENSION_COMMAND] - rows[TENSION]
    kp = np.array([gains[name].kp for name in THESIS_CABLES])
    rate = np.array([gains[name].integral_frequency for name in THESIS_CABLES])
    np.testing.assert_allclose(proportional, kp * error, atol=1e-12)
    step, free = (kp * rate * error * 1e-3)[:-1], (np.abs(torque) < limits)[:-1]
    np.testing.assert_allclose(np.diff(integral, axis=0)[free], step[free], atol=1e-12)
    assert 0.5 < free.mean() < 1.0


def test_the_computed_wrench_records_what_it_observes(tmp_path):
    """At the start the error is that of the first pose, and nothing is known of its rate."""
    law = "control.motion={law: computed_wrench}"
    _, found = run_to(tmp_path / "bag", "rest", law, ON, *FAST, steps=300)
    terms = found[MOTION_INTERNALS].rows.reshape(-1, 4, 6)
    first = found[BAR_REFERENCE].rows[0, :3] - found[BAR_POSE].rows[0, :3]
    np.testing.assert_allclose(terms[0, 0, :3], first, atol=1e-15)
    np.testing.assert_allclose(terms[:, 1, :3], 400.0 * terms[:, 0, :3], rtol=1e-12)
    assert not terms[0, 2:].any()
    assert not terms[:, 1:, 3].any()
    assert np.abs(terms[-1, 2:, [0, 1, 2, 4, 5]]).min() > 0.0


def test_in_the_safe_state_the_terms_are_zero_and_never_missing(tmp_path):
    _, found = run_to(tmp_path / "bag", "worst_case", ON, "safety.tension_trip=8.2", steps=700)
    terms, torques = found[FORCE_INTERNALS], found[TORQUE_COMMAND]
    np.testing.assert_array_equal(terms.stamp_ns, torques.stamp_ns)
    safe = ~terms.rows.any(axis=1)
    assert 0.0 < safe.mean() < 1.0
    assert safe[np.flatnonzero(safe)[0] :].all()
    assert torques.rows[safe].any(axis=1).all()


def test_names_say_what_each_number_is(folder):
    with Recording(folder) as recording:
        topics = {name: recording.topic(name).joint_names for name in INTERNALS}
    assert topics[MOTION_INTERNALS][:7] == (*(f"error_{dof}" for dof in DOFS), "proportional_surge")
    assert topics[DISTRIBUTION_INTERNALS][0] == "unlimited_hoist_1"
    assert topics[DISTRIBUTION_INTERNALS][-1] == "limit_sway_4"
    assert topics[FORCE_INTERNALS][8] == "integral_hoist_1"


def test_commands_are_the_same_bit_for_bit_and_without_asking_nothing_is_recorded(folder, tmp_path):
    run(bundle_of("worst_case", *FAST), tmp_path / "bag", steps=STEPS)
    plain, more = recorded(tmp_path / "bag"), recorded(folder)
    assert set(more) - set(plain) == set(INTERNALS)
    for name, found in plain.items():
        assert found.rows.tobytes() == more[name].rows.tobytes(), name


def test_each_comes_at_its_controllers_rate():
    schedule = schedule_of(bundle_of("rest", ON).scenario, THESIS)
    pairs = zip(INTERNALS, (WRENCH, TENSION_COMMAND, TORQUE_COMMAND), strict=True)
    for internals, command in pairs:
        assert schedule.topics[internals] == schedule.topics[command]
    assert set(INTERNALS).isdisjoint(schedule_of(bundle_of("rest").scenario, THESIS).topics)


def test_it_is_resimulated_bit_for_bit_and_controllers_reproduce_it(folder):
    assert resimulate(folder, lambda now, total: None).difference is None
    parities = {each.topic: each for each in controller_parity(folder)}
    for name in INTERNALS:
        assert parities[name].compared == STEPS
        assert parities[name].different == 0


def test_a_controller_of_ones_own_has_no_internals(tmp_path):
    class Still:
        def step(self, time, inputs):
            return np.array([0.0, 0.0, -39.8286, 0.0, 0.0, 0.0])

    scenario = tmp_path / "recorded.yaml"
    scenario.write_text(
        f"name: recorded\ntestbed: {bundle_of('rest').testbed.source}\nduration: 0.05\n"
        "target: {mean_pose: [0.0, 0.0, 2.0, 0.0, 0.0, 0.0]}\n"
        "control: {mode: closed_loop, record_internals: true}\n"
    )
    found = cspm.simulate(scenario, controllers={"motion_controller": Still()})
    assert set(INTERNALS) - set(found.topics) == {MOTION_INTERNALS}


@pytest.mark.parametrize(
    ("override", "text"),
    [
        ("control.record_internals=often", "control.record_internals: 'often', allowed: true or"),
        ("control={mode: locked_winches, record_internals: true}", "control.record_internals: unk"),
    ],
)
def test_what_is_no_answer_is_refused_in_one_line(override, text):
    with pytest.raises(InputError) as caught:
        bundle_of("rest", override)
    assert text in str(caught.value)
    assert "\n" not in str(caught.value)
