"""The cable's tension law: the table against thesis (3-7) and (3-10) integrated on other roads."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from independent_plant import antiderivative, cap_point, slope
from independent_plant import elastic_tension as independent_tension
from machines import EXPONENTIAL, LINEAR, build, cable
from scipy.integrate import quad, solve_ivp

from cspm_model.equilibrium import unstretched_lengths
from cspm_model.kernels.cable import elastic_tension, law_scale
from cspm_model.stiffness import law_slope, law_table
from cspm_msgs_py.testbed import ExponentialStiffness
from cspm_sim.parameters import plant_parameters

KINDS = {"hoist": 0, "surge": 2, "sway": 4}
lengths = st.floats(0.05, 20.0)
kinds = st.sampled_from(list(KINDS))


@pytest.fixture(scope="module")
def parameters(thesis):
    return plant_parameters(thesis)


@pytest.fixture(scope="module")
def laws(thesis):
    return {kind: thesis.cables[i].stiffness for kind, i in KINDS.items()}


def law(parameters, kind, elongation, length):
    i = KINDS[kind]
    scale = law_scale(length, parameters.cables, i)
    return elastic_tension(elongation, length, scale, parameters.cables, parameters.tables, i)


def stiffness(law, tension, length):
    """(3-7) under the cap (3-10), with the floor below."""
    held = max(tension, law.floor_tension)
    return min(law.a / length**law.b * slope(law, held), law.axial_rigidity / length)


@pytest.mark.parametrize("kind", KINDS)
def test_the_closed_form_of_the_other_road_is_the_integral(laws, kind):
    law = laws[kind]
    for tension in (0.051, 0.1, 1.0, 5.0, 30.0, 200.0):
        args = (law.floor_tension, tension)
        expected = quad(lambda t: 1 / slope(law, t), *args, epsabs=1e-13, epsrel=1e-13, limit=400)
        found = antiderivative(law, tension) - antiderivative(law, law.floor_tension)
        assert found == pytest.approx(expected[0], abs=1e-12, rel=1e-12)


@settings(max_examples=300, deadline=None)
@given(kind=kinds, elongation=st.floats(1e-9, 0.05), length=lengths)
def test_tension_is_the_integral_of_the_published_stiffness(
    parameters, laws, kind, elongation, length
):
    expected = independent_tension(laws[kind], elongation, length)
    tension, tangent = law(parameters, kind, elongation, length)
    assert tension == pytest.approx(expected, rel=1e-8, abs=1e-12)
    assert tangent == pytest.approx(stiffness(laws[kind], expected, length), rel=1e-5)


@pytest.mark.parametrize("kind", KINDS)
def test_tension_agrees_with_the_rate_form_integrated_step_by_step(parameters, laws, kind):
    length, stretches = 2.53, np.linspace(1e-3, 0.02, 20)
    steps = solve_ivp(
        lambda _, t: [stiffness(laws[kind], t[0], length)],
        (0.0, stretches[-1]),
        [0.0],
        t_eval=stretches,
        max_step=2e-6,
        rtol=1e-10,
        atol=1e-12,
    ).y[0]
    found = [law(parameters, kind, stretch, length)[0] for stretch in stretches]
    assert steps[-1] > laws[kind].axial_rigidity / length * 5e-3
    assert found == pytest.approx(steps, rel=1e-6)


@settings(max_examples=200, deadline=None)
@given(kind=kinds, length=lengths, start=st.floats(-0.02, 0.05), step=st.floats(1e-7, 0.01))
def test_tension_increases_with_elongation_and_never_pushes(parameters, kind, length, start, step):
    low, tangent = law(parameters, kind, start, length)
    high, _ = law(parameters, kind, start + step, length)
    assert 0.0 <= low <= high
    assert tangent >= 0.0
    if start + step > 0.0:
        assert high > low
    if start <= 0.0:
        assert low == 0.0
        assert tangent == 0.0


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("length", [0.4, 2.53, 6.0])
def test_tension_and_its_slope_have_no_jump(parameters, laws, kind, length):
    """Across zero, the floor, the joints of the table and the cap: jumps shrink with the step."""
    found, (top, end) = laws[kind], cap_point(laws[kind], length)
    cap, tensions = found.axial_rigidity / length, np.linspace(0.05, top, 1000)
    growth = found.c * np.exp(found.c * tensions) - found.d * np.exp(found.d * tensions)
    bend = (found.a / length**found.b) ** 2 * np.max(growth * slope(found, tensions))
    grid = np.linspace(-0.1 * end, 2.0 * end, 8001)
    values = np.array([law(parameters, kind, e, length) for e in grid])
    step = grid[1] - grid[0]
    assert np.diff(values[:, 0]).max() <= 1.0001 * cap * step
    taut = values[grid > 0.0]
    assert np.abs(np.diff(taut[:, 1])).max() <= 1.001 * bend * step
    assert taut[-1, 1] == pytest.approx(cap, rel=1e-12)
    assert taut[0, 1] < 0.02 * cap


@settings(max_examples=200, deadline=None)
@given(kind=kinds, length=st.floats(0.3, 8.0), elongation=st.floats(1e-5, 0.03))
def test_the_tangent_is_the_slope(parameters, kind, length, elongation):
    step = 1e-8
    ends = [law(parameters, kind, elongation + s * step, length)[0] for s in (1, -1)]
    _, tangent = law(parameters, kind, elongation, length)
    assert tangent == pytest.approx((ends[0] - ends[1]) / (2 * step), rel=2e-4)


@pytest.mark.parametrize("kind", KINDS)
def test_stiffness_is_the_published_one_above_the_floor_and_the_materials_past_the_cap(
    parameters, laws, kind
):
    length, found = 2.53, laws[kind]
    below, above = 0, 0
    for elongation in np.linspace(3e-3, 0.045, 60):
        tension, tangent = law(parameters, kind, elongation, length)
        published = (
            found.a / length**found.b * (np.exp(found.c * tension) - np.exp(found.d * tension))
        )
        cap = found.axial_rigidity / length
        if published < cap:
            below += 1
            assert tangent == pytest.approx(published, rel=1e-7)
        else:
            above += 1
            assert tangent == pytest.approx(cap, rel=1e-14)
    assert below > 5
    assert above > 5


@pytest.mark.parametrize("kind", KINDS)
def test_below_the_floor_the_law_is_a_line_from_nothing(parameters, laws, kind):
    found, length = laws[kind], 2.53
    expected = found.a / length**found.b * (np.exp(found.c * 0.05) - np.exp(found.d * 0.05))
    corner = 0.05 / expected
    for share in (1e-6, 0.3, 0.999):
        tension, tangent = law(parameters, kind, share * corner, length)
        assert tension == pytest.approx(share * 0.05, rel=1e-12)
        assert tangent == pytest.approx(expected, rel=1e-12)


@settings(max_examples=100, deadline=None)
@given(length=lengths, elongation=st.floats(-0.05, 0.05))
def test_the_linear_law(length, elongation):
    testbed = build({"name": "line", "cables": [cable("c", (0, 0, 0), (0, 0, 2), LINEAR)]})
    p = plant_parameters(testbed)
    rigidity = 2.0e9 * np.pi / 4.0 * 1.0e-6
    scale = law_scale(length, p.cables, 0)
    tension, tangent = elastic_tension(elongation, length, scale, p.cables, p.tables, 0)
    assert tension == pytest.approx(max(0.0, rigidity * elongation / length), rel=1e-12)
    assert tangent == (pytest.approx(rigidity / length, rel=1e-12) if elongation > 0 else 0.0)


@settings(max_examples=25, deadline=None)
@given(
    a=st.floats(200.0, 1e5),
    b=st.floats(0.0, 2.0),
    c=st.floats(0.0, 0.05),
    d=st.floats(-0.5, -0.001),
    diameter=st.floats(2e-4, 5e-3),
    floor=st.floats(1e-3, 0.5),
    limit=st.floats(2.0, 200.0),
    length=st.floats(0.1, 10.0),
)
def test_any_plausible_law_follows_its_differential_equation(
    a, b, c, d, diameter, floor, limit, length
):
    content = {**EXPONENTIAL, "a": a, "b": b, "c": c, "d": d, "diameter": diameter}
    content["floor_tension"] = floor
    machine = build(
        {
            "name": "any",
            "cables": [cable("c", (0, 0, 0), (0, 0, 2), content, tension_limits=[0.0, limit])],
        }
    )
    p, found = plant_parameters(machine), machine.cables[0].stiffness
    scale = law_scale(length, p.cables, 0)
    stretch = 2.0 * limit * length**b / (a * max(float(law_slope(found, limit)), 1e-3))
    grid = np.linspace(1e-3 * stretch, stretch, 40)
    values = [elastic_tension(e, length, scale, p.cables, p.tables, 0) for e in grid]
    for tension, tangent in values:
        assert tangent == pytest.approx(stiffness(found, tension, length), rel=1e-4)
    rise = np.diff([tension for tension, _ in values])
    assert (rise > 0).all()


def test_the_table_starts_at_the_floor_and_reaches_past_the_cap(laws):
    for kind, limit in (("hoist", 60.0), ("surge", 35.0), ("sway", 15.0)):
        table, step = law_table(laws[kind], limit)
        assert table[0, 0] == laws[kind].floor_tension
        assert (np.diff(table, axis=0) > 0).all()
        assert step > 0
        stiffest = laws[kind].axial_rigidity / (laws[kind].a * 100.0 ** (1.0 - laws[kind].b))
        assert table[-1, 1] == pytest.approx(1.05 * stiffest, rel=0.01)
        assert table[:, 1] == pytest.approx(law_slope(laws[kind], table[:, 0]), rel=1e-14)


def secant_elongation(law, tension, length):
    """Elongation if (3-7) were read as a secant, t = k(t)·ε."""
    return tension / (law.a / length**law.b * slope(law, tension))


@pytest.mark.parametrize(
    ("kind", "length", "dead", "incremental", "cap"),
    [
        ("hoist", 2.531, 1.78e-3, 8486.0, 6090.0),
        ("surge", 2.549, 2.63e-3, 4708.0, 2688.0),
        ("sway", 2.561, 2.72e-3, 3109.0, 1712.0),
    ],
)
def test_read_as_a_secant_the_law_would_contradict_itself(
    laws, kind, length, dead, incremental, cap
):
    """Why (3-7) is read as a tangent: a dead stretch without tension, and a slope past the cap."""
    found = laws[kind]
    assert secant_elongation(found, 1e-6, length) == pytest.approx(dead, rel=3e-3)
    rise = secant_elongation(found, 5.001, length) - secant_elongation(found, 4.999, length)
    assert 0.002 / rise == pytest.approx(incremental, rel=5e-3)
    assert found.axial_rigidity / length == pytest.approx(cap, rel=2e-3)
    assert 0.002 / rise > found.axial_rigidity / length


@pytest.mark.parametrize("kind", KINDS)
def test_read_as_a_tangent_without_floor_a_slack_cable_would_never_tighten(laws, kind):
    """∫ dε = ∫ dt/k from zero tension diverges like a logarithm: decades add up."""
    law = laws[kind]
    tenths = [antiderivative(law, 10.0**-n) for n in (3, 4, 5)]
    decades = -np.diff(tenths)
    assert decades[0] == pytest.approx(decades[1], rel=1e-3)
    assert decades[1] == pytest.approx(np.log(10.0) / (law.c - law.d), rel=1e-3)


@settings(max_examples=50, deadline=None)
@given(tension=st.just(0.0) | st.floats(1e-6, 60.0), length=st.floats(0.5, 5.0))
def test_unstretched_lengths_give_the_wanted_tensions(parameters, laws, tension, length):
    found = unstretched_lengths(parameters, np.full(8, length), np.full(8, tension))
    for kind, i in KINDS.items():
        reached = independent_tension(laws[kind], length - found[i], found[i] + 0.3)
        assert reached == pytest.approx(tension, rel=1e-8, abs=1e-11)
        assert (found[i] < length) == (tension > 0.0)


def test_a_law_without_growth_is_still_a_law():
    flat = ExponentialStiffness(**{**EXPONENTIAL, "c": 0.0})
    table, step = law_table(flat, 35.0)
    assert (np.diff(table[:, 0]) > 0).all()
    assert step > 0


def test_past_the_end_of_its_table_the_law_goes_on_as_a_line():
    """A law that levels off far below the material's cap: its slope there is a/l^b."""
    flat = {**EXPONENTIAL, "c": 0.0, "diameter": 5e-3}
    line = cable("c", (0, 0, 0), (0, 0, 2), flat, tension_limits=[0.0, 20.0])
    p, length = plant_parameters(build({"name": "flat", "cables": [line]})), 2.3
    scale = law_scale(length, p.cables, 0)
    stretches = np.linspace(0.04, 0.4, 50)
    law = [elastic_tension(e, length, scale, p.cables, p.tables, 0) for e in stretches]
    tensions, tangents = np.array(law).T
    assert 0.8 * tensions[0] < p.tables[0, -1, 0] < tensions[-1] / 3.0
    assert tangents == pytest.approx(7000.0 / length**1.05, rel=3e-4)
    assert np.diff(tensions) == pytest.approx(7000.0 / length**1.05 * np.diff(stretches), rel=3e-4)
