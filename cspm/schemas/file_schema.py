"""The JSON Schema of each kind of file, generated from the models that its reader uses."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

from pydantic import BaseModel
from pydantic.json_schema import GenerateJsonSchema

from cspm_msgs_py.errors import InputError
from cspm_msgs_py.provenance import Provenance

Schema = dict[str, Any]
_SOURCED = "SourcedValue"


def _testbed() -> type[BaseModel]:
    from cspm_msgs_py.testbed import Testbed

    return Testbed


def _scenario() -> type[BaseModel]:
    from cspm_msgs_py.scenario import Scenario

    return Scenario


def _mapping() -> type[BaseModel]:
    from cspm_ident.importing.mapping import Mapping

    return Mapping


def _campaign() -> type[BaseModel]:
    from cspm.campaign.campaign_file import CampaignFile

    return CampaignFile


def _diagnosis() -> type[BaseModel]:
    from cspm_ident.diagnosis_file import DiagnosisFile

    return DiagnosisFile


# Loaded when they are asked for: one kind of file needs not the readers of all.
_MODELS: dict[str, Callable[[], type[BaseModel]]] = {
    "testbed": _testbed,
    "scenario": _scenario,
    "mapping": _mapping,
    "campaign": _campaign,
    "diagnosis": _diagnosis,
}
KINDS = tuple(_MODELS)


class _Untitled(GenerateJsonSchema):
    """Leaves out titles of keys, which repeat their names."""

    def field_title_should_be_set(self, schema: Any) -> bool:  # noqa: ANN401 - as pydantic has it
        """Return that it should not."""
        return False


def schema_of(kind: str) -> Schema:
    """Return the JSON Schema of a kind of file, draft 2020-12.

    What it refuses, the reader refuses. The reader checks more: numbers against each other, names
    against the machine.

    Raises:
        InputError: no such kind.
    """
    found = _schema(model_of(kind))
    if kind == "testbed":
        found = _walked(found, _or_sourced)
        found["$defs"][_SOURCED] = _sourced_value()
    return {"$schema": GenerateJsonSchema.schema_dialect, **found}


def model_of(kind: str) -> type[BaseModel]:
    """Return the model by which a kind of file is checked.

    Raises:
        InputError: no such kind.
    """
    if kind not in _MODELS:
        raise InputError(f"schema {kind}: allowed: {', '.join(KINDS)}")
    return _MODELS[kind]()


def kind_of(content: Mapping[str, Any]) -> str | None:
    """Return the kind of file that has most of a file's keys; None where none has half of them."""
    shares = {
        kind: sum(key in _keys(model_of(kind)) for key in content) / max(len(content), 1)
        for kind in KINDS
    }
    best = max(shares, key=lambda kind: shares[kind])
    return best if shares[best] > 0.5 else None


def _keys(model: type[BaseModel]) -> set[str]:
    return {field.alias or name for name, field in model.model_fields.items()}


def _schema(model: type[BaseModel]) -> Schema:
    return _walked(model.model_json_schema(schema_generator=_Untitled), lambda value: value)


def _walked(node: Schema, changed: Callable[[Schema], Schema]) -> Schema:
    """Return a schema in which those of all values are changed, and unions ask for their tag."""
    found = dict(node)
    for key in ("properties", "$defs"):
        if key in node:
            inner = {name: _walked(each, changed) for name, each in node[key].items()}
            found[key] = inner if key == "$defs" else {k: changed(v) for k, v in inner.items()}
    for key in ("items", "additionalProperties"):
        if isinstance(node.get(key), dict):
            found[key] = changed(_walked(node[key], changed))
    for key in ("anyOf", "oneOf"):
        if key in node:
            found[key] = [_walked(each, changed) for each in node[key]]
    if "prefixItems" in node:
        found["prefixItems"] = [changed(_walked(each, changed)) for each in node["prefixItems"]]
    # A reader asks for the tag, though each model has a default for it.
    tag = found.pop("discriminator", {}).get("propertyName")
    if tag is not None:
        found["oneOf"] = [{**each, "required": [tag]} for each in found["oneOf"]]
    return found


def _or_sourced(value: Schema) -> Schema:
    """Return the schema of a value that may also be written with where it comes from."""
    about: Schema = {key: value[key] for key in ("default", "description") if key in value}
    plain = {key: each for key, each in value.items() if key not in about}
    sourced = {"$ref": f"#/$defs/{_SOURCED}", "properties": {"value": plain}}
    return {"anyOf": [plain, sourced], **about}


def _sourced_value() -> Schema:
    """Return what `unwrap_provenance` takes for a value with its provenance."""
    found = _schema(Provenance)
    found["properties"] = {"value": True, **found["properties"]}
    found["required"] = ["value", *found["required"]]
    return found
