"""What counts as explaining the same: other elements, other effects, and what does not."""

import numpy as np
import pytest

from cspm_ident.diagnosis.regression.block_gram import gather
from cspm_ident.diagnosis.regression.block_regression import BlockRegression
from cspm_ident.diagnosis.regression.collinearity import chance, distance
from cspm_ident.diagnosis.regression.hypothesis import Hypothesis, bounded, is_allowed
from cspm_ident.diagnosis.residuals.free_shapes import Knots
from cspm_ident.diagnosis.residuals.regressors import Candidate, Place
from cspm_ident.diagnosis.residuals.residual_equation import Equation
from cspm_ident.diagnosis.selection.alternatives import alternatives_of
from cspm_ident.diagnosis.selection.rivals import rivals_of
from cspm_ident.diagnosis.selection.search import Search
from cspm_ident.diagnosis.thresholds import DEFAULT_THRESHOLDS
from cspm_ident.diagnosis.validation.acceptance import unexplained_beside
from cspm_sim.effects import Channel, catalogue

ROWS, STEP, BLOCK_S = 4800, 0.01, 1.0
TIMES = STEP * np.arange(ROWS)
LOAD = 3.0 + np.sin(2.1 * TIMES)
SIDE = np.sign(np.sin(0.83 * TIMES))
# A torque holds the load, and a little more: enough not to be a case of the pulley's columns.
HELD = LOAD + 0.2 * np.sin(5.0 * TIMES)
GAIN, PULLEY = (
    Candidate(catalogue()[name], "only", shape)
    for name, shape in (
        ("winch_torque_gain", ()),
        ("pulley_friction", (("wrap", 0.5 * np.pi),)),
    )
)


def equation(place, target, columns, noise=0.05):
    noise = noise * np.random.default_rng(1).standard_normal(ROWS)
    shaped = {term: np.atleast_3d(c.T).transpose(1, 2, 0) for term, c in columns.items()}
    measured = (target + noise)[:, None]
    return Equation(place, TIMES, measured, shaped, measured)


def named_in(*equations):
    return Search(gather([list(equations)], BLOCK_S)).run().findings


def winch(target, noise=0.05):
    columns = {GAIN: -HELD[:, None], PULLEY: np.column_stack([LOAD * SIDE, LOAD])}
    return equation(Place(Channel.SHAFT, "only"), target, columns, noise)


def test_weights_that_one_coefficient_cannot_have_are_no_rival():
    """A torque gain is a load alone; a pulley's share of load is second order in its friction."""
    (named,) = named_in(winch(0.05 * HELD))
    assert named.hypothesis.effect.id == "winch_torque_gain"
    assert named.alternatives == ()


def test_weights_that_one_coefficient_has_are_found():
    x = 0.1
    (named,) = named_in(winch(LOAD * (np.sinh(x) * SIDE + np.cosh(x) - 1.0)))
    assert named.hypothesis.effect.id == "pulley_friction"


@pytest.mark.parametrize(("beside", "found"), [(-0.002, True), (-0.02, False)])
def test_weights_that_differ_by_less_than_the_model_form_error_are_an_alternative(beside, found):
    """A share of the load against 0.1 of it that changes sides: 2 % of the amplitude, and 20 %."""
    search = Search(gather([[winch(LOAD * (0.1 * SIDE + beside), noise=0.001)]], BLOCK_S))
    pulley = Hypothesis(PULLEY.effect, (PULLEY,))
    assert search.fits.is_plausible([pulley], loosely=True) is found
    assert not search.fits.is_plausible([pulley])


DRAG = catalogue()["cable_transverse_damping"]
AGAINST_EXIT = (("exit_share", 1.0),)
BAR = Place(Channel.WRENCH, "bar")


def swinging(apart, drag=0.8):
    """A bar dragged by the first of two cables, whose columns differ by `apart`."""
    rng = np.random.default_rng(7)
    speed, other = np.sin(1.7 * TIMES), rng.standard_normal(ROWS)
    columns = {
        Candidate(DRAG, "a", AGAINST_EXIT): -speed[:, None],
        Candidate(DRAG, "b", AGAINST_EXIT): -(speed + apart * other)[:, None],
    }
    return equation(BAR, -drag * speed, columns)


def test_an_effect_on_another_element_is_a_tie_where_it_explains_the_same():
    (named,) = named_in(swinging(0.0))
    assert len(named.hypothesis.elements) == 1
    (rival,) = named.alternatives
    assert rival.hypothesis.effect.id == "cable_transverse_damping"
    assert {*named.hypothesis.elements, *rival.hypothesis.elements} == {"a", "b"}


def test_an_effect_on_another_element_is_no_tie_where_data_distinguish_it():
    (named,) = named_in(swinging(1.0))
    assert named.hypothesis.elements == ("a",)
    assert named.alternatives == ()


