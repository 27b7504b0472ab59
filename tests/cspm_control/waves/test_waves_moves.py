import numpy as np
import pytest

from cspm_control.waves.moves import move_knots
from cspm_model.motion import Motion
from cspm_msgs_py.errors import InputError
from cspm_msgs_py.motion_spec import Move

SURGE, TURN = (0.1, 0.0, 0.0, 0.0, 0.0, 0.0), (0.0, 0.0, -0.2, 0.0, 0.0, 0.3)


def motion_of(*moves):
    return Motion(*move_knots(moves))


def test_stands_moves_and_stands():
    motion = motion_of(Move(at=1.0, duration=2.0, by=SURGE), Move(at=4.5, duration=0.7, by=TURN))
    for time in (0.0, 0.999, 1.0):
        assert motion.at(time) == pytest.approx(np.zeros(18), abs=1e-8)
    for time in (3.0, 3.7, 4.5):
        assert motion.at(time) == pytest.approx([*SURGE, *[0.0] * 12], abs=1e-12)
    for time in (5.2, 99.0):
        assert motion.at(time) == pytest.approx(
            [0.1, 0.0, -0.2, 0.0, 0.0, 0.3, *[0.0] * 12], abs=1e-12
        )


@pytest.mark.parametrize("share", [0.1, 0.25, 0.5, 0.813, 0.97])
def test_follows_the_minimum_jerk_profile_exactly(share):
    motion = motion_of(Move(at=1.0, duration=2.0, by=SURGE), Move(at=4.501, duration=0.7, by=TURN))
    profile = 10 * share**3 - 15 * share**4 + 6 * share**5
    rate = 30 * share**2 * (1 - share) ** 2
    first, second = motion.at(1.0 + 2.0 * share), motion.at(4.501 + 0.7 * share)
    assert first[0] == pytest.approx(0.1 * profile, abs=1e-10)
    assert first[6] == pytest.approx(0.1 * rate / 2.0, abs=1e-9)
    assert second[[2, 5]] == pytest.approx([-0.2 * profile, 0.3 * profile], abs=1e-10)
    assert second[[8, 11]] == pytest.approx([-0.2 * rate / 0.7, 0.3 * rate / 0.7], abs=1e-8)


def test_there_and_back_returns_to_the_start():
    back = tuple(-value for value in SURGE)
    motion = motion_of(Move(at=0.0, duration=1.0, by=SURGE), Move(at=1.0, duration=1.0, by=back))
    assert motion.at(1.0)[0] == pytest.approx(0.1)
    assert motion.at(2.0) == pytest.approx(np.zeros(18), abs=1e-15)


def test_a_sequence_that_is_too_long_is_refused():
    with pytest.raises(InputError, match="2001002 knots, allowed: at most 2000000"):
        move_knots(
            (Move(at=0.0, duration=0.001, by=SURGE), Move(at=2000.0, duration=1.001, by=TURN))
        )
