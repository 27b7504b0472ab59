"""What the runs of a campaign read, packed to travel: scenarios, test-beds and their files."""

from __future__ import annotations

import hashlib
import io
import json
import zipfile
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Any

from cspm.campaign.campaign_file import file_in
from cspm.campaign.variants import Variant
from cspm_msgs_py.motion_spec import FileMotion, VesselMotion
from cspm_msgs_py.new_folder import ScratchFolder
from cspm_msgs_py.recording.attached_testbed import TESTBED
from cspm_msgs_py.scenario import load_scenario
from cspm_msgs_py.testbed import load_testbed
from cspm_msgs_py.yaml_file import dump_yaml, read_yaml
from cspm_run.bundle import SCENARIO, Bundle, make_bundle

# Zip files carry dates; a fixed one makes equal contents equal bytes.
_DATE = (1980, 1, 1, 0, 0, 0)
# Unpacked campaigns that a worker keeps.
_KEPT = 4


@dataclass(frozen=True)
class Inputs:
    """Scenarios and test-beds by their places in a packed folder.

    Attributes:
        packed: a zip file's bytes.
        places: where each file of the user's is in it.
    """

    packed: bytes
    places: dict[str, str]

    @property
    def sha256(self) -> str:
        """SHA-256 of what is packed, hexadecimal."""
        return hashlib.sha256(self.packed).hexdigest()


def pack(variants: Iterable[Variant], metrics: Iterable[str] = ()) -> Inputs:
    """Return everything that variants and metrics read.

    Raises:
        InputError: a file cannot be read or has a fault.
    """
    stream = io.BytesIO()
    places: dict[str, str] = {}
    with zipfile.ZipFile(stream, "w", zipfile.ZIP_DEFLATED) as archive:
        for variant in variants:
            if variant.scenario not in places:
                place = f"scenario_{len(places)}"
                places[variant.scenario] = f"{place}/{SCENARIO}"
                for name, content in _scenario_files(Path(variant.scenario)).items():
                    _put(archive, f"{place}/{name}", content)
            if variant.testbed is not None and variant.testbed not in places:
                places[variant.testbed] = f"testbed_{len(places)}/{Path(variant.testbed).name}"
                text = load_testbed(Path(variant.testbed)).text
                _put(archive, places[variant.testbed], text.encode())
            for named in _named(variant):
                _put_once(archive, places, named)
        for metric in metrics:
            if file_in(metric):
                _put_once(archive, places, file_in(metric))
    return Inputs(stream.getvalue(), places)


@lru_cache(maxsize=_KEPT)
def unpacked(packed: bytes) -> ScratchFolder:
    """Return the folder of what was packed, which lives as long as this process keeps it."""
    folder = ScratchFolder("campaign")
    with zipfile.ZipFile(io.BytesIO(packed)) as archive:
        archive.extractall(folder.path)
    return folder


def _named(variant: Variant) -> Iterator[str]:
    """Return the files that a variant's values name, as `campaign_file` made them absolute."""
    for override in variant.overrides:
        yield from _files_in(json.loads(override.partition("=")[2]))


def _files_in(value: Any) -> Iterator[str]:  # noqa: ANN401 - any plain data
    inner = value.values() if isinstance(value, dict) else value if isinstance(value, list) else ()
    for each in inner:
        yield from _files_in(each)
    named = file_in(value)
    if named and Path(named).is_absolute() and Path(named).is_file():
        yield named


def _put_once(archive: zipfile.ZipFile, places: dict[str, str], path: str) -> None:
    if path not in places:
        places[path] = f"file_{len(places)}/{Path(path).name}"
        _put(archive, places[path], Path(path).read_bytes())


def _put(archive: zipfile.ZipFile, name: str, content: bytes) -> None:
    entry = zipfile.ZipInfo(name, date_time=_DATE)
    entry.compress_type = zipfile.ZIP_DEFLATED
    archive.writestr(entry, content)


def _scenario_files(path: Path) -> dict[str, bytes]:
    """Return a scenario file that reads only what is beside it, and what is beside it."""
    scenario = load_scenario(path)
    machine = load_testbed(path.parent / scenario.testbed)
    bundle = make_bundle(scenario, machine, path.parent)
    text = dump_yaml(_moved(read_yaml(path), bundle))
    return {SCENARIO: text.encode(), TESTBED: machine.text.encode(), **bundle.files}


def _moved(content: dict[str, Any], bundle: Bundle) -> dict[str, Any]:
    """Return a scenario's content with the names that its files have in the bundle.

    All else stays as it was written, so that the same overrides have the same meaning.
    """
    scenario = bundle.scenario
    content[TESTBED.removesuffix(".yaml")] = TESTBED
    for role, body in (("winch_frame", scenario.winch_frame), ("target", scenario.target)):
        if isinstance(body.motion, FileMotion):
            content[role]["motion"]["path"] = body.motion.path
        elif isinstance(body.motion, VesselMotion):
            content[role]["motion"]["rao"] = body.motion.rao
    if scenario.controllers:
        content["controllers"] = {
            stage: each.model_dump(mode="json") for stage, each in scenario.controllers.items()
        }
    return content
