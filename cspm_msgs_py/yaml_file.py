"""Strict reading of YAML files into frozen models; every fault becomes one line."""

from __future__ import annotations

import io
from collections.abc import Iterable
from pathlib import Path
from typing import Any, TypeVar

from pydantic import BaseModel, ConfigDict, ValidationError
from ruamel.yaml import YAML
from ruamel.yaml.error import MarkedYAMLError, YAMLError

from cspm_msgs_py.errors import InputError


class StrictModel(BaseModel):
    """Base of all file models: frozen, unknown keys refused, only finite numbers."""

    model_config = ConfigDict(frozen=True, extra="forbid", strict=False, allow_inf_nan=False)


Model = TypeVar("Model", bound=BaseModel)


def read_yaml(path: Path) -> Any:  # noqa: ANN401 - whatever the file holds
    """Return the content of a YAML 1.2 file.

    Raises:
        InputError: the file is missing, unreadable, not YAML, or repeats a key.
    """
    try:
        text = path.read_text(encoding="utf-8")
    except FileNotFoundError:
        raise InputError(f"{path}: no such file") from None
    except (OSError, UnicodeDecodeError) as err:
        raise InputError(f"{path}: not a readable text file ({err})") from None
    return parse_yaml(text, str(path))


def parse_yaml(text: str, source: str) -> Any:  # noqa: ANN401 - whatever the text holds
    """Return the content of YAML 1.2 `text`; `source` names it in errors.

    Raises:
        InputError: the text is not YAML or repeats a key.
    """
    try:
        return YAML(typ="safe", pure=True).load(text)
    except MarkedYAMLError as err:
        line = err.problem_mark.line + 1 if err.problem_mark else 0
        problem = " ".join(str(err.problem).split())
        raise InputError(f"{source}: line {line}: {problem}") from None
    except YAMLError as err:
        raise InputError(f"{source}: not YAML ({' '.join(str(err).split())})") from None


def dump_yaml(content: Any) -> str:  # noqa: ANN401 - any plain data
    """Return plain data as YAML text in block style, keys in the given order."""
    yaml = YAML(typ="safe", pure=True)
    yaml.default_flow_style = None
    yaml.sort_base_mapping_type_on_output = False  # type: ignore[assignment]
    yaml.width = 100
    stream = io.StringIO()
    yaml.dump(content, stream)
    return stream.getvalue()


def validate(model: type[Model], content: object, source: str) -> Model:
    """Return `content` as `model`.

    Raises:
        InputError: naming source, key, value and what is allowed, for the first fault found.
    """
    if not isinstance(content, dict):
        kind = "an empty file" if content is None else type(content).__name__
        raise InputError(f"{source}: {kind}, allowed: a mapping of keys to values")
    try:
        return model.model_validate(content)
    except ValidationError as err:
        raise InputError(f"{source}: {_one_line(err)}") from None


def _one_line(err: ValidationError) -> str:
    faults = err.errors(include_url=False)
    # A misspelt key shows as one unknown and one missing: the unknown one is what was typed.
    fault = min(faults, key=lambda f: f["type"] != "extra_forbidden")
    key = key_path(fault["loc"])
    more = f" (and {len(faults) - 1} more faults)" if len(faults) > 1 else ""
    if fault["type"] == "extra_forbidden":
        return f"{key}: unknown key, allowed: {_siblings(err, fault['loc'])}{more}"
    if fault["type"] == "missing":
        return f"{key}: missing, a value is required{more}"
    text = fault["msg"].removeprefix("Value error, ")
    if fault["type"] == "value_error":
        return f"{key}: {text}{more}" if key else f"{text}{more}"
    return f"{key}: {_shorten(fault['input'])}, allowed: {_allowed(text)}{more}"


def key_path(loc: Iterable[int | str]) -> str:
    """Return a fault's place as `cables[2].drum_radius`."""
    path = ""
    for part in loc:
        path += f"[{part}]" if isinstance(part, int) else f".{part}" if path else part
    return path


def _allowed(text: str) -> str:
    text = text.removeprefix("Input should be ").removeprefix("a valid ")
    return text[0].lower() + text[1:]


def _shorten(value: object, limit: int = 60) -> str:
    text = repr(value)
    return text if len(text) <= limit else text[: limit - 1] + "…"


def _siblings(err: ValidationError, loc: tuple[int | str, ...]) -> str:
    """List the keys that the model at `loc`'s parent knows, found through the error's schema."""
    fields = _fields_at(err.title, loc[:-1])
    return ", ".join(fields) if fields else "the keys in the documentation"


def _fields_at(title: str, loc: tuple[int | str, ...]) -> list[str]:
    model = next((m for m in _all_models(StrictModel) if m.__name__ == title), None)
    for part in loc:
        if model is None:
            return []
        if isinstance(part, int):
            continue
        tagged = [m for m in _all_models(StrictModel) if _tag_of(m) == part]
        if part in model.model_fields:
            model = _model_of(model.model_fields[part].annotation)
        elif tagged:
            model = tagged[0]
    return list(model.model_fields) if model else []


def _tag_of(model: type[BaseModel]) -> object:
    field = model.model_fields.get("type") or model.model_fields.get("law")
    return field.default if field else None


def _model_of(annotation: Any) -> type[BaseModel] | None:  # noqa: ANN401 - any type form
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        return annotation
    for inner in getattr(annotation, "__args__", ()):
        found = _model_of(inner)
        if found:
            return found
    return None


def _all_models(base: type[BaseModel]) -> list[type[BaseModel]]:
    return [m for sub in base.__subclasses__() for m in (sub, *_all_models(sub))]
