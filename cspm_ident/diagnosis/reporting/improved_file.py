"""The test-bed file with the effects that a diagnosis found."""

from __future__ import annotations

import io

import numpy as np
from ruamel.yaml.comments import CommentedMap, CommentedSeq

from cspm_ident.diagnosis.diagnosis import Diagnosis
from cspm_ident.diagnosis.finding import Finding
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
    for finding in (each for each in diagnosis.in_model if each is not without):
        for own in finding.coefficients:
            elements = [own.candidate.element]
            entry = CommentedMap({"effect": finding.effect, "elements": elements})
            entry["parameters"] = CommentedMap(
                {
                    n.name: FittedNumber(n.value, n.ci95 or _UNBOUNDED, hashes).content()
                    for n in finding.parameters_on(own)
                }
            )
            entries.append(entry)
    entries.extend(_tabled(entry, hashes) for entry in table_entries(diagnosis))
    stream = io.StringIO()
    yaml.dump(content, stream)
    return parse_testbed(stream.getvalue(), source)


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
