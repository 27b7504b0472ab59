"""The test-bed file with the effects that a diagnosis found."""

from __future__ import annotations

import io

import numpy as np
from ruamel.yaml.comments import CommentedMap, CommentedSeq

from cspm_ident.diagnosis.diagnosis import Diagnosis
from cspm_ident.fitted_testbed import FittedNumber
from cspm_msgs_py.testbed import TestbedFile, parse_testbed
from cspm_msgs_py.yaml_file import round_trip

_UNBOUNDED = (-np.inf, np.inf)


def improved_testbed(diagnosis: Diagnosis, source: str) -> TestbedFile:
    """Return the searched machine's file with an entry under `effects` for every finding.

    Every parameter carries its source recordings and its interval; all else is unchanged.

    Args:
        diagnosis: the diagnosis.
        source: name of the new file in errors.

    Raises:
        InputError: the parameters do not make a valid machine.
    """
    yaml = round_trip()
    content = yaml.load(diagnosis.searched[0].testbed.text)
    entries = content.setdefault("effects", CommentedSeq())
    hashes = tuple(measurement.sha256 for measurement in diagnosis.searched)
    for finding in diagnosis.reported:
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
    stream = io.StringIO()
    yaml.dump(content, stream)
    return parse_testbed(stream.getvalue(), source)