def test_as_much_of_something_else_is_no_rival():
    """Drag takes as much from the bar's residual as the gain from the winch's, but not worth it."""
    gain, noise = 0.002, 0.0065
    drag = 1.2 * gain * np.sqrt(2.0 * np.mean(HELD**2))
    (named,) = named_in(winch(gain * HELD, noise), swinging(1.0, drag))
    assert named.hypothesis.effect.id == "winch_torque_gain"
    assert named.alternatives == ()


AIR = catalogue()["bar_linear_damping"]


def test_a_simpler_rival_on_other_elements_is_the_best_of_them():
    """The bar's damping explains a little more, the second cable's drag nearly all with less."""
    rng = np.random.default_rng(11)
    speed, others = np.sin(1.7 * TIMES), rng.standard_normal((ROWS, 5))
    columns = {
        Candidate(AIR, "bar"): np.column_stack([-speed, -others]),
        Candidate(DRAG, "a", AGAINST_EXIT): -rng.standard_normal((ROWS, 1)),
        Candidate(DRAG, "b", AGAINST_EXIT): -speed[:, None],
    }
    reported = named_in(equation(BAR, -0.8 * speed - 0.004 * others[:, 0], columns))
    assert reported[0].hypothesis.effect.id == "cable_transverse_damping"
    assert reported[0].hypothesis.elements == ("b",)


BODY = Candidate(AIR, "bar")


def test_a_weight_beyond_its_bound_by_chance_is_put_there_and_another_is_left():
    half = np.array([0.1, 0.1, 0.1, 0.1, 0.1, 0.1])
    weights = np.array([0.5, -0.05, -0.2, 0.0, 0.1, 0.02])
    found = bounded(BODY, weights, half)
    np.testing.assert_array_equal(found, [0.5, 0.0, -0.2, 0.0, 0.1, 0.02])
    assert not is_allowed(BODY, found)
    assert is_allowed(BODY, bounded(BODY, weights, 3.0 * half))
    assert not is_allowed(BODY, np.zeros(6))


def torque_of(model_form_error, rival=0.1):
    """A drag by its speed, beside a rival that is nearly that, and a function of tension."""
    rng = np.random.default_rng(3)
    speed, other = np.sin(1.7 * TIMES), rng.standard_normal(ROWS)
    place = Place(Channel.SHAFT, "only")
    columns = {
        Candidate(catalogue()["winch_viscous_friction"], "only"): -speed[:, None],
        Candidate(catalogue()["winch_coulomb_friction"], "only"): -(speed + rival * other)[:, None],
    }
    shape = Knots().columns(place, {"tension [N]": LOAD})
    target = 0.05 * (model_form_error * np.cos(3.0 * LOAD) - speed)
    return equation(place, target, columns | {d: c[:, 0] for d, c in shape.items()}, noise=0.0025)


def only(name):
    return Hypothesis(catalogue()[name], (Candidate(catalogue()[name], "only"),))


def test_what_a_true_model_surely_does_better_decides():
    (named,) = named_in(torque_of(0.0))
    assert named.hypothesis.effect.id == "winch_viscous_friction"
    assert named.alternatives == ()


def test_less_than_the_model_form_error_decides_nothing():
    """The rival leaves 2 % of the gain in every block, a free function finds 4 times as much."""
    (named,) = named_in(torque_of(0.28))
    (rival,) = named.alternatives
    assert rival.hypothesis.effect.id == "winch_coulomb_friction"
    assert rival.behind == pytest.approx(2.0 / 4.0, rel=0.1)


def test_no_model_is_true_to_less_than_half_a_percent():
    (named,) = named_in(torque_of(0.0, rival=0.04))
    (rival,) = named.alternatives
    assert rival.hypothesis.effect.id == "winch_coulomb_friction"


def test_further_parameters_have_to_pay():
    """Two weights that can take the shape of one are less likely than that one."""
    speed = np.sin(1.7 * TIMES)
    place = Place(Channel.SHAFT, "only")
    viscous, stribeck = (
        Candidate(catalogue()[name], "only", shape)
        for name, shape in (
            ("winch_viscous_friction", ()),
            ("winch_stribeck_friction", (("stribeck_speed", 1.0),)),
        )
    )
    other = np.random.default_rng(3).standard_normal(ROWS)
    # Together they are the speed, of which neither alone is a case.
    pair = -np.column_stack([0.5 * speed + other, 0.5 * speed - other + 0.04 * np.cos(TIMES)])
    target = equation(
        place, -0.05 * speed, {viscous: -speed[:, None], stribeck: pair}, noise=0.0025
    )
    (named,) = named_in(target)
    assert named.hypothesis.effect.id == "winch_viscous_friction"
    (rival,) = named.alternatives
    # A single further parameter costs as much as the logarithm of the pairs of blocks.
    assert rival.behind > np.sqrt(np.log(20))


