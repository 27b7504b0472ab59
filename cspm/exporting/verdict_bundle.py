"""All that repeats a verdict elsewhere, in one file and without names."""

from __future__ import annotations

import json
import os
import platform
import zipfile
from collections.abc import Mapping, Sequence
from importlib.metadata import version
from pathlib import Path
from typing import Any, NamedTuple

from cspm.exporting.anonymous_recording import MACHINE, copy_without_names, without_names
from cspm_ident.diagnosis_file import IMPROVED, REPORT, DiagnosisFile, read_diagnosis
from cspm_ident.recording_hash import recording_sha256
from cspm_msgs_py.errors import InputError
from cspm_msgs_py.new_folder import ScratchFolder
from cspm_msgs_py.recording import Recording
from cspm_msgs_py.recording.attached_testbed import TESTBED, attached_testbed
from cspm_msgs_py.testbed import TestbedFile, load_testbed

_PACKAGES = ("cspm", "numpy", "scipy", "numba")


class Packed(NamedTuple):
    """What a bundle holds: new names by path, its files, and code that went along as it was."""

    names: dict[str, str]
    files: tuple[str, ...]
    code: tuple[str, ...]


def write_bundle(
    out: Path, recordings: Sequence[Path], verdict: Path, testbed: Path | None
) -> Packed:
    """Write recordings, test-bed, verdict and the command that repeats it to a new zip file.

    Args:
        out: a new file.
        recordings: all that the verdict was made of.
        verdict: the folder that `cspm diagnose --out` wrote.
        testbed: the file that the recordings were compared with; None: the one in the recording,
            or where the verdict says it is.

    Raises:
        InputError: the file exists, or recordings or test-bed are not those of the verdict.
    """
    found = read_diagnosis(verdict)
    places = _places(recordings, found)
    machine = _machine(found, places, testbed)
    names = {str(path): f"recording_{i}" for i, path in enumerate(places, 1)}
    with ScratchFolder("bundle") as place:
        code: list[str] = []
        for path, name in names.items():
            code += copy_without_names(Path(path), place / name, machine.testbed.topics)
        text = without_names(machine.text, machine.source, MACHINE)
        (place / TESTBED).write_text(text, encoding="utf-8")
        said = [each.path for each in found.recordings]
        _write_verdict(place, verdict, dict(zip(said, names.values(), strict=True)))
        (place / "README.txt").write_text(_read_me(found, list(names.values())), encoding="utf-8")
        files = sorted(each for each in place.rglob("*") if each.is_file())
        _zip(out, place, files)
    return Packed(names, tuple(each.relative_to(place).as_posix() for each in files), tuple(code))


def _places(recordings: Sequence[Path], found: DiagnosisFile) -> list[Path]:
    """Return where each recording of a verdict is, in its order."""
    known = {recording_sha256(path): path for path in recordings}
    used = {each.sha256: each.path for each in found.recordings}
    for digest, path in known.items():
        if digest not in used:
            raise InputError(f"{path}: not of the verdict, allowed: {', '.join(used.values())}")
    for digest, named in used.items():
        if digest not in known:
            raise InputError(f"{named}: of the verdict and missing, allowed: all its recordings")
    return [known[each.sha256] for each in found.recordings]


def _machine(found: DiagnosisFile, places: Sequence[Path], given: Path | None) -> TestbedFile:
    """Return the test-bed that a verdict compared with."""
    wanted = found.testbed
    if given is None:
        with Recording(places[0]) as reader:
            own = reader.attachments
        if TESTBED in own and (file := attached_testbed(own, places[0])).sha256 == wanted.sha256:
            return file
        given = Path(wanted.path)
    file = load_testbed(given)
    if file.sha256 != wanted.sha256:
        raise InputError(
            f"{given}: not the test-bed of the verdict, allowed: --testbed with that file, SHA-256"
            f" {wanted.sha256}"
        )
    return file


def _write_verdict(place: Path, verdict: Path, names: Mapping[str, str]) -> None:
    """Write the verdict with the recordings' new names, and the improved test-bed."""
    folder = verdict if verdict.is_dir() else verdict.parent
    data = json.loads((folder / REPORT).read_text(encoding="utf-8"))
    for entry in data["recordings"]:
        entry["sha256"] = recording_sha256(place / names[entry["path"]])
    data["testbed"]["path"] = TESTBED
    data["testbed"]["sha256"] = load_testbed(place / TESTBED).sha256
    text = json.dumps(_renamed(data, names), ensure_ascii=False, indent=1)
    (place / REPORT).write_text(text, encoding="utf-8")
    improved = folder / IMPROVED
    if improved.is_file():
        text = without_names(improved.read_text(encoding="utf-8"), str(improved), MACHINE)
        (place / IMPROVED).write_text(text, encoding="utf-8")


def _renamed(node: Any, names: Mapping[str, str]) -> Any:  # noqa: ANN401 - any JSON
    """Return JSON with new names for paths; a path within a text is known by its separators."""
    if isinstance(node, dict):
        return {
            key: names[value]
            if key in ("path", "recording") and value in names
            else _renamed(value, names)
            for key, value in node.items()
        }
    if isinstance(node, list):
        return [_renamed(each, names) for each in node]
    if isinstance(node, str):
        for path, name in names.items():
            node = node.replace(path, name) if os.sep in path else node
    return node


def _read_me(found: DiagnosisFile, names: Sequence[str]) -> str:
    """Return what a colleague reads first."""
    roles = [each.role for each in found.recordings]
    words = [name for name, role in zip(names, roles, strict=True) if role == "search"]
    for name, role in zip(names, roles, strict=True):
        words += ["--held-out", name] if role == "held_out" else []
    versions = ", ".join(f"{name} {version(name)}" for name in _PACKAGES)
    return f"""\
The verdict in {REPORT} is `{found.verdict}`. To repeat it:

    cspm diagnose {" ".join(words)} --testbed {TESTBED} --out repeated

Made with Python {platform.python_version()}, {versions}.
Names of machine, scenario, files and people, comments and notes are left out; numbers are bit for
bit those of the recordings.
"""


def _zip(out: Path, place: Path, files: Sequence[Path]) -> None:
    try:
        with zipfile.ZipFile(out, "x", zipfile.ZIP_DEFLATED) as archive:
            for file in files:
                # Without times, so that a bundle made twice has the same bytes.
                info = zipfile.ZipInfo(f"{out.stem}/{file.relative_to(place).as_posix()}")
                info.compress_type = zipfile.ZIP_DEFLATED
                archive.writestr(info, file.read_bytes())
    except FileExistsError:
        raise InputError(f"--out {out}: already exists, allowed: a new file") from None
    except OSError as err:
        raise InputError(f"--out {out}: cannot be written ({err.strerror})") from None
