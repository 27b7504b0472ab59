"""What the package says of itself: the same everywhere, and nothing that is made up."""

import re
from email import message_from_string
from pathlib import Path
from xml.etree import ElementTree

import pytest
from setuptools.build_meta import prepare_metadata_for_build_wheel

from cspm_msgs_py.yaml_file import read_yaml

ROOT = Path(__file__).resolve().parents[2]


@pytest.fixture(scope="module")
def metadata(source, tmp_path_factory):
    """The core metadata that a wheel of this source has."""
    out = tmp_path_factory.mktemp("metadata")
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(source / "src" / "cspm")
        folder = prepare_metadata_for_build_wheel(str(out))
    return message_from_string((out / folder / "METADATA").read_text(encoding="utf-8"))


@pytest.fixture(scope="module")
def citation():
    return read_yaml(ROOT / "CITATION.cff")


@pytest.fixture(scope="module")
def manifest():
    return ElementTree.parse(ROOT / "package.xml").getroot()


def licence(metadata):
    """Return the licence by the field of PEP 639, or the one before it."""
    return metadata["License-Expression"] or metadata["License"]


def test_package_manifest_and_citation_say_the_same(metadata, citation, manifest):
    assert citation["version"] == manifest.findtext("version") == metadata["Version"]
    assert citation["license"] == manifest.findtext("license") == licence(metadata) == "Apache-2.0"
    assert manifest.findtext("description") == metadata["Summary"]
    assert [author["name"] for author in citation["authors"]] == [metadata["Author"]]
    assert manifest.findtext("maintainer") == metadata["Author"]
    assert citation["keywords"] == metadata["Keywords"].split(",")


def test_a_version_that_is_not_released_has_no_date_of_release(citation):
    changelog = (ROOT / "CHANGELOG.md").read_text(encoding="utf-8")
    said = re.search(rf"^## \[{re.escape(citation['version'])}\] – (.+)$", changelog, re.M)[1]
    assert citation.get("date-released", "unreleased") == said


def test_no_address_and_no_page_is_made_up(metadata, manifest):
    """None is published: the one address that a form asks for says that it is none."""
    assert metadata.get_all("Project-URL", []) == []
    assert [metadata[field] for field in ("Home-page", "Author-email", "Maintainer-email")] == [
        None,
        None,
        None,
    ]
    assert manifest.findall("url") == []
    for person in (*manifest.findall("maintainer"), *manifest.findall("author")):
        assert person.get("email", ".invalid").endswith(".invalid")


def test_classifiers_say_what_holds(metadata):
    said = metadata.get_all("Classifier")
    assert "Typing :: Typed" in said
    for package in ROOT.glob("cspm*/__init__.py"):
        assert (package.parent / "py.typed").is_file(), package
    # Beside `License-Expression` package indexes refuse it.
    assert not [each for each in said if each.startswith("License ::")]
    assert said == sorted(set(said))


def test_no_dependency_has_an_upper_bound_without_a_reason():
    """A pin or a bound keeps users from what is newer: its line says why."""
    lines = (ROOT / "pyproject.toml").read_text(encoding="utf-8").splitlines()
    section = lines[lines.index("dependencies = [") : lines.index("[project.scripts]")]
    bounded = [line for line in section if re.search(r"<|==|~=", line.partition(";")[0])]
    assert bounded
    assert [line for line in bounded if " # " not in line] == []
