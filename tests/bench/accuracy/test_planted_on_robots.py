"""The table of what is planted in the six robots."""

from types import SimpleNamespace

import pytest

from bench.accuracy import planted_on_robots as robots


def test_three_kinds_in_each_robot_are_planted_where_its_file_has_them():
    cases = list(robots.planted())
    assert len(cases) == 18
    assert {case.robot for case in cases} == set(robots.ROBOTS)
    assert {case.effect for case in cases} == {
        "winch_coulomb_friction",
        "cable_stiffness",
        "winch_drum_radius",
    }
    radius = next(c for c in cases if (c.robot, c.parameter) == ("ipanema", "radius"))
    assert radius.value == pytest.approx(1.02 * 0.03)


@pytest.mark.parametrize(
    ("effect", "interval", "shown"),
    [
        ("cable_stiffness", (0.79, 0.81), "0.8 (0.79 to 0.81)"),
        ("cable_stiffness", (0.81, 0.83), "0.8 (0.81 to 0.83) ✗"),
        ("cable_creep", (0.79, 0.81), "cable_creep on c3 ✗"),
        (None, (), "nothing ✗"),
    ],
)
def test_a_row_marks_what_is_wrong(effect, interval, shown, monkeypatch, tmp_path):
    parameter = SimpleNamespace(value=0.8, ci95=interval)
    finding = SimpleNamespace(effect=effect, elements=("c3",), parameters={"scale": parameter})
    found = SimpleNamespace(findings=(finding,) if effect else (), verdict="parameter")
    monkeypatch.setattr(robots.cspm, "diagnose", lambda *_, **__: found)
    run = SimpleNamespace(save=lambda folder: folder)
    monkeypatch.setattr(robots.cspm, "simulate", lambda *_, **__: run)
    case = robots.Planted("ipanema", "c3", "cable_stiffness", "scale", 0.8)
    row = robots.diagnosed(case, tmp_path)
    assert row == ("ipanema", "cable_stiffness on c3", "0.8", "parameter", shown)
