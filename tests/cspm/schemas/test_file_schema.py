"""The JSON Schemas of files: all that is shipped is valid, and what they refuse readers refuse."""

import json
import random
import shutil
from copy import deepcopy
from pathlib import Path

import jsonschema
import pytest

from cspm.campaign.campaign_file import load_campaign
from cspm.schemas.file_schema import KINDS, schema_of
from cspm_ident.diagnosis.reporting.verdict import SCHEMA
from cspm_ident.diagnosis_file import SCHEMA as READ_SCHEMA
from cspm_ident.diagnosis_file import read_diagnosis
from cspm_ident.importing.mapping import load_mapping
from cspm_msgs_py.errors import InputError
from cspm_msgs_py.scenario import load_scenario
from cspm_msgs_py.testbed import load_testbed
from cspm_msgs_py.yaml_file import dump_yaml, read_yaml

ROOT = Path(__file__).resolve().parents[3]
LIBRARY = ROOT / "scenarios"
APART = {"testbeds": "testbed", "mappings": "mapping"}
FILES = [
    *((APART.get(path.parent.name, "scenario"), path) for path in sorted(LIBRARY.rglob("*.yaml"))),
    *(("campaign", path) for path in sorted((ROOT / "examples/campaigns").glob("*.yaml"))),
]
READERS = {
    "testbed": load_testbed,
    "scenario": load_scenario,
    "mapping": load_mapping,
    "campaign": load_campaign,
    "diagnosis": read_diagnosis,
}
DIAGNOSIS = {
    "schema": "cspm.diagnosis/1",
    "recordings": [{"path": "a", "sha256": "0", "role": "search"}],
    "testbed": {"path": "thesis.yaml", "sha256": "0"},
    "verdict": "consistent",
    "findings": [],
    "not_excited": [],
    "fit": [],
    "model": None,
    "energy": [],  # one of those that are no part of what a reader may count on
}


@pytest.fixture(scope="module")
def validators():
    found = {kind: jsonschema.Draft202012Validator(schema_of(kind)) for kind in KINDS}
    for each in found.values():
        each.check_schema(each.schema)
    return found


def content_of(kind, path=None):
    """A file's content as JSON has it; without a path that of one of its kind."""
    if kind == "diagnosis":
        return deepcopy(DIAGNOSIS)
    names = {"testbed": "one_winch", "scenario": "calm", "mapping": "emps"}
    path = path or next(p for k, p in FILES if k == kind and names.get(k, p.stem) == p.stem)
    return json.loads(json.dumps(read_yaml(path)))


def is_read(kind, content, folder):
    # The functions that campaigns' files name.
    for own in (ROOT / "examples" / "campaigns").glob("*.py"):
        shutil.copy(own, folder)
    path = folder / ("file.json" if kind == "diagnosis" else "file.yaml")
    path.write_text(json.dumps(content) if kind == "diagnosis" else dump_yaml(content))
    try:
        READERS[kind](path)
    except InputError:
        return False
    return True


def test_every_kind_of_file_is_shipped_but_for_what_a_diagnosis_writes():
    assert {kind for kind, _ in FILES} == set(KINDS) - {"diagnosis"}


@pytest.mark.parametrize(("kind", "path"), FILES, ids=lambda each: getattr(each, "stem", each))
def test_what_is_shipped_is_valid(validators, kind, path):
    errors = [each.message for each in validators[kind].iter_errors(content_of(kind, path))]
    assert errors == []


def test_each_kind_is_valid_as_itself_alone_and_read(validators, tmp_path):
    for kind in KINDS:
        accepted = {other for other in KINDS if validators[other].is_valid(content_of(kind))}
        assert accepted == {kind}
        assert is_read(kind, content_of(kind), tmp_path)


def changed(content, path, value):
    """The content with another value at a place, or without its key."""
    *parents, last = path
    node = content
    for part in parents:
        node = node[part]
    if value is None:
        del node[last]
    else:
        node[last] = value
    return content