@pytest.mark.parametrize(("blocks", "counted"), [(20, 10), (48, 24), (4000, 24)])
def test_what_explains_the_same_with_a_number_more_is_tied_however_long_is_measured(
    blocks, counted
):
    apart = distance(np.zeros(blocks), 1.0, 1)
    assert apart == pytest.approx(np.sqrt(np.log(counted)))
    assert apart < DEFAULT_THRESHOLDS.tie_sigma < distance(np.zeros(blocks), 1.0, 2)


def test_an_effect_on_more_elements_than_blocks_show_is_found():
    """In six blocks of 24, on eight winches, each of which is sure."""
    names = [f"winch_{k}" for k in range(8)]
    speed = np.where(TIMES < 12.0, np.sin(1.7 * TIMES), 0.0)
    viscous = catalogue()["winch_viscous_friction"]

    def drags(size):
        return [
            equation(
                Place(Channel.SHAFT, name),
                -size * speed,
                {Candidate(viscous, name): -speed[:, None]},
                noise=0.0025,
            )
            for name in names
        ]

    (named,) = named_in(*drags(0.05))
    assert named.hypothesis.elements == tuple(names)
    base, sums = np.zeros(0, dtype=int), BlockRegression(gather([drags(0.05)], 2.0 * BLOCK_S))
    parts = [np.array([k]) for k in range(8)]
    assert sums.p_value(base, np.arange(8)) == 1.0
    assert chance(sums, base, parts) < 1e-6
    still = BlockRegression(gather([drags(0.0)], 2.0 * BLOCK_S))
    assert chance(still, base, parts) > 0.01


def test_what_is_not_kept_explains_nothing():
    speed = np.sin(1.7 * TIMES)
    place = Place(Channel.SHAFT, "only")
    viscous = Candidate(catalogue()["winch_viscous_friction"], "only")
    shape = Knots().columns(place, {"speed [rad/s]": speed})
    columns = {viscous: -speed[:, None]} | {d: c[:, 0] for d, c in shape.items()}
    search = Search(gather([[equation(place, -0.05 * speed, columns, noise=0.0025)]], BLOCK_S))
    found = search.run()
    assert [n.hypothesis.effect.id for n in found.findings] == ["winch_viscous_friction"]
    assert found.unexplained == ()
    ((driver, gain, share, _),) = search.unexplained([])
    assert driver.signal == "speed [rad/s]"
    assert gain.total > 0.0
    assert share > 0.9


@pytest.mark.parametrize(
    ("name", "common"), [("pose_delay", True), ("winch_viscous_friction", False)]
)
def test_what_one_system_reads_is_a_rival_with_one_number_for_all(name, common):
    late, effect, speed = catalogue()["tension_delay"], catalogue()[name], np.sin(1.7 * TIMES)
    cells = Candidate(late, "load_cells")
    each = [Candidate(effect, element) for element in ("bar", "winch_frame")]
    equations = [
        equation(Place(Channel.TENSION, c.element), speed, {cells: speed, c: speed}) for c in each
    ]
    gram = gather([equations], BLOCK_S)
    base, reported = np.zeros(0, dtype=int), Hypothesis(late, (cells,))
    rivals = rivals_of(gram, BlockRegression(gram), base, reported, each)
    assert [r.common for r in rivals if len(r.elements) == 2] == [common]
    assert not any(r.common for r in rivals if len(r.elements) == 1)


@pytest.mark.parametrize(("delay", "unknown"), [(1e-4, False), (1e-3, True)])
def test_what_a_healthy_machine_has_as_well_is_no_unknown_though_it_is_rejected(delay, unknown):
    cells = Candidate(catalogue()["tension_delay"], "load_cells")
    place, waves = Place(Channel.TENSION, "only"), np.sin(1.7 * TIMES)
    shape = Knots().columns(place, {"speed [rad/s]": waves})
    columns = {cells: waves / delay} | {d: c[:, 0] for d, c in shape.items()}
    search = Search(gather([[equation(place, waves, columns)]], BLOCK_S))
    assert bool(unexplained_beside(search, (), search.run().findings)) is unknown


SCALE, RADIUS, DRIVE = (
    Candidate(catalogue()[name], "only")
    for name in ("encoder_scale", "winch_drum_radius", "winch_torque_gain")
)


def wound(gain_column, light=1.0, hiding=()):
    """Lengths as of an encoder's scale; the torque is as it should be, `light` of the radius's.

    What is `hiding` does what the radius does.
    """
    length = np.sin(1.7 * TIMES)[:, None]
    load = light * LOAD[:, None]
    lengths = {SCALE: 10.0 * length, RADIUS: 1000.0 * length}
    torques = {RADIUS: 1000.0 * load, DRIVE: gain_column[:, None]}
    lengths |= dict.fromkeys(hiding, lengths[RADIUS])
    torques |= dict.fromkeys(hiding, torques[RADIUS])
    return (
        equation(Place(Channel.TENSION, "only"), 0.05 * length[:, 0], lengths, noise=0.002),
        equation(Place(Channel.SHAFT, "only"), 0.0 * LOAD, torques, noise=0.002),
    )


