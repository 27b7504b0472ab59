"""The page on imports says what the code does."""

import re
from pathlib import Path

import pytest
from import_samples import imported

from cspm_checks.catalogue import CHECKS, check_table
from cspm_checks.suspicion import Suspicion
from cspm_ident.importing.mapping import (
    BesideFile,
    ChannelSource,
    Clock,
    CsvFormat,
    Mapping,
    Segment,
)
from cspm_ident.importing.units import TIME_UNITS, unit_of
from cspm_msgs_py.yaml_file import parse_yaml, validate

DOCS = Path(__file__).resolve().parents[3] / "docs" / "reference"
PAGE = (DOCS / "import-mapping.md").read_text(encoding="utf-8")
ROOT = Path(__file__).resolve().parents[3]
SOURCES = (ROOT / "cspm_checks", ROOT / "cspm_ident" / "importing")


def test_the_example_is_a_mapping():
    text = re.search(r"<!-- mapping: lab -->\n```yaml\n(.*?)```", PAGE, re.DOTALL)[1]
    mapping = validate(Mapping, parse_yaml(text, "import-mapping.md"), "import-mapping.md")
    assert list(mapping.clocks) == ["drive", "cell"]


EXAMPLES = {
    name: (page, text)
    for page in ("tables", "files", "bags")
    for name, text in re.findall(
        r"<!-- mapping: (\w+) -->\n```yaml\n(.*?)```",
        (DOCS / f"import-{page}.md").read_text(encoding="utf-8"),
        re.DOTALL,
    )
}


FILES = re.findall(
    r"<!-- file: (\S+) -->\n```\n(.*?)```",
    (DOCS / "import-tables.md").read_text(encoding="utf-8"),
    re.DOTALL,
)


@pytest.mark.parametrize("name", sorted(EXAMPLES))
def test_every_example_is_a_mapping_and_its_table_is_read(tmp_path, name):
    page, text = EXAMPLES[name]
    validate(Mapping, parse_yaml(text, page), page)
    whole = (DOCS / f"import-{page}.md").read_text(encoding="utf-8")
    table = re.search(rf"<!-- table: {name} -->\n```\n(.*?)```", whole, re.DOTALL)
    assert (table is None) == (page != "tables")
    if table is not None:
        (tmp_path / "a.csv").write_text(table[1], encoding="utf-8")
        for other, content in FILES:
            (tmp_path / other).write_text(content, encoding="utf-8")
        found = imported(tmp_path / "a.csv", text)
        assert len(found.stamps["/winches/state"]) == 2
        assert found.rows["/winches/state"][-1, 0] in (0.0998, 1001.5, 0.1, 0.01)


def test_every_key_is_documented():
    models = (Mapping, ChannelSource, Clock, CsvFormat, Segment, BesideFile)
    keys = {key for model in models for key in model.model_fields}
    assert sorted(key for key in keys if f"`{key}`" not in PAGE) == []


def test_every_unit_on_the_page_is_one_and_none_is_missing():
    table = re.search(r"<!-- units -->\n(?:.*\n){2}((?:\|.*\n)+)", PAGE)[1]
    rows = re.findall(r"^\| [a-z ]+ \| (.*) \|$", table, re.MULTILINE)
    words = [word.strip('"') for row in rows for word in row.split()]
    assert all(unit_of(word, "") for word in words)
    from cspm_ident.importing import units

    assert set(words) == set(units._UNITS)
    assert all(unit in PAGE for unit in TIME_UNITS)


def test_the_table_of_checks_is_that_of_the_code():
    assert f"<!-- checks -->\n{check_table()}\n" in PAGE
    code = "".join(
        path.read_text(encoding="utf-8") for each in SOURCES for path in each.rglob("*.py")
    )
    # Once in the catalogue, and once where it is reported.
    assert [kind for kind in CHECKS if code.count(f'"{kind}"') < 2] == []
    with pytest.raises(KeyError):
        Suspicion("/winches/state", "unheard", "of")
