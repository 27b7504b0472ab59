import os
import re
from pathlib import Path
from typing import Annotated, Literal

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pydantic import Field, PositiveFloat, ValidationError, model_validator

from cspm_msgs_py.errors import InputError
from cspm_msgs_py.yaml_file import StrictModel, dump_yaml, parse_yaml, read_yaml, validate


class Round(StrictModel):
    kind: Literal["round"] = "round"
    radius: PositiveFloat


class Square(StrictModel):
    kind: Literal["square"] = "square"
    side: PositiveFloat
    angle: float = 0.0

    @model_validator(mode="after")
    def _upright(self):
        if self.angle > 1.0:
            raise ValueError(f"angle: {self.angle:g}, allowed: ≤ 1")
        return self


Shape = Annotated[Round | Square, Field(discriminator="kind")]


class Drawer(StrictModel):
    name: str
    count: int = 1
    open: bool = False
    shapes: tuple[Shape, ...] = ()
    lid: Shape | None = None
    corner: tuple[float, float] = (0.0, 0.0)
    marks: dict[str, Round] = Field(default_factory=dict)
    sizes: dict[Literal["small", "large"], float] = Field(default_factory=dict)


DRAWER = {"name": "d"}
FAULTS = [
    ({}, "name: missing, a value is required"),
    ({"name": 3}, "name: 3, allowed: text"),
    ({"name": True}, "name: True, allowed: text"),
    ({**DRAWER, "nme": 1}, "nme: unknown key, allowed: name, count, open, shapes, lid, corner"),
    ({**DRAWER, 3: 1}, "3: unknown key, allowed: name, count"),
    ({**DRAWER, "count": 1.5}, "count: 1.5, allowed: a whole number without decimal point"),
    ({**DRAWER, "count": "1"}, "count: '1', allowed: a whole number without decimal point"),
    ({**DRAWER, "count": True}, "count: True, allowed: a whole number without decimal point"),
    ({**DRAWER, "count": None}, "count: None, allowed: a whole number without decimal point"),
    ({**DRAWER, "open": 1}, "open: 1, allowed: true or false"),
    ({**DRAWER, "shapes": 1}, "shapes: 1, allowed: a list"),
    ({**DRAWER, "corner": {"x": 1}}, "corner: {'x': 1}, allowed: a list"),
    ({**DRAWER, "corner": [1]}, "corner[1]: missing, a value is required"),
    ({**DRAWER, "corner": [1, 2, 3]}, "corner: [1, 2, 3], allowed: a list of at most 2"),
    ({**DRAWER, "corner": [1, "2"]}, "corner[1]: '2', allowed: a number"),
    ({**DRAWER, "corner": [1, True]}, "corner[1]: True, allowed: a number"),
    ({**DRAWER, "corner": [1, float("nan")]}, "corner[1]: nan, allowed: a finite number"),
    ({**DRAWER, "corner": [float("-inf"), 1]}, "corner[0]: -inf, allowed: a finite number"),
    ({**DRAWER, "lid": 3}, "lid: 3, allowed: a mapping of keys to values"),
    ({**DRAWER, "lid": {"side": 1}}, "lid.kind: missing, allowed: 'round' or 'square'"),
    ({**DRAWER, "lid": {"kind": "oval"}}, "lid.kind: 'oval', allowed: 'round' or 'square'"),
    ({**DRAWER, "lid": {"kind": [1]}}, "lid.kind: '[1]', allowed: 'round' or 'square'"),
    ({**DRAWER, "lid": {"kind": "round"}}, "lid.radius: missing, a value is required"),
    ({**DRAWER, "lid": {"kind": "round", "radius": -1}}, "lid.radius: -1, allowed: greater than 0"),
    (
        {**DRAWER, "lid": {"kind": "round", "side": 1}},
        "lid.side: unknown key, allowed: kind, radius (and 1 more fault)",
    ),
    (
        {**DRAWER, "shapes": [{"kind": "round", "radius": 1}, {"kind": "square", "size": 1}]},
        "shapes[1].size: unknown key, allowed: kind, side, angle; did you mean side?"
        " (and 1 more fault)",
    ),
    (
        {**DRAWER, "lid": {"kind": "square", "side": 1, "angle": 2}},
        "lid.angle: 2, allowed: ≤ 1",
    ),
    ({**DRAWER, "marks": []}, "marks: [], allowed: a mapping of keys to values"),
    ({**DRAWER, "marks": {"a": {"radius": 0}}}, "marks.a.radius: 0, allowed: greater than 0"),
    ({**DRAWER, "marks": {"a": {"r": 1}}}, "marks.a.r: unknown key, allowed: kind, radius"),
    ({**DRAWER, "sizes": {"tiny": 1}}, "sizes.tiny: 'tiny', allowed: 'small' or 'large'"),
    ({"count": "x", "open": 3}, "name: missing, a value is required (and 2 more faults)"),
]


