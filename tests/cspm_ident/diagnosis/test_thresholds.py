"""All that decides what is reported has a name, a range and a basis, and is passed on."""

from dataclasses import fields, replace

import pytest
from diagnosis_samples import diagnosis

from cspm_ident.diagnosis.reporting.verdict import diagnosis_data
from cspm_ident.diagnosis.thresholds import DEFAULT_THRESHOLDS, GROUPS, Thresholds
from cspm_msgs_py.errors import InputError

FIELDS = fields(Thresholds)


@pytest.mark.parametrize("each", FIELDS, ids=lambda each: each.name)
def test_a_threshold_says_what_it_is_and_what_it_rests_on(each):
    known = each.metadata
    assert set(known) == {"unit", "low", "high", "meaning", "basis"}
    assert known["meaning"].endswith(".")
    assert known["basis"].endswith(".")
    assert known["low"] <= each.default <= known["high"]
    assert known["low"] >= 0.0


def test_each_threshold_belongs_to_one_stage():
    names = [each.name for group in GROUPS for each in fields(group)]
    assert sorted(names) == sorted(each.name for each in FIELDS)
    assert len(set(names)) == len(names)
    assert list(DEFAULT_THRESHOLDS.values) == names


@pytest.mark.parametrize(
    ("name", "value", "allowed"),
    [
        ("confirmed_share", 1.2, "0 to 1"),
        ("confirmed_share", -0.1, "0 to 1"),
        ("material_share", 1.0, "0 to 0.99"),
        ("tie_sigma", float("nan"), "0 or more"),
        ("tie_sigma", float("inf"), "0 or more"),
        ("tie_sigma", "2", "0 or more"),
        ("most_effects", 0, "a whole number, 1 or more"),
        ("most_effects", 2.0, "a whole number, 1 or more"),
        ("most_effects", True, "a whole number, 1 or more"),
    ],
)
def test_a_bad_value_is_one_line_that_says_what_is_allowed(name, value, allowed):
    with pytest.raises(InputError) as refused:
        Thresholds(**{name: value})
    assert str(refused.value) == f"thresholds: {name} is {value}, allowed: {allowed}"


@pytest.mark.parametrize("each", FIELDS, ids=lambda each: each.name)
def test_the_ends_of_a_range_are_allowed_and_what_is_beyond_is_not(each):
    kind = int if each.metadata["unit"] == "count" else float
    ends = [kind(end) for end in (each.metadata["low"], each.metadata["high"]) if end < 1e300]
    for end in ends:
        assert getattr(replace(DEFAULT_THRESHOLDS, **{each.name: end}), each.name) == end
    with pytest.raises(InputError, match=each.name):
        replace(DEFAULT_THRESHOLDS, **{each.name: ends[0] - 1})


def test_a_diagnosis_tells_the_thresholds_that_it_was_given():
    moved = replace(DEFAULT_THRESHOLDS, unknown_share=0.3)
    assert diagnosis_data(diagnosis())["thresholds"] == DEFAULT_THRESHOLDS.values
    assert diagnosis_data(replace(diagnosis(), thresholds=moved))["thresholds"] == moved.values
    assert moved.values["unknown_share"] == 0.3
