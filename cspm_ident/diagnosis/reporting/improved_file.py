"""The test-bed file with the effects that a diagnosis found."""

from __future__ import annotations

import io
from collections.abc import Mapping, Sequence

import numpy as np
from ruamel.yaml.comments import CommentedMap, CommentedSeq

from cspm_ident.diagnosis.diagnosis import Diagnosis
from cspm_ident.diagnosis.finding import Finding
from cspm_ident.diagnosis.parameter import Coefficients, Parameter
from cspm_ident.diagnosis.reporting.empirical_statement import table_entries
from cspm_ident.fitted_testbed import FittedNumber
from cspm_msgs_py.testbed import EffectEntry, TestbedFile, parse_testbed
from cspm_msgs_py.yaml_file import round_trip

_UNBOUNDED = (-np.inf, np.inf)


def improved_testbed(
    diagnosis: Diagnosis, source: str, without: Finding | None = None
) -> TestbedFile:
    """Return the searched machine's file with an entry under `effects` for every finding.

    Every parameter carries its source recordings and its interval; all else is unchanged.

    Args:
        diagnosis: the diagnosis.
        source: name of the new file in errors.
        without: a finding to leave out.

    Raises:
        InputError: the parameters do not make a valid machine.
    """
    yaml = round_trip()
    content = yaml.load(diagnosis.searched[0].testbed.text)
    entries = content.setdefault("effects", CommentedSeq())
    hashes = tuple(measurement.sha256 for measurement in diagnosis.searched)
    names = diagnosis.searched[0].machine.cable_names
    for finding in (each for each in diagnosis.in_model if each is not without):
        for own in finding.coefficients:
            elements = [own.candidate.element]
            entry = CommentedMap({"effect": finding.effect, "elements": elements})
            file = _taken_off(entries, finding, own, names) if finding.is_less else {}
            entry["parameters"] = CommentedMap(
                {
                    n.name: _fitted(n, file.get(n.name, 0.0), hashes)
                    for n in finding.parameters_on(own)
                }
            )
            entries.append(entry)
    entries.extend(_tabled(entry, hashes) for entry in table_entries(diagnosis))
    stream = io.StringIO()
    yaml.dump(content, stream)
    return parse_testbed(stream.getvalue(), source)


def _fitted(number: Parameter, file: float, hashes: tuple[str, ...]) -> CommentedMap:
    """Return a number as the file writes it, with what the file said before added to it."""
    low, high = number.ci95 or _UNBOUNDED
    ends = (max(0.0, low + file), high + file) if file else (low, high)
    value = max(0.0, number.value + file) if file else number.value
    return FittedNumber(value, ends, hashes).content()


def _taken_off(
    entries: CommentedSeq, finding: Finding, own: Coefficients, names: Sequence[str]
) -> dict[str, float]:
    """Take an element out of the file's own entry of an effect; return what it said of it."""
    element = own.candidate.element
    for entry in entries:
        acting = list(entry.get("elements") or names)
        if entry["effect"] != finding.effect or element not in acting:
            continue
        acting.remove(element)
        said = {name: _number(value) for name, value in entry["parameters"].items()}
        if acting:
            entry["elements"] = acting
        else:
            entries.remove(entry)
        return said
    return {}


def _number(value: object) -> float:
    """Return a number of a file, with provenance or without."""
    return float(value["value"] if isinstance(value, Mapping) else value)  # type: ignore[arg-type]


def _tabled(entry: EffectEntry, hashes: tuple[str, ...]) -> CommentedMap:
    """Return a table's entry; its note says that it describes and does not explain."""
    assert entry.table is not None
    content = CommentedMap(entry.table.model_dump(exclude_defaults=True))
    for name in ("knots", "second_knots", "values"):
        if name in content:
            content[name] = CommentedSeq(content[name])
            content[name].fa.set_flow_style()
    source: dict[str, object] = {"provenance": "fitted", "recording": hashes[0]}
    if hashes[1:]:
        source["further_recordings"] = list(hashes[1:])
    content["values"] = CommentedMap({"value": content["values"], **source})
    return CommentedMap(
        {"effect": entry.effect, "elements": [*entry.elements], "parameters": content}
    )