def test_an_effect_that_a_wrong_number_hides_is_an_alternative():
    """A wrong radius whose torque a gain of the drive makes up for is an encoder's scale."""
    (named,) = named_in(*wound(10.0 * LOAD))
    assert named.hypothesis.words == "encoder_scale on only"
    (rival,) = named.alternatives
    assert rival.words == "winch_torque_gain on only beside a wrong winch_drum_radius"
    assert rival.candidates == (DRIVE, RADIUS)
    # It has one number more.
    assert rival.behind == pytest.approx(np.sqrt(np.log(20)), abs=0.1)


def test_nor_is_it_missed_where_the_number_itself_is_named():
    """The radius spoils so little elsewhere that it is named, and an encoder's scale beside it."""
    looked = Search(gather([wound(0.2 * LOAD, light=0.02)], BLOCK_S))
    radius = Hypothesis(RADIUS.effect, (RADIUS,))
    reported = {rival.words for rival in alternatives_of(looked.fits, looked.heard, radius, [])}
    pair = "winch_torque_gain on only beside a wrong winch_drum_radius"
    assert reported == {"encoder_scale on only", pair}


def test_an_effect_is_an_alternative_beside_each_number_that_hides_it():
    stiffness = Candidate(catalogue()["cable_stiffness"], "only")
    looked = Search(gather([wound(10.0 * LOAD, hiding=(stiffness,))], BLOCK_S))
    scale = Hypothesis(SCALE.effect, (SCALE,))
    beside = [rival.beside for rival in alternatives_of(looked.fits, looked.heard, scale, [])]
    assert sorted(number.effect.id for number in beside) == sorted(
        [RADIUS.effect_id, stiffness.effect_id]
    )


def test_an_effect_that_a_wrong_number_cannot_hide_is_no_alternative():
    (named,) = named_in(*wound(10.0 * np.sin(5.0 * TIMES)))
    assert named.hypothesis.words == "encoder_scale on only"
    assert named.alternatives == ()


@pytest.mark.parametrize(
    ("model_form_error", "named_first"), [(0.0, "winch_drum_radius"), (0.3, "encoder_scale")]
)
def test_of_what_explains_the_same_a_wrong_number_is_named_first(model_form_error, named_first):
    """The encoder's column is the truth; the radius's is that, or a little beside it."""
    radius, scale = (
        Candidate(catalogue()[name], "only") for name in ("winch_drum_radius", "encoder_scale")
    )
    beside = LOAD + model_form_error * np.sin(5.0 * TIMES)
    columns = {scale: LOAD[:, None], radius: beside[:, None]}
    (named,) = named_in(equation(Place(Channel.TENSION, "only"), 0.02 * LOAD, columns, 0.005))
    assert named.hypothesis.effect.id == named_first


ONE_WAY, OFFSET = (
    Hypothesis(catalogue()[name], (Candidate(catalogue()[name], "only"),))
    for name in ("winch_directional_friction", "winch_torque_offset")
)


@pytest.mark.parametrize(
    ("fast", "tied"),
    [
        # The shaft is fast in one of 16 blocks, which holds half of what friction takes.
        (np.arange(16) == 14, True),
        # It is in every other one.
        (np.arange(16) % 2 == 0, False),
    ],
)
def test_a_rival_is_worse_by_how_many_blocks_say_so_not_by_how_much_one_does(fast, tied):
    """Where the shaft is slow, a constant is closer in every other pair of blocks."""
    slow = np.where(np.arange(16) // 2 % 2 == 0, 1.6, 0.4)
    target = np.repeat(np.where(fast, 6.3, slow), ROWS // 16)
    columns = {
        ONE_WAY.candidates[0]: 100.0 * np.repeat(np.where(fast, 6.3, 1.0), ROWS // 16)[:, None],
        OFFSET.candidates[0]: -100.0 * np.ones((ROWS, 1)),
    }
    row = equation(Place(Channel.SHAFT, "only"), target, columns)
    looked = Search(gather([[row]], 3.0 * BLOCK_S))
    base = looked.fits.columns([])
    most, less = (looked.fits.gain(each, base).total for each in (ONE_WAY, OFFSET))
    assert (less < 0.5 * most) is tied
    rivals = list(alternatives_of(looked.fits, looked.heard, ONE_WAY, []))
    assert [rival.hypothesis.effect.id for rival in rivals] == [OFFSET.effect.id] * tied
