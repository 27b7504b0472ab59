"""The drawing of a test-bed: every part at its place, the guilty ones marked and named."""

import re

import numpy as np
import pytest
from diagnosis_samples import BAR_POSE, THESIS
from run_samples import SCENARIOS

from cspm_ident.diagnosis.reporting.machine_drawing import drawing
from cspm_ident.diagnosis.reporting.machine_part import Kind, Part, parts_of
from cspm_msgs_py.testbed import load_testbed
from cspm_sim.effects import catalogue

ONE_WINCH = load_testbed(SCENARIOS / "testbeds" / "one_winch.yaml")


@pytest.mark.parametrize(
    ("name", "element", "words"),
    [
        ("winch_coulomb_friction", "surge_2", "winch surge_2"),
        ("cable_stiffness", "hoist_1", "cable hoist_1"),
        ("tension_gain", "sway_3", "load cell sway_3"),
        ("encoder_scale", "sway_3", "winch sway_3"),
        ("bar_mass", "bar", "bar"),
        ("frame_flexibility", "winch_frame", "winch frame"),
        ("pose_delay", "bar", "motion capture of bar"),
    ],
)
def test_an_effect_sits_in_a_part_that_the_drawing_marks(name, element, words):
    (part,) = parts_of(catalogue()[name], element, ("a", "b"))
    assert part.words.replace("_", " ") == words.replace("_", " ")
    picture = drawing(THESIS.testbed, BAR_POSE, None, [part])
    (guilty,) = re.findall(r"<g class=guilty.*?</g>", picture)
    assert f"<title>{part.words}</title>" in guilty
    assert "class=guilty" not in drawing(THESIS.testbed, BAR_POSE, None, [])


def test_names_stand_beside_the_machine_and_lead_to_their_parts():
    parts = [Part(Kind.WINCH, "surge_2"), Part(Kind.WINCH, "sway_4"), Part(Kind.BODY, "bar")]
    picture = drawing(THESIS.testbed, BAR_POSE, None, parts)
    right = max(float(x) for x in re.findall(r'cx="([^"]*)"', picture))
    texts = re.findall(r'<text x="([^"]*)" y="([^"]*)"[^>]*>([^<]*)<', picture)
    assert {words for _, _, words in texts} == {part.words for part in parts}
    assert all(float(x) > right + 8.0 for x, _, _ in texts)
    heights = [float(y) for _, y, _ in texts]
    assert np.all(np.diff(heights) >= 20.0)
    assert picture.count("stroke-dasharray") == len(parts)


def test_the_machine_fills_the_height_of_its_picture():
    picture = drawing(THESIS.testbed, BAR_POSE, None, [])
    heights = [float(y) for y in re.findall(r'y[12]="([^"]*)"', picture)]
    height = float(re.search(r'viewBox="0 0 \S+ (\S+)"', picture)[1])
    assert min(heights) >= 0.0
    assert max(heights) <= height
    assert np.ptp(heights) > 0.8 * height


def test_what_acts_on_all_load_cells_marks_each_of_them():
    cables = THESIS.testbed.cable_names
    parts = parts_of(catalogue()["tension_delay"], "load_cells", cables)
    assert parts == [Part(Kind.LOAD_CELL, name) for name in cables]


def test_the_drawing_has_every_part_at_its_place():
    picture = drawing(THESIS.testbed, BAR_POSE, None, [])
    for cable in THESIS.testbed.cable_names:
        for kind in (Kind.WINCH, Kind.CABLE, Kind.LOAD_CELL):
            assert f"<title>{Part(kind, cable).words}</title>" in picture
    line = re.search(r"<title>cable hoist 1</title><line [^>]*", picture).group()
    top, bottom = (float(re.search(rf'y{k}="([^"]*)"', line)[1]) for k in (1, 2))
    # z is down in the world and on the screen.
    assert top < bottom
    low, high = (
        float(re.search(r'viewBox="0 0 \S+ (\S+)"', drawing(machine.testbed, pose, None, []))[1])
        for machine, pose in ((ONE_WINCH, None), (THESIS, BAR_POSE))
    )
    assert low < 0.3 * high
    rig = drawing(ONE_WINCH.testbed, None, None, [Part(Kind.CABLE, "surge")])
    assert rig.count("<title>") == 3
