"""The command `cspm schema`."""

import json

from cspm.schemas.file_schema import schema_of


def test_it_prints_a_schema_or_writes_it(cspm, tmp_path):
    code, out, err = cspm("schema", "mapping")
    assert (code, err) == (0, "")
    assert json.loads(out) == schema_of("mapping")
    assert cspm("schema", "mapping", "--json", "-")[1] == out
    code, out, _ = cspm("schema", "mapping", "--json", "mapping.schema.json")
    assert (code, out) == (0, "written mapping.schema.json\n")
    assert json.loads((tmp_path / "mapping.schema.json").read_text()) == schema_of("mapping")


def test_an_unknown_kind_is_one_line(refused):
    assert "allowed: testbed, scenario, mapping, campaign, diagnosis" in refused("schema", "motor")
