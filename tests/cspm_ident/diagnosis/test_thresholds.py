"""All that decides what is reported has a name, a range and a basis, and is passed on."""

import ast
from dataclasses import fields, replace
from pathlib import Path

import pytest
from diagnosis_samples import diagnosis

from cspm_ident.diagnosis.reporting.verdict import diagnosis_data
from cspm_ident.diagnosis.thresholds import DEFAULT_THRESHOLDS, GROUPS, Thresholds, thresholds_of
from cspm_msgs_py.errors import InputError

PACKAGE = Path(__file__).resolve().parents[3] / "cspm_ident" / "diagnosis"
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


def test_some_values_by_name_leave_the_others_at_their_defaults():
    assert thresholds_of({}) == DEFAULT_THRESHOLDS
    assert thresholds_of({"tie_sigma": 3.0}) == replace(DEFAULT_THRESHOLDS, tie_sigma=3.0)


@pytest.mark.parametrize(
    ("values", "refused"),
    [
        ({"tie_sigmas": 3.0}, "thresholds: no tie_sigmas, allowed: tie_sigma"),
        ({"xyz": 3.0}, "thresholds: no xyz, allowed: those of docs/reference/thresholds.md"),
        ({"tie_sigma": -1.0}, "thresholds: tie_sigma is -1.0, allowed: 0 or more"),
    ],
)
def test_a_name_that_there_is_not_is_one_line_with_its_nearest(values, refused):
    with pytest.raises(InputError) as found:
        thresholds_of(values)
    assert str(found.value).startswith(refused)
    assert "\n" not in str(found.value)


@pytest.mark.parametrize("each", FIELDS, ids=lambda each: each.name)
def test_the_ends_of_a_range_are_allowed_and_what_is_beyond_is_not(each):
    kind = int if each.metadata["unit"] == "count" else float
    ends = [kind(end) for end in (each.metadata["low"], each.metadata["high"]) if end < 1e300]
    for end in ends:
        assert getattr(replace(DEFAULT_THRESHOLDS, **{each.name: end}), each.name) == end
    with pytest.raises(InputError, match=each.name):
        replace(DEFAULT_THRESHOLDS, **{each.name: ends[0] - 1})


def test_a_diagnosis_reports_the_thresholds_that_it_was_given():
    moved = replace(DEFAULT_THRESHOLDS, unknown_share=0.3)
    assert diagnosis_data(diagnosis())["thresholds"] == DEFAULT_THRESHOLDS.values
    assert diagnosis_data(replace(diagnosis(), thresholds=moved))["thresholds"] == moved.values
    assert moved.values["unknown_share"] == 0.3


def with_thresholds(tree):
    """Names of the functions and classes of a module that take thresholds."""
    for node in ast.walk(tree):
        if isinstance(node, ast.FunctionDef) and node.name != "__init__" and takes(node):
            yield node.name
        if isinstance(node, ast.ClassDef):
            made = [n for n in node.body if getattr(n, "name", "") == "__init__"]
            if made and takes(made[0]):
                yield node.name


def takes(function):
    arguments = function.args
    return "thresholds" in {a.arg for a in (*arguments.args, *arguments.kwonlyargs)}


def forgotten(tree, names):
    """Calls in a module that leave out thresholds which the called one takes."""
    for node in ast.walk(tree):
        if isinstance(node, ast.Call):
            name = getattr(node.func, "attr", getattr(node.func, "id", ""))
            given = ast.unparse(node)
            if name in names and not any(w in given for w in ("thresholds", "limits", "*given")):
                yield f"line {node.lineno}: {given}"


def test_no_function_of_the_diagnosis_forgets_to_pass_thresholds_on():
    trees = {path: ast.parse(path.read_text()) for path in sorted(PACKAGE.rglob("*.py"))}
    own = {path: set(with_thresholds(tree)) for path, tree in trees.items()}
    public = {name for names in own.values() for name in names if not name.startswith("_")}
    assert {"BlockRegression", "equations_of", "Search", "searched_for", "highest_line"} <= public
    found = [
        f"{path.name} {each}"
        for path, tree in trees.items()
        for each in forgotten(tree, public | own[path])
    ]
    assert not found, "\n".join(found)


def test_the_check_sees_a_call_that_forgets_thresholds():
    tree = ast.parse("def f(a, thresholds=None): ...\nf(1)\nf(1, thresholds)\nf(1, limits)")
    assert list(forgotten(tree, set(with_thresholds(tree)))) == ["line 2: f(1)"]


def test_no_constant_that_decides_is_read_from_the_defaults_inside_the_diagnosis():
    """A default argument is the only use of the defaults there."""
    for path in sorted(set(PACKAGE.rglob("*.py")) - {PACKAGE / "thresholds.py"}):
        text = path.read_text()
        uses = [line for line in text.splitlines() if "DEFAULT_THRESHOLDS" in line]
        for line in uses:
            allowed = ("import", "= DEFAULT_THRESHOLDS")
            assert any(word in line for word in allowed), f"{path.name}: {line}"
            assert "DEFAULT_THRESHOLDS." not in line, f"{path.name}: {line}"
