"""The command `cspm migrate`."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from cspm.schemas.file_schema import kind_of, model_of
from cspm_msgs_py.errors import InputError
from cspm_msgs_py.provenance import unwrap_provenance
from cspm_msgs_py.recording import Recording
from cspm_msgs_py.recording.run_record import RECORD_NAME
from cspm_msgs_py.yaml_file import parse_yaml, read_yaml, validate
from cspm_run.output.console import make_console, say
from cspm_run.output.json_file import write_json

_DESCRIBED = (".yaml", ".yml", ".json")


def migrate_command(file: Path, json: Path | None) -> None:
    """Say of a file of an older version what it is, and whether today's readers take it.

    No released version took a key or a meaning away, so that there is nothing to rewrite yet: a
    file that is refused has a key that no version had.

    Args:
        file: of any kind that has a schema, or a recording.
        json: file for what was found as data; None writes none.

    Raises:
        InputError: no such file, no known kind, or a key with a fault.
    """
    if not file.exists():
        raise InputError(f"{file}: no such file or folder")
    if file.suffix in _DESCRIBED:
        kinds, version = {str(file): _checked(read_yaml(file), str(file))}, None
    else:
        kinds, version = _carried(file)
    console = make_console()
    for name, kind in kinds.items():
        say(console, f"{name}: a {kind} file, valid as it is: nothing to change")
    if version is not None:
        say(console, f"written by version {version}")
    if json is not None:
        write_json(json, {"files": kinds, "version": version, "changes": []})


def _carried(recording: Path) -> tuple[dict[str, str], str | None]:
    """Return the kind of each described file that a recording carries, and who wrote it."""
    with Recording(recording) as reader:
        texts = {
            name: text.decode(errors="replace")
            for name, text in reader.attachments.items()
            if Path(name).stem in ("scenario", "testbed", "mapping")
        }
        version = reader.metadata.get(RECORD_NAME, {}).get("package_version")
    names = {f"{recording}: {name}": text for name, text in texts.items()}
    return {name: _checked(parse_yaml(text, name), name) for name, text in names.items()}, version


def _checked(content: Any, name: str) -> str:  # noqa: ANN401 - any YAML
    """Return the kind of a file's content, checked by the model of its reader."""
    if not isinstance(content, dict):
        raise InputError(f"{name}: no keys, allowed: a mapping of keys to values")
    kind = kind_of(content)
    if kind is None:
        raise InputError(f"{name}: of no known kind, allowed: see `cspm schema`")
    plain = unwrap_provenance(content, name).content
    validate(model_of(kind), plain, name)
    return kind
