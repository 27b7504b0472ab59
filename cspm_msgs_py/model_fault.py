"""Faults that pydantic finds in a file's content, each as one line: key, value, what is allowed."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Literal, NamedTuple, get_args, get_origin

from pydantic import BaseModel, ValidationError
from pydantic_core import ErrorDetails

from cspm_msgs_py.testbed_keys.near_name import allowed_names

Place = tuple[int | str, ...]
# Tags of values that may be written as a number or as a mapping.
NUMBER, MAPPING = "(number)", "(mapping)"

# What the file's author may write instead, by pydantic's fault type, in place of its own words.
ALLOWED = {
    "float_type": "a number",
    "float_parsing": "a number",
    "int_type": "a whole number without decimal point",
    "int_from_float": "a whole number without decimal point",
    "int_parsing": "a whole number without decimal point",
    "bool_type": "true or false",
    "string_type": "text",
    "tuple_type": "a list",
    "list_type": "a list",
    "dict_type": "a mapping of keys to values",
    "model_type": "a mapping of keys to values",
    "model_attributes_type": "a mapping of keys to values",
    "string_pattern_mismatch": "text that matches {pattern}",
    "too_short": "a list of at least {min_length}",
    "too_long": "a list of at most {max_length}",
}


class _Spot(NamedTuple):
    """A place in a file: its key path, and the types that may stand there."""

    path: str
    options: tuple[Any, ...]


def fault_line(err: ValidationError, model: type[BaseModel]) -> str:
    """Return the first fault in one line, with the number of the others."""
    faults = _independent(err.errors(include_url=False))
    # A misspelt key shows as one unknown and one missing: the unknown one is what was typed.
    fault = min(faults, key=lambda f: f["type"] != "extra_forbidden")
    others = len(faults) - 1
    more = f" (and {others} more fault{'s' if others > 1 else ''})" if others else ""
    return _text(fault, model) + more


def _independent(faults: list[ErrorDetails]) -> list[ErrorDetails]:
    """Leave out the faults of a list that are faults of its items, counted again as missing."""
    places = [fault["loc"] for fault in faults]

    def repeats(fault: ErrorDetails) -> bool:
        loc, depth = fault["loc"], len(fault["loc"])
        return fault["type"] == "too_short" and any(
            len(place) > depth and place[:depth] == loc for place in places
        )

    return [fault for fault in faults if not repeats(fault)]


def _text(fault: ErrorDetails, model: type[BaseModel]) -> str:
    kind, context = fault["type"], fault.get("ctx", {})
    if kind == "extra_forbidden":
        *parents, last = fault["loc"]
        parent = _spot(model, tuple(parents))
        return f"{_join(parent.path, last)}: unknown key, {allowed_names(str(last), _keys(parent))}"
    spot = _spot(model, fault["loc"])
    if kind == "missing":
        return f"{spot.path}: missing, a value is required"
    if kind in ("union_tag_invalid", "union_tag_not_found"):
        return _tag_text(spot, context)
    text = fault["msg"].removeprefix("Value error, ")
    if kind == "value_error":
        return _value_error(spot, text)
    if kind in ALLOWED:
        allowed = ALLOWED[kind].format_map(context)
    else:
        allowed = text.removeprefix("Input should be ")
    return f"{spot.path}: {_shorten(fault['input'])}, allowed: {allowed}"


def _tag_text(spot: _Spot, context: Mapping[str, Any]) -> str:
    key = str(context["discriminator"]).strip("'").removesuffix("()")
    tags = [f"'{tag}'" for model in _models(spot) for tag in _literals(model, key)]
    given = f"'{context['tag']}'" if "tag" in context else "missing"
    return f"{_join(spot.path, key)}: {given}, allowed: {', '.join(tags[:-1])} or {tags[-1]}"


def _value_error(spot: _Spot, text: str) -> str:
    if not spot.path:
        return text
    first = text.partition(":")[0]
    # A model's own check names the key at fault: one key path, not two.
    inner = any(first == key for model in _models(spot) for key in model.model_fields)
    return f"{spot.path}.{text}" if inner else f"{spot.path}: {text}"


def _spot(model: type[BaseModel], loc: Place) -> _Spot:
    """Follow a fault's place through the model's types; the tags of unions leave no trace."""
    spot = _Spot("", (model,))
    for part in loc:
        if part in ("[key]", NUMBER, MAPPING):
            continue
        chosen = tuple(m for m in _models(spot) if part in _tags(m)) if _is_union(spot) else ()
        spot = _Spot(spot.path, chosen) if chosen else _step(spot, part)
    return spot


def _step(spot: _Spot, part: int | str) -> _Spot:
    inner: list[Any] = []
    for option in spot.options:
        arguments = get_args(option)
        if isinstance(option, type) and issubclass(option, BaseModel):
            field = option.model_fields.get(str(part))
            inner += _alternatives(field.annotation) if field else []
        elif get_origin(option) is dict:
            inner += _alternatives(arguments[1])
        elif get_origin(option) is tuple and isinstance(part, int):
            item = arguments[0] if arguments[-1] is Ellipsis else (*arguments, Any)[part]
            inner += _alternatives(item)
    return _Spot(_join(spot.path, part), tuple(inner))


def _alternatives(annotation: Any) -> list[Any]:  # noqa: ANN401 - any type form
    """Return the members of a union, and anything else as its own only alternative."""
    if hasattr(annotation, "__metadata__"):
        return _alternatives(annotation.__origin__)
    arguments = get_args(annotation)
    if type(None) in arguments or (arguments and all(_is_model(inner) for inner in arguments)):
        return [form for inner in arguments for form in _alternatives(inner)]
    if get_origin(annotation) in (None, dict, tuple, list, Literal):
        return [annotation]
    return [form for inner in arguments for form in _alternatives(inner)]


def _is_model(form: Any) -> bool:  # noqa: ANN401 - any type form
    return isinstance(form, type) and issubclass(form, BaseModel)


def _models(spot: _Spot) -> list[type[BaseModel]]:
    return [option for option in spot.options if _is_model(option)]


def _is_union(spot: _Spot) -> bool:
    return len(_models(spot)) > 1


def _literals(model: type[BaseModel], key: str) -> tuple[Any, ...]:
    annotation = model.model_fields[key].annotation
    return get_args(annotation) if get_origin(annotation) is Literal else ()


def _tags(model: type[BaseModel]) -> set[Any]:
    return {tag for key in model.model_fields for tag in _literals(model, key)}


def _keys(spot: _Spot) -> list[str]:
    return list(dict.fromkeys(key for model in _models(spot) for key in model.model_fields))


def _join(path: str, part: int | str) -> str:
    if isinstance(part, int):
        return f"{path}[{part}]"
    return f"{path}.{part}" if path else part


def _shorten(value: object, limit: int = 60) -> str:
    text = repr(value)
    return text if len(text) <= limit else text[: limit - 1] + "…"
