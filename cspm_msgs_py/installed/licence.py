"""The licence of an installed distribution, as an SPDX expression."""

from __future__ import annotations

import re
from importlib.metadata import Distribution

UNKNOWN = "NOASSERTION"
# Identifiers, and what distributions write instead: in the field before PEP 639, in manifests of
# ROS packages and in classifiers.
_MEANT = {
    **{
        each.lower(): each
        for each in (
            *("Apache-2.0", "MIT", "MIT-0", "MIT-CMU", "ISC", "BSD-2-Clause", "BSD-3-Clause"),
            *("PSF-2.0", "MPL-2.0", "Zlib", "any-OSI"),
        )
    },
    "apache 2.0": "Apache-2.0",
    "apache license 2.0": "Apache-2.0",
    "apache license, version 2.0": "Apache-2.0",
    "apache software license": "Apache-2.0",
    "isc license": "ISC",
    "isc license (iscl)": "ISC",
    "mit license": "MIT",
    "python software foundation license": "PSF-2.0",
    "zlib license": "Zlib",
}
_MANIFEST_LICENCE = re.compile(r"<license[^>]*>([^<]+)</license>")
_FILE = re.compile(r"LICEN[CS]E")


def licence_of(installed: Distribution | None) -> str:
    """Return the licence of a distribution; `NOASSERTION` where it states none that is known.

    Looked for in this order: the expression of PEP 639, the older field, the manifest of a ROS
    package, the classifiers, the text.
    """
    if installed is None:
        return UNKNOWN
    if expression := _field(installed, "License-Expression"):
        return expression
    field = _field(installed, "License")
    classifiers = installed.metadata.get_all("Classifier") or ()
    for said in (
        [field],
        [one for each in _manifests(installed) for one in _MANIFEST_LICENCE.findall(each)],
        [each.split(" :: ")[-1] for each in classifiers if each.startswith("License ::")],
    ):
        known = {_MEANT[each.strip().lower()] for each in said if each.strip().lower() in _MEANT}
        if known:
            return " AND ".join(sorted(known))
    return _by_text([field, *_texts(installed)])


def _field(installed: Distribution, name: str) -> str:
    """Return a field of a distribution's metadata; empty where it has none."""
    metadata = installed.metadata
    # The backport of `importlib.metadata` raises where the field is absent.
    return metadata[name] or "" if name in metadata else ""


def _manifests(installed: Distribution) -> list[str]:
    """Return the manifests that a wheel of a ROS package puts into `share`."""
    files = (each for each in installed.files or () if each.name == "package.xml")
    return [each.read_text(encoding="utf-8") for each in files if "share" in each.parts]


def _texts(installed: Distribution) -> list[str]:
    """Return the distribution's own files of that name, not those of what it contains."""
    own = [each for each in installed.files or () if each.parts[0].endswith(".dist-info")]
    return [each.read_text(encoding="utf-8") for each in own if _FILE.match(each.name)]


def _by_text(texts: list[str]) -> str:
    """Recognise the licences that most distributions have, by a phrase of each."""
    for text in texts:
        joined = " ".join(text.split())
        if "Redistributions in binary form" in joined:
            # The clause that one of the two has, and the other lacks.
            named = re.search(r"Neither the names? ", joined)
            return "BSD-3-Clause" if named else "BSD-2-Clause"
        if "Permission is hereby granted, free of charge" in joined:
            return "MIT"
        if "Apache License Version 2.0" in joined:
            return "Apache-2.0"
    return UNKNOWN
