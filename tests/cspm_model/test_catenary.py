"""The elastic catenary against a published cable, and against forces and shapes found otherwise."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import root

from cspm_model.catenary import catenary_end, ernst_share, hang
from cspm_msgs_py.errors import ConvergenceError

# A cable of 1000 ft under its own weight and 8 kip at 400 ft (Jayaraman and Knudson, A curved
# element for the analysis of cable structures, Computers & Structures 14, 1981): in ft and lb.
WEIGHT = 3.16
RIGIDITY = 0.85 * 19e6
PIECES = ((400.0, 412.8837), (600.0, 613.0422))
LOAD = 8000.0


def forces(across, down, length):
    """Forces of a piece of known length between two points: horizontal, and up at its far end."""

    def missed(unknown):
        end = catenary_end(np.exp(unknown[0]), unknown[1] * 1e3, length, WEIGHT, RIGIDITY)
        return np.subtract(end, (across, down)) / length

    found = root(missed, [np.log(1e4), 1.0], tol=1e-13)
    assert np.abs(found.fun).max() < 1e-9
    return np.exp(found.x[0]), 1e3 * found.x[1] - WEIGHT * length


def place_of_load(load):
    """Where the point with the load comes to rest, from the left support."""

    def unbalanced(point):
        left = forces(point[0], point[1], PIECES[0][1])
        right = forces(1000.0 - point[0], point[1], PIECES[1][1])
        return [(right[0] - left[0]) / 1e4, (load - left[1] - right[1]) / 1e4]

    return root(unbalanced, [400.0, 100.0], tol=1e-13).x


def test_a_published_cable_hangs_and_moves_as_published():
    still, loaded = place_of_load(0.0), place_of_load(LOAD)
    assert still == pytest.approx([400.0, 96.05], abs=0.005)
    assert loaded - still == pytest.approx([-2.819, 18.458], rel=2e-4)


@pytest.mark.parametrize(
    ("across", "down", "tension"),
    [(2.0, 1.5, 8.0), (1.0, -3.0, 20.0), (4.0, 0.0, 3.0), (0.02, 2.0, 5.0)],
)
def test_a_cable_with_a_tension_is_the_solution_of_its_differential_equation(across, down, tension):
    weight, rigidity = 0.6, 500.0
    found = hang(across, down, tension, weight, rigidity)
    assert np.hypot(found.horizontal, found.exit_pull) == pytest.approx(tension, rel=1e-12)

    def slope(s, _):
        force = np.array([found.horizontal, found.exit_pull - weight * s])
        size = np.linalg.norm(force)
        return force / size * (1.0 + size / rigidity)

    s = np.linspace(0.0, found.unstretched, 4001)
    curve = solve_ivp(slope, (0.0, s[-1]), [0.0, 0.0], t_eval=s, rtol=1e-11, atol=1e-12).y
    assert curve[:, -1] == pytest.approx([across, down], abs=1e-7)
    off = np.abs(curve[1] * across - curve[0] * down) / np.hypot(across, down)
    assert found.sag == pytest.approx(off.max(), rel=1e-5)
    assert found.end_pull == pytest.approx(found.exit_pull - weight * found.unstretched)


def test_a_vertical_cable_carries_its_own_weight_and_has_no_sag():
    found = hang(0.0, 3.0, 10.0, 0.5, 1e4)
    assert found.sag == 0.0
    assert found.horizontal < 1e-10
    assert found.end_pull == pytest.approx(10.0 - 0.5 * found.unstretched, rel=1e-12)
    # By hand: stretched by the mean tension.
    stretched = found.unstretched * (1.0 + (10.0 - 0.25 * found.unstretched) / 1e4)
    assert stretched == pytest.approx(3.0, rel=1e-12)


def test_a_tight_cable_sags_as_a_parabola():
    found = hang(5.0, 0.0, 200.0, 0.5, 1e12)
    assert found.sag == pytest.approx(0.5 * 5.0**2 / (8.0 * 200.0), rel=1e-4)
    assert found.unstretched - 5.0 == pytest.approx(0.5**2 * 5.0**3 / (24.0 * 200.0**2), rel=2e-2)


def test_a_tension_that_does_not_hold_the_cable_is_refused():
    with pytest.raises(ConvergenceError) as caught:
        hang(10.0, 0.0, 1.0, 0.5, 1e4)
    assert str(caught.value) == (
        "1 N do not hold a cable of 5 N over 10 m, allowed: a higher tension or a lighter cable"
    )


def test_ernsts_share_is_the_slope_of_tension_over_the_distance_of_the_ends():
    weight, rigidity, across, step = 2.0, 5e5, 20.0, 1e-4
    tight = hang(across, 0.0, 300.0, weight, rigidity)

    def tension_at(distance):
        def missed(unknown):
            end = catenary_end(*unknown, tight.unstretched, weight, rigidity)
            return np.subtract(end, (distance, 0.0))

        found = root(missed, [tight.horizontal, tight.exit_pull], tol=1e-13).x
        return float(np.hypot(*found))

    slope = (tension_at(across + step) - tension_at(across - step)) / (2.0 * step)
    share = ernst_share(across, 300.0, weight, rigidity)
    assert share < 0.9
    assert slope / (rigidity / across) == pytest.approx(share, rel=0.01)
