"""The page on imports says what the code does."""

import re
from pathlib import Path

from cspm_ident.importing.mapping import ChannelSource, Clock, CsvFormat, Mapping, Segment
from cspm_ident.importing.units import TIME_UNITS, unit_of
from cspm_msgs_py.yaml_file import parse_yaml, validate

PAGE = (Path(__file__).resolve().parents[3] / "docs" / "import.md").read_text(encoding="utf-8")
SOURCES = Path(__file__).resolve().parents[3] / "cspm_ident" / "importing"


def test_the_example_is_a_mapping():
    text = re.search(r"<!-- mapping: lab -->\n```yaml\n(.*?)```", PAGE, re.DOTALL)[1]
    mapping = validate(Mapping, parse_yaml(text, "import.md"), "import.md")
    assert list(mapping.clocks) == ["drive", "cell"]


def test_every_key_is_documented():
    models = (Mapping, ChannelSource, Clock, CsvFormat, Segment)
    keys = {key for model in models for key in model.model_fields}
    assert sorted(key for key in keys if f"`{key}`" not in PAGE) == []


def test_every_unit_on_the_page_is_one_and_none_is_missing():
    told = re.search(r"^Units: (.*?)\n\n", PAGE, re.DOTALL | re.MULTILINE)[1].partition(".")[0]
    words = [word.strip('"') for word in told.split() if word != "·"]
    assert all(unit_of(word, "") for word in words)
    from cspm_ident.importing import units

    assert set(words) == set(units._UNITS)
    assert all(unit in PAGE for unit in TIME_UNITS)


def test_every_kind_of_suspicion_is_explained():
    told = re.search(r"## What looks wrong(.*?)\n## ", PAGE, re.DOTALL)[1]
    code = "".join(path.read_text(encoding="utf-8") for path in SOURCES.glob("*.py"))
    kinds = set(re.findall(r'Suspicion\(\s*(?:where|topic|f"[^"]*"), "(\w+)"', code))
    kinds |= set(re.findall(r'\badd\(\s*"(\w+)",', code)) | {"held", "interpolated", "quaternion"}
    assert len(kinds) >= 18
    assert sorted(kind for kind in kinds if f"`{kind}`" not in told) == []