@pytest.mark.parametrize(("content", "text"), FAULTS)
def test_each_fault_is_one_line_with_key_value_and_what_is_allowed(content, text):
    with pytest.raises(InputError) as caught:
        validate(Drawer, content, "d.yaml")
    line = str(caught.value)
    assert line.startswith(f"d.yaml: {text}")
    if "more fault" not in text:
        assert "more fault" not in line or "unknown key" in line
    assert "\n" not in line


@pytest.mark.parametrize(
    ("content", "kind"),
    [(None, "an empty file"), ([1], "a list"), ("a", "a text"), (3, "a number"), (1.5, "float")],
)
def test_what_is_no_mapping_is_refused(content, kind):
    with pytest.raises(InputError) as caught:
        validate(Drawer, content, "d.yaml")
    assert str(caught.value) == f"d.yaml: {kind}, allowed: a mapping of keys to values"


def test_a_whole_model_is_read():
    drawer = validate(
        Drawer,
        {
            "name": "d",
            "open": True,
            "shapes": [{"kind": "round", "radius": 1}],
            "lid": {"kind": "square", "side": 2.5},
            "corner": [1, 2.5],
            "sizes": {"small": 3},
        },
        "d.yaml",
    )
    assert drawer.shapes == (Round(radius=1.0),)
    assert drawer.lid == Square(side=2.5)
    assert drawer.corner == (1.0, 2.5)
    assert drawer.sizes == {"small": 3.0}
    assert drawer.open is True


def test_a_long_value_is_shortened():
    with pytest.raises(InputError) as caught:
        validate(Drawer, {"name": list(range(1000))}, "d.yaml")
    assert len(str(caught.value)) < 120
    assert "…, allowed: text" in str(caught.value)


def test_models_are_frozen():
    drawer = validate(Drawer, DRAWER, "d.yaml")
    with pytest.raises(ValidationError, match="frozen"):
        drawer.name = "e"


@pytest.mark.parametrize(
    ("text", "fault"),
    [
        ("a: b: c", "line 1: not YAML: mapping values are not allowed here"),
        ("a: 1\nb: [", "line 2: not YAML: expected the node content, but found '<stream end>'"),
        (
            "a: 1\nb: 2\na: 3\n",
            'line 3: duplicate key "a", allowed: each key once',
        ),
        (
            "a: 1\n---\nb: 2",
            "line 2: not YAML: expected a single document in the stream, but found another documen",
        ),
        ("a: *b", "line 1: not YAML: found undefined alias 'b'"),
        ("a: !b 3", "line 1: not YAML: could not determine a constructor for the tag '!b'"),
        ("a: !!python/name:os.system", "line 1: not YAML: could not determine a constructor"),
        ("a: 2020-13-45", "not YAML (month must be in 1..12)"),
        ("\x00\x01", "not YAML (unacceptable character #x0000: special characters"),
        ("a: &b [*b]", "nested without end, allowed: at most 50 levels"),
        ("a: &b {c: *b}", "nested without end, allowed: at most 50 levels"),
        ("a: " + "[" * 60 + "]" * 60, "nested without end, allowed: at most 50 levels"),
        ("a: " + "[" * 5000, "nested without end, allowed: at most 50 levels"),
        ("? [1, 2]\n: 3", "[1, 2] as a key, allowed: text"),
        ("? {a: 1}\n: 3", "line 1: not YAML: found unhashable key"),
    ],
)
def test_text_that_is_not_yaml_is_refused_in_one_line(text, fault):
    with pytest.raises(InputError) as caught:
        parse_yaml(text, "d.yaml")
    assert str(caught.value).startswith(f"d.yaml: {fault}")
    assert "\n" not in str(caught.value)


