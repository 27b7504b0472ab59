"""Forgotten prefixes of units: one line with the unit that was probably meant."""

import pytest
from machines import build, point_content
from pydantic import TypeAdapter

from cspm_msgs_py.errors import InputError
from cspm_msgs_py.testbed_keys.plausible import Coordinate, DrumRadius

FAULTS = [
    (("cables", 0, "stiffness", "youngs_modulus"), 60.0, "60 Pa, allowed: 100000 to 2e+12 Pa; 60"),
    (("cables", 0, "stiffness", "diameter"), 1.5, "1.5 m, allowed: 1e-05 to 0.3 m; 1.5 mm is 0.0"),
    (("cables", 1, "drum_radius"), 25.0, "25 m, allowed: 0.0001 to 5 m; 25 mm is 0.025 m"),
    (("cables", 0, "exit"), [1000.0, 0, 0], "1000 m, allowed: 0 to 600 m; 1000 mm is 1 m"),
    (("bar", "mass"), 2.0e8, "2e+08 kg, allowed: 1e-05 to 1e+07 kg; 2e+08 g is 2e+05 kg"),
]


def changed(path, value):
    content = point_content()
    node = content
    for part in path[:-1]:
        node = node[part]
    node[path[-1]] = value
    return content


@pytest.mark.parametrize(("path", "value", "text"), FAULTS)
def test_each_is_refused_with_the_unit_that_was_meant(path, value, text):
    with pytest.raises(InputError) as caught:
        build(changed(path, value))
    assert text in str(caught.value)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("path", "value"),
    [
        (("cables", 0, "stiffness", "youngs_modulus"), 1.0e5),
        (("cables", 0, "stiffness", "youngs_modulus"), 2.0e12),
        (("cables", 1, "drum_radius"), 5.0),
        (("cables", 0, "exit"), [600.0, 0, 0]),
        (("bar", "com"), [0.0, 0.0, 0.0]),
    ],
)
def test_the_ends_are_allowed(path, value):
    build(changed(path, value))


def test_without_a_likely_unit_none_is_proposed():
    with pytest.raises(InputError) as caught:
        build(changed(("cables", 0, "drum_radius"), 1.0e6))
    assert str(caught.value).endswith("1e+06 m, allowed: 0.0001 to 5 m")


@pytest.mark.parametrize(("annotated", "least"), [(Coordinate, -600.0), (DrumRadius, 1e-4)])
def test_the_schema_allows_both_signs_where_zero_is_allowed(annotated, least):
    assert TypeAdapter(annotated).json_schema()["minimum"] == least
