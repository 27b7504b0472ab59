"""Licences as SPDX expressions, of distributions that state them in one way or another."""

from importlib.metadata import Distribution, distribution

import pytest

from cspm_msgs_py.installed.dependencies import dependencies
from cspm_msgs_py.installed.licence import licence_of

BSD = "Redistributions in\n binary form must reproduce the above copyright notice."


def installed(folder, header, **files):
    """A distribution with a header and files, whose names have / for __ and no ending."""
    info = folder / "a-1.dist-info"
    info.mkdir()
    (info / "METADATA").write_text(f"Metadata-Version: 2.4\nName: a\nVersion: 1\n{header}")
    listed = []
    for name, text in files.items():
        path = folder / name.replace("__", "/").replace("package", "package.xml")
        path = info / path.name if path.parent == folder else path
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text)
        listed.append(f"{path.relative_to(folder)},,\n")
    (info / "RECORD").write_text("".join(listed))
    return Distribution.at(info)


@pytest.mark.parametrize(
    ("header", "files", "expected"),
    [
        ("License-Expression: MIT OR ISC\nLicense: BSD", {}, "MIT OR ISC"),
        ("License: mit", {}, "MIT"),
        ("License: Apache License, Version 2.0", {}, "Apache-2.0"),
        ("License: UNKNOWN\nClassifier: License :: OSI Approved :: MIT License", {}, "MIT"),
        ("Classifier: Topic :: MIT License", {}, "NOASSERTION"),
        ("License: BSD", {"LICENSE": BSD}, "BSD-2-Clause"),
        ("License: BSD", {"LICENSE": f"{BSD} Neither the name of a"}, "BSD-3-Clause"),
        ("", {"LICENSE": "Permission is hereby granted,\nfree of charge, to any"}, "MIT"),
        ("", {"share__a__package": "<license>zlib License</license><!-- x -->"}, "Zlib"),
        (
            "",
            {"share__a__package": "<license>Apache 2.0</license><license>MIT</license>"},
            "Apache-2.0 AND MIT",
        ),
        ("License: all of it is ours", {"LICENSE": "Ask us."}, "NOASSERTION"),
        # The licence of something else, which it contains.
        ("", {"vendored__b-1.dist-info__LICENSE": BSD}, "NOASSERTION"),
        ("License: BSD", {}, "NOASSERTION"),
    ],
)
def test_a_licence_is_found_where_a_distribution_states_it(tmp_path, header, files, expected):
    assert licence_of(installed(tmp_path, header, **files)) == expected


def test_what_is_absent_asserts_nothing():
    assert licence_of(None) == "NOASSERTION"


def test_every_dependency_of_the_base_states_its_licence():
    assert licence_of(distribution("scipy")) == "BSD-3-Clause"
    unknown = [d.name for d in dependencies() if not d.extra and d.licence == "NOASSERTION"]
    assert unknown == []


def test_the_backport_of_the_metadata_gives_the_same():
    """Others import it, and from then on it answers for the standard library's module."""
    backport = pytest.importorskip("importlib_metadata")
    for name in ("scipy", "packaging", "daqp"):
        assert licence_of(backport.distribution(name)) == licence_of(distribution(name))
