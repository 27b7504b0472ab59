"""Strict reading of YAML files into frozen models; every fault becomes one line."""

from __future__ import annotations

import io
import json
from pathlib import Path
from typing import Any, TypeVar

from pydantic import BaseModel, ConfigDict, ValidationError
from ruamel.yaml import YAML
from ruamel.yaml.constructor import DuplicateKeyError
from ruamel.yaml.error import MarkedYAMLError, YAMLError

from cspm_msgs_py.errors import InputError
from cspm_msgs_py.model_fault import fault_line

DEEPEST = 50
WIDEST = 10_000
DEPTH_ALLOWED = f"allowed: at most {DEEPEST} levels"
KINDS = {type(None): "an empty file", list: "a list", str: "a text", int: "a number"}


class StrictModel(BaseModel):
    """Base of all file models: frozen, unknown keys refused, only finite numbers."""

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)


Model = TypeVar("Model", bound=BaseModel)


def read_yaml(path: Path) -> Any:  # noqa: ANN401 - whatever the file holds
    """Return the content of a YAML 1.2 file.

    Raises:
        InputError: the file is missing, unreadable, not YAML, or repeats a key.
    """
    return parse_yaml(read_text(path), str(path))


def read_text(path: Path) -> str:
    """Return a text file's content.

    Raises:
        InputError: the file is missing or unreadable.
    """
    try:
        return path.read_text(encoding="utf-8")
    except FileNotFoundError:
        raise InputError(f"{path}: no such file, allowed: a YAML file") from None
    except (OSError, UnicodeDecodeError) as err:
        raise InputError(f"{path}: unreadable ({err}), allowed: a YAML file") from None


def parse_yaml(text: str, source: str) -> Any:  # noqa: ANN401 - whatever the text holds
    """Return the content of YAML 1.2 `text`; `source` names it in errors.

    Raises:
        InputError: the text is not YAML or repeats a key.
    """
    try:
        content = YAML(typ="safe", pure=True).load(text)
    except MarkedYAMLError as err:
        raise InputError(f"{source}: {_yaml_fault(err)}") from None
    except (YAMLError, ValueError) as err:
        raise InputError(f"{source}: not YAML ({' '.join(str(err).split())})") from None
    except RecursionError:
        raise InputError(f"{source}: nested without end, {DEPTH_ALLOWED}") from None
    _check_shape(content, source)
    return content


def _yaml_fault(err: MarkedYAMLError) -> str:
    line = err.problem_mark.line + 1 if err.problem_mark else 0
    problem = " ".join(str(err.problem).split())
    if isinstance(err, DuplicateKeyError):
        found = problem.removeprefix("found ").split(" with value ")[0]
        return f"line {line}: {found}, allowed: each key once"
    if problem.startswith("but "):
        problem = f"{' '.join(str(err.context).split())}, {problem}"
    return f"line {line}: not YAML: {problem}"


def dump_yaml(content: Any) -> str:  # noqa: ANN401 - any plain data
    """Return plain data as YAML text in block style, keys in the given order."""
    yaml = YAML(typ="safe", pure=True)
    yaml.default_flow_style = False
    yaml.sort_base_mapping_type_on_output = False  # type: ignore[assignment]
    yaml.width = 100
    stream = io.StringIO()
    yaml.dump(content, stream)
    return stream.getvalue()


def round_trip() -> YAML:
    """Return what reads and writes a file so that comments, anchors and quotes stay."""
    yaml = YAML()
    yaml.preserve_quotes = True
    yaml.width = WIDEST
    yaml.indent(mapping=2, sequence=4, offset=2)
    return yaml


def validate(model: type[Model], content: object, source: str) -> Model:
    """Return `content` as `model`.

    Raises:
        InputError: naming source, key, value and what is allowed, for the first fault found.
    """
    if not isinstance(content, dict):
        kind = KINDS.get(type(content), type(content).__name__)
        raise InputError(f"{source}: {kind}, allowed: a mapping of keys to values")
    # YAML and JSON hold the same data, and pydantic's JSON mode alone takes lists for tuples while
    # refusing text and truth values where a number belongs.
    text = json.dumps(content, default=str)
    try:
        return model.model_validate_json(text, strict=True)
    except ValidationError as err:
        raise InputError(f"{source}: {fault_line(err, model)}") from None


def _check_shape(node: object, source: str, depth: int = 0) -> None:
    """Refuse what no model holds: an anchor inside itself, bottomless nesting, lists as keys."""
    if depth > DEEPEST:
        raise InputError(f"{source}: nested without end, {DEPTH_ALLOWED}")
    if isinstance(node, dict):
        for key, inner in node.items():
            if isinstance(key, tuple):
                raise InputError(f"{source}: {list(key)} as a key, allowed: text")
            _check_shape(inner, source, depth + 1)
    elif isinstance(node, list):
        for inner in node:
            _check_shape(inner, source, depth + 1)
