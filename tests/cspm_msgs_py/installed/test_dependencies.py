"""What a package depends on, read from the metadata of distributions that are made here."""

import pytest
from packaging.requirements import Requirement

from cspm_msgs_py.installed.dependencies import dependencies, unmet

METADATA = "Metadata-Version: 2.4\nName: {name}\nVersion: {version}\n"


@pytest.fixture
def install(tmp_path, monkeypatch):
    """Return what installs a distribution of so many bytes that requires others."""
    monkeypatch.syspath_prepend(tmp_path)

    def installed(name, version, *requires, size=0):
        folder = tmp_path / f"{name}-{version}.dist-info"
        folder.mkdir()
        lines = [METADATA.format(name=name, version=version)]
        lines += [f"Requires-Dist: {each}\n" for each in requires]
        (folder / "METADATA").write_text("".join(lines))
        (tmp_path / f"{name}.py").write_bytes(bytes(size))
        (folder / "RECORD").write_text(f"{name}.py,,\n")

    return installed


@pytest.fixture
def house(install):
    """A package with a base, two extras, and what those bring in turn."""
    extras = ("paint>=2; extra == 'colour'", "brush[hair]; extra == 'tools'")
    here = ("tiles; sys_platform == 'win32'", "brick>=1.5")
    install("house", "1", *here, *extras)
    install("brick", "1.4", "clay", size=70)
    install("clay", "3", "brick", size=30)
    install("brush", "1", "wire; extra == 'iron'", "horse; extra == 'hair'", size=5)
    install("horse", "2", "clay", size=1)


def test_what_is_brought_is_listed_once_by_what_brings_it_first(house):
    found = dependencies("house", ("colour", "tools"))
    assert [(each.extra, each.name, each.version, each.size) for each in found] == [
        ("", "brick", "1.4", 70),
        ("", "clay", "3", 30),
        ("colour", "paint", None, 0),
        ("tools", "brush", "1", 5),
        ("tools", "horse", "2", 1),
    ]


def test_a_requirement_is_unmet_where_it_is_absent_or_too_old(house, install):
    assert unmet("", "house") == ["brick>=1.5"]
    assert unmet("colour", "house") == ["paint>=2"]
    assert unmet("tools", "house") == []
    assert unmet("garden", "house") == []
    install("paint", "2.0rc1")
    assert unmet("colour", "house") == ["paint>=2"]


def test_this_package_has_what_it_requires_and_names_no_distribution_twice():
    found = dependencies()
    names = [Requirement(each.name).name.lower() for each in found]
    assert len(names) == len(set(names))
    base = {each.name for each in found if not each.extra}
    assert {"numpy", "scipy", "numba", "llvmlite"} <= base
    assert not base & {"dask", "distributed", "mujoco", "pyarrow", "h5py"}
    assert unmet() == []
