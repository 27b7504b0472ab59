"""The page of isolability says what the columns say, and what physics says of some pairs."""

import re
from pathlib import Path

import numpy as np
import pytest

from cspm_ident.diagnosis.residuals.regressors import Place
from cspm_ident.diagnosis.residuals.residual_equation import Equation
from cspm_ident.experiment.isolability import Sensors, Signature, angles
from cspm_ident.experiment.isolability_page import angle_table, isolability_page, rich_measurement
from cspm_sim.effects import Channel, catalogue

PAGE = Path(__file__).resolve().parents[3] / "docs" / "reference" / "isolability.md"
# Each with a dry friction, a constant, or a force in proportion to the tension.
NAMES = (
    "pulley_friction",
    "tension_bias",
    "winch_coulomb_friction",
    "winch_load_friction",
    "winch_torque_offset",
)


@pytest.fixture(scope="module")
def table():
    return angle_table(rich_measurement(), [catalogue()[name] for name in NAMES])


def rows(text):
    """The pairs of the first table with their angles as written."""
    found = re.findall(r"^\| `(\w+)`, `(\w+)` \| (.*) \|$", text, re.MULTILINE)
    return {(one, other): rest.split(" | ") for one, other, rest in found}


@pytest.mark.slow
def test_the_committed_page_holds_what_the_columns_say(table):
    committed = rows(PAGE.read_text(encoding="utf-8"))
    fresh = rows(isolability_page({name: catalogue()[name] for name in NAMES}, table))
    assert len(fresh) >= 4
    hint = "run: python -m cspm_ident.experiment.isolability_page > docs/reference/isolability.md"
    for pair, written in fresh.items():
        for old, new in zip(committed[pair], written, strict=True):
            assert (old == "—") == (new == "—"), hint
            assert old == "—" or abs(float(old) - float(new)) <= 1.0, hint


def test_every_effect_and_every_confounded_pair_is_on_the_page():
    text = PAGE.read_text(encoding="utf-8")
    pairs = {frozenset(pair) for pair in rows(text)}
    for effect in catalogue().values():
        assert f"\n| `{effect.id}` | " in text
        others = effect.description.confounded_with
        assert all(frozenset((effect.id, other)) in pairs for other in others)


@pytest.mark.slow
def test_where_the_load_cell_sits_decides_on_friction_of_the_pulley(table):
    pair = "pulley_friction", "winch_load_friction"
    assert table[Sensors.BAR_AND_CAPTURE][pair] < 0.1
    assert table[Sensors.DRUM_AND_CAPTURE][pair] > 80.0
    # A cell at the drum measures what the winch pulls: the pulley is beyond it.
    assert table[Sensors.DRUM][pair] is None
    assert table[Sensors.BAR][pair] < 0.1


@pytest.mark.slow
def test_motion_capture_distinguishes_a_bias_of_the_cell_from_one_of_the_torque(table):
    pair = "tension_bias", "winch_torque_offset"
    assert table[Sensors.BAR][pair] < 0.01
    assert table[Sensors.BAR_AND_CAPTURE][pair] > 1.0


def test_angles_are_those_between_the_columns():
    place = Place(Channel.SHAFT, "only")
    times = np.arange(100.0)
    column = np.zeros((100, 1, 1))
    one, turned, across = column.copy(), column.copy(), column.copy()
    one[0], turned[:2, 0, 0], across[1] = 1.0, (1.0, np.tan(np.radians(30.0))), 5.0
    start = column.copy()
    start[2] = 1.0
    shifted = one + 3.0 * start
    target = np.zeros((100, 1))
    equation = Equation(place, times, target, {}, target, start)
    found = [
        Signature("one", {place: one}),
        Signature("turned", {place: turned}),
        Signature("across", {place: across}),
        Signature("shifted", {place: shifted}),
        Signature("both", {place: np.concatenate([turned, across], axis=2)}),
        Signature("nowhere", {}),
    ]
    angle = angles(found, [equation], {place: np.array([0.1])})
    assert angle["one", "turned"] == pytest.approx(30.0)
    assert angle["turned", "across"] == pytest.approx(60.0)
    assert angle["one", "across"] == pytest.approx(90.0)
    # What the unknown start explains counts for nothing.
    assert angle["one", "shifted"] == pytest.approx(0.0, abs=1e-6)
    assert angle["one", "both"] == pytest.approx(0.0, abs=1e-6)
    assert angle["one", "nowhere"] is None
