"""What the cases of benchmarks may change of a machine, and what their controllers know of it."""

from dataclasses import replace

import numpy as np
import pytest

from bench.results.result_robust_cases import changed
from bench.results.result_winch_cases import AHEAD, heavier_rotors, rubbing
from bench.results.tracking import Case
from cspm_sim.parameters import plant_parameters

pytestmark = pytest.mark.compiled
REST = Case("rest", ("duration=0.3", "sensors=ideal"))


def test_a_load_is_taken_up_and_set_down_in_mid_run():
    errors, tensions, *_ = REST.run()
    taken, heavier, *_ = replace(REST, loads=((0.1, 1.0),)).run()
    both, *_ = replace(REST, loads=((0.1, 1.0), (0.2, -1.0))).run()
    np.testing.assert_array_equal(errors[:101], taken[:101])
    # z points down: a bar that is lower than its reference has a negative error.
    assert taken[-1, 2] < errors[-1, 2] - 1e-4
    assert heavier[-1].sum() > tensions[-1].sum()
    np.testing.assert_array_equal(taken[:201], both[:201])
    assert both[-1, 2] > taken[-1, 2]


def test_controllers_may_be_given_another_friction_than_the_plant_has():
    plain = Case("worst_case", ("duration=0.3", AHEAD), rubbing(1.2))
    found = [
        replace(plain, reported=reported).run() for reported in (None, rubbing(1.2), rubbing(1.0))
    ]
    np.testing.assert_array_equal(found[0][1], found[1][1])
    assert np.abs(found[0][1] - found[2][1]).max() > 1e-3
    # The plant rubs alike in both.
    assert changed("worst_case")["friction −20 %"].effects == rubbing(0.8)
    assert changed("worst_case")["friction −20 %"].reported == rubbing(1.0)


def test_cables_are_scaled_in_the_file_that_controllers_read():
    case = Case("worst_case_past_thesis")
    plain, soft = (
        each.bundle().testbed.testbed.cables for each in (case, replace(case, cables=(0.25, 0.5)))
    )
    for stiff, softer in zip(plain, soft, strict=True):
        assert softer.stiffness.a == pytest.approx(0.25 * stiff.stiffness.a)
        rigidity = 0.25 * stiff.stiffness.axial_rigidity
        assert softer.stiffness.axial_rigidity == pytest.approx(rigidity)
        assert softer.damping.factor == pytest.approx(0.5 * stiff.damping.factor)
        assert softer.rotor_inertia == stiff.rotor_inertia


def test_rotors_are_heavier_by_a_share_of_themselves():
    machines = [
        replace(REST, effects=effects).bundle().testbed.testbed
        for effects in ((), heavier_rotors(0.2))
    ]
    rows = [plant_parameters(each).cables for each in machines]
    changed_columns = np.flatnonzero((rows[0] != rows[1]).any(axis=0))
    assert len(changed_columns) == 1
    np.testing.assert_allclose(rows[1][:, changed_columns], 1.2 * rows[0][:, changed_columns])
