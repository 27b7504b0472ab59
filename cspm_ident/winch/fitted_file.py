"""A test-bed file with what was identified of its winches."""

from __future__ import annotations

import io
from collections.abc import Mapping
from typing import Any

from ruamel.yaml.comments import CommentedMap, CommentedSeq

from cspm_ident.fitted_testbed import FittedNumber, with_fitted
from cspm_ident.winch.identification import INERTIA
from cspm_ident.winch.identified_winch import IdentifiedWinch, WinchesResult, absent_value
from cspm_msgs_py.errors import InputError
from cspm_msgs_py.testbed import TestbedFile, parse_testbed
from cspm_msgs_py.yaml_file import round_trip
from cspm_sim.effect_entries import read_actions
from cspm_sim.effects import catalogue

Content = Any
Fitted = dict[str, FittedNumber]
# What would replace the inertia that was written into the cable.
_INERTIA_EFFECT = "winch_inertia"


def fitted_testbed(result: WinchesResult, file: TestbedFile, source: str) -> TestbedFile | None:
    """Return the test-bed file with the fitted numbers, each with recording and interval.

    The inertia is an entry of the cable, all others in `effects`, one entry per winch and effect:
    what was fitted is the whole of an effect, so it replaces what the winch had of it. What is no
    result is left as it was. So is what the recordings do not show, unless they exclude the
    described number. None where there is no result at all.

    Args:
        result: what was identified.
        file: of the machine that was described.
        source: names it in errors.

    Raises:
        InputError: the numbers are no machine's, such as a negative friction.
    """
    numbers = {winch.name: _numbers(result, winch) for winch in result.winches}
    if not any(winch.valid for winch in result.winches):
        return None
    inertias = {
        name: {"rotor_inertia": found[INERTIA]}
        for name, found in numbers.items()
        if INERTIA in found
    }
    yaml = round_trip()
    content: Content = yaml.load(with_fitted(file.text, source, inertias).text)
    entries = content.setdefault("effects", CommentedSeq())
    cables = file.testbed.cable_names
    for name, found in numbers.items():
        if INERTIA in found:
            _release(entries, cables, _INERTIA_EFFECT, name)
        for effect, parameters in _by_effect(found).items():
            _put(entries, cables, effect, name, parameters)
    stream = io.StringIO()
    yaml.dump(content, stream)
    fitted = parse_testbed(stream.getvalue(), source)
    try:
        read_actions(fitted.testbed)
    except InputError as err:
        raise InputError(f"{source}: {err}") from None
    return fitted


def _numbers(result: WinchesResult, winch: IdentifiedWinch) -> Fitted:
    """Return what was determined, by the estimate's names."""
    hashes = tuple(measurement.sha256 for measurement in result.searched)
    windows = tuple((0.0, measurement.duration) for measurement in result.searched)
    estimate = winch.fit.estimate
    found = {}
    for name in winch.valid:
        value, (low, high) = estimate.value(name), estimate.interval(name)
        if name in winch.unseen:
            if low <= winch.described.get(name, low) <= high:
                continue
            value = absent_value(name)
            low = max(low, value) if name in winch.one_signed else low
        found[name] = FittedNumber(value, (low, high), hashes, windows)
    return found


def _by_effect(found: Fitted) -> dict[str, Fitted]:
    out: dict[str, Fitted] = {}
    for name, number in found.items():
        effect, _, parameter = name.partition(" ")
        if parameter:
            out.setdefault(effect, {})[parameter] = number
    return out


def _put(
    entries: Content, cables: tuple[str, ...], effect: str, name: str, numbers: Mapping[str, Any]
) -> None:
    own = [e for e in entries if e["effect"] == effect and list(e.get("elements", ())) == [name]]
    if len(own) == 1 and len(_acting(entries, cables, effect, name)) == 1:
        entry = own[0]
    else:
        _release(entries, cables, effect, name)
        entry = CommentedMap({"effect": effect, "elements": _line([name])})
        absent = {p.name: p.absent or 0.0 for p in catalogue()[effect].parameters}
        entry["parameters"] = CommentedMap(absent)
        entries.append(entry)
    for parameter, number in numbers.items():
        entry["parameters"][parameter] = number.content()


def _acting(
    entries: Content, cables: tuple[str, ...], effect: str, name: str
) -> list[CommentedMap]:
    """Return the entries of an effect that act on a winch."""
    return [e for e in entries if e["effect"] == effect and name in (e.get("elements") or cables)]


def _release(entries: Content, cables: tuple[str, ...], effect: str, name: str) -> None:
    """Take a winch out of an effect's entries; other winches keep theirs."""
    for entry in _acting(entries, cables, effect, name):
        others = [each for each in entry.get("elements") or cables if each != name]
        if others:
            entry["elements"] = _line(others)
        else:
            entries.remove(entry)


def _line(values: list[str]) -> CommentedSeq:
    line = CommentedSeq(values)
    line.fa.set_flow_style()
    return line