def bomb(levels, width, merge=False):
    """Text whose aliases stand for width ** levels values."""
    lines = ["a0: &a0 {x: 1}"]
    for i in range(1, levels + 1):
        each = ", ".join([f"*a{i - 1}"] * width)
        lines.append(f"a{i}: &a{i} " + (f"{{<<: [{each}]}}" if merge else f"{{x: [{each}]}}"))
    return "\n".join(lines)


@pytest.mark.parametrize("merge", [False, True])
@pytest.mark.parametrize(("levels", "width"), [(9, 9), (40, 2), (30, 100)])
def test_aliases_that_stand_for_too_much_are_refused_at_once(levels, width, merge):
    with pytest.raises(InputError) as caught:
        parse_yaml(bomb(levels, width, merge), "d.yaml")
    assert re.fullmatch(
        r"d\.yaml: \S+ values with its aliases written out, allowed: at most 200000",
        str(caught.value),
    )


def test_few_aliases_mean_what_they_stand_for():
    found = parse_yaml(bomb(2, 3), "d.yaml")
    assert found["a2"] == {"x": [{"x": [{"x": 1}] * 3}] * 3}
    assert parse_yaml("a: &b {c: 1}\nd: {<<: *b, e: 2}", "d.yaml")["d"] == {"c": 1, "e": 2}


def test_text_has_its_largest_size(tmp_path):
    with pytest.raises(InputError) as caught:
        parse_yaml("a" * 1_000_001, "d.yaml")
    assert str(caught.value) == "d.yaml: 1000001 characters, allowed: at most 1000000"
    path = tmp_path / "d.yaml"
    path.write_bytes(b"#" * 1_000_001)
    with pytest.raises(InputError) as caught:
        read_yaml(path)
    assert str(caught.value) == f"{path}: 1000001 bytes, allowed: at most 1000000"
    path.write_bytes(b"#" * 1_000_000)
    assert read_yaml(path) is None


def test_a_pipe_and_a_device_are_not_waited_for(tmp_path):
    os.mkfifo(tmp_path / "pipe.yaml")
    for path in (tmp_path / "pipe.yaml", Path("/dev/zero")):
        with pytest.raises(InputError) as caught:
            read_yaml(path)
        expected = f"{path}: unreadable (no regular file), allowed: a YAML file"
        assert str(caught.value) == expected


@given(text=st.text(max_size=60))
def test_any_text_is_read_or_refused_in_one_line(text):
    line = "d.yaml: read"
    try:
        validate(Drawer, parse_yaml(text, "d.yaml"), "d.yaml")
    except InputError as err:
        line = str(err)
    assert re.fullmatch(r"d\.yaml: [^\n]+", line)


def test_files_that_cannot_be_read(tmp_path):
    binary = tmp_path / "binary.yaml"
    binary.write_bytes(bytes(range(256)))
    for path, fault in [
        (tmp_path / "none.yaml", "no such file"),
        (tmp_path, "unreadable"),
        (binary, "unreadable ('utf-8' codec can't decode byte 0x80"),
    ]:
        with pytest.raises(InputError) as caught:
            read_yaml(path)
        assert str(caught.value).startswith(f"{path}: {fault}")
        assert "\n" not in str(caught.value)


plain = st.recursive(
    st.none()
    | st.booleans()
    | st.integers(-(10**9), 10**9)
    | st.floats(allow_nan=False, allow_infinity=False)
    | st.text(st.characters(codec="ascii", exclude_categories=["Cc"]), max_size=20),
    lambda inner: (
        st.lists(inner, max_size=3)
        | st.dictionaries(st.from_regex(r"[a-z]{1,6}", fullmatch=True), inner, max_size=3)
    ),
    max_leaves=8,
)


@settings(deadline=None)
@given(content=plain)
def test_what_is_dumped_is_read_back(content):
    assert parse_yaml(dump_yaml(content), "d.yaml") == content


def test_dumping_keeps_the_order_of_keys():
    assert dump_yaml({"b": 1, "a": [1, 2]}) == "b: 1\na:\n- 1\n- 2\n"


def test_what_is_changed_in_a_content_is_not_there_when_the_text_is_read_again():
    text = "a: &shared [1, 2]\nb: *shared\n"
    first = parse_yaml(text, "here")
    assert first["a"] is first["b"]
    first["a"].append(3)
    assert parse_yaml(text, "here") == {"a": [1, 2], "b": [1, 2]}