@pytest.mark.parametrize(
    ("kind", "path", "value"),
    [
        ("testbed", ("colour",), "red"),
        ("testbed", ("name",), None),
        ("testbed", ("cables",), []),
        ("testbed", ("cables", 0, "drum_radius"), 25.0),  # mm
        ("testbed", ("cables", 0, "gear_ratio"), {"value": -4, "provenance": "measured"}),
        ("testbed", ("gravity",), {"value": 9.81, "provenance": "hearsay"}),
        ("testbed", ("gravity",), {"value": 9.81, "provenance": "measured", "by": "me"}),
        ("scenario", ("duration",), "long"),
        ("scenario", ("rates",), {"plant": 1000.5}),
        ("scenario", ("control",), {"mode": "flying"}),
        ("scenario", ("control",), {"motion": {"law": "pid", "dofs": ["pitch"]}}),  # no mode
        ("scenario", ("control",), {"mode": "closed_loop", "motion": {"law": "pi"}}),
        ("scenario", ("controllers",), {"helmsman": "a.py:A"}),
        ("mapping", ("channels",), {}),
        ("mapping", ("nan",), "ignore"),
        ("campaign", ("scenario",), None),
        ("campaign", ("sample",), {"count": 0, "ranges": {"seed": {"from": 1, "to": 2}}}),
        ("diagnosis", ("verdict",), "fine"),
        ("diagnosis", ("findings",), [{"effect": "bar_mass"}]),
        ("diagnosis", ("recordings", 0, "role"), "judge"),
    ],
)
def test_what_is_broken_is_refused_by_schema_and_reader(validators, tmp_path, kind, path, value):
    content = changed(content_of(kind), path, value)
    assert not validators[kind].is_valid(content)
    assert not is_read(kind, content, tmp_path)


@pytest.mark.parametrize(
    ("kind", "path", "value"),
    [
        ("testbed", ("gravity",), {"value": 9.8, "provenance": "measured", "note": "here"}),
        ("testbed", ("sensors", "/winches/state", "noise"), [0.0, 0.0, 0.001]),
        ("scenario", ("controllers",), {"motion_controller": "mine.py:Mine"}),
        ("scenario", ("controllers",), {"motion_controller": {"python": "mine.py:Mine"}}),
        ("diagnosis", ("of_a_later_version",), [1]),
    ],
)
def test_every_way_to_write_a_value_is_valid(validators, tmp_path, kind, path, value):
    content = changed(content_of(kind), path, value)
    assert validators[kind].is_valid(content)
    assert is_read(kind, content, tmp_path)


def places(node, path=()):
    """Yield the places of all values."""
    pairs = node.items() if isinstance(node, dict) else enumerate(node)
    for key, value in pairs:
        yield (*path, key)
        if isinstance(value, dict | list):
            yield from places(value, (*path, key))


JUNK = (-1.0, 0, 3, 1e9, "", "a", True, [], {}, [1.0, 2.0], {"value": 1.0, "provenance": "thesis"})


@pytest.mark.parametrize("kind", KINDS)
def test_what_the_schema_refuses_the_reader_refuses(validators, tmp_path, kind):
    """An editor must not call wrong what runs. The reader may refuse more: it compares numbers."""
    drawn = random.Random(7)
    where = list(places(content_of(kind)))
    refused = 0
    for _ in range(120):
        path, value = drawn.choice(where), drawn.choice(JUNK)
        content = changed(content_of(kind), path, value)
        if not validators[kind].is_valid(content):
            refused += 1
            assert not is_read(kind, content, tmp_path), (path, value)
    assert refused > 40


def test_the_published_schemas_are_up_to_date():
    for kind in KINDS:
        path = ROOT / "docs" / "reference" / "schemas" / f"{kind}.schema.json"
        hint = "run: python docs/scripts/schema_files.py"
        assert json.loads(path.read_text(encoding="utf-8")) == schema_of(kind), hint


def test_writer_and_reader_of_a_diagnosis_mean_the_same_version():
    assert SCHEMA == READ_SCHEMA


def test_another_kind_is_refused_with_those_that_there_are():
    with pytest.raises(InputError, match=r"^schema motor: allowed: testbed, scenario, mapping,"):
        schema_of("motor")
