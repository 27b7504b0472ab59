"""Strict reading of YAML files into frozen models; every fault becomes one line."""

from __future__ import annotations

import io
import json
from copy import deepcopy
from functools import lru_cache
from pathlib import Path
from typing import Any, TypeVar

from pydantic import BaseModel, ConfigDict, ValidationError
from ruamel.yaml import YAML
from ruamel.yaml.constructor import DuplicateKeyError
from ruamel.yaml.error import MarkedYAMLError, YAMLError
from ruamel.yaml.nodes import CollectionNode, Node

from cspm_msgs_py.errors import InputError
from cspm_msgs_py.model_fault import fault_line

DEEPEST = 50
WIDEST = 10_000
# Far above what describes a machine or a run, and read in seconds.
LARGEST, MOST_VALUES = 1_000_000, 200_000
# Texts whose content is kept for the next time that they are read.
_TEXTS = 32
SIZE_ALLOWED = f"allowed: at most {LARGEST}"
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
        if path.exists() and not path.is_file():
            raise InputError(f"{path}: unreadable (no regular file), allowed: a YAML file")
        if path.stat().st_size > LARGEST:
            raise InputError(f"{path}: {path.stat().st_size} bytes, {SIZE_ALLOWED}")
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
        content = deepcopy(_load(text, source))
    except MarkedYAMLError as err:
        raise InputError(f"{source}: {_yaml_fault(err)}") from None
    except (YAMLError, ValueError) as err:
        raise InputError(f"{source}: not YAML ({' '.join(str(err).split())})") from None
    except RecursionError:
        raise InputError(f"{source}: nested without end, {DEPTH_ALLOWED}") from None
    _check_shape(content, source)
    return content


# A machine's text is read several times in a run, and takes a fifth of a second each time.
@lru_cache(maxsize=_TEXTS)
def _load(text: str, source: str) -> Any:  # noqa: ANN401 - whatever the text holds
    """Return what `YAML.load` does, once its aliases are known to stand for little."""
    if len(text) > LARGEST:
        raise InputError(f"{source}: {len(text)} characters, {SIZE_ALLOWED}")
    constructor, parser = YAML(typ="safe", pure=True).get_constructor_parser(io.StringIO(text))
    try:
        node = constructor.composer.get_single_node()
        if node is None:
            return None
        written = _written_out(node, source, {})
        if written > MOST_VALUES:
            raise InputError(
                f"{source}: {written:.3g} values with its aliases written out, allowed: at most"
                f" {MOST_VALUES}"
            )
        return constructor.construct_document(node)
    finally:
        parser.dispose()


def _written_out(node: Node, source: str, known: dict[int, int]) -> int:
    """Return how many values a node has written out; `known`: those of nodes seen before, by id.

    A node that is part of itself has no end.
    """
    if id(node) in known:
        if not known[id(node)]:
            raise InputError(f"{source}: nested without end, {DEPTH_ALLOWED}")
        return known[id(node)]
    known[id(node)] = 0
    count, inner = 1, node.value if isinstance(node, CollectionNode) else ()
    for each in inner:
        parts = each if isinstance(each, tuple) else (each,)
        count += sum(_written_out(part, source, known) for part in parts)
    known[id(node)] = count
    return count


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
