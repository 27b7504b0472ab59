"""A test-bed with values and effects that a command line gives: `--set testbed.…`, `--effect`."""

from __future__ import annotations

import re
from collections.abc import Sequence

from cspm.testbed import Testbed
from cspm_msgs_py.edited import with_effects
from cspm_msgs_py.errors import InputError
from cspm_msgs_py.testbed import EffectEntry, TestbedFile
from cspm_msgs_py.yaml_file import parse_yaml

# What begins so in `--set` is a key of the test-bed's file, not of the scenario's.
TESTBED = "testbed."
_EFFECT = re.compile(r"(?P<id>\w+)(@(?P<elements>[^:]+))?:(?P<numbers>.+)")
_FORM = "EFFECT@ELEMENT,…:PARAMETER=VALUE,…, such as winch_coulomb_friction@sway_3:torque=0.02"


def of_testbed(overrides: Sequence[str]) -> tuple[list[str], list[str]]:
    """Return the overrides of the scenario, and those of the test-bed without their prefix."""
    own = [each.removeprefix(TESTBED) for each in overrides if each.startswith(TESTBED)]
    return [each for each in overrides if not each.startswith(TESTBED)], own


def changed_machine(
    file: TestbedFile, overrides: Sequence[str] = (), effects: Sequence[str] = ()
) -> TestbedFile:
    """Return a test-bed's file with other values and further effects.

    Args:
        file: the machine.
        overrides: `key=value`, the key a path in the file, such as `cables.sway_3.drum_radius`.
        effects: `EFFECT@ELEMENT,…:PARAMETER=VALUE,…`; without elements on all that can have it.

    Raises:
        InputError: no such place, effect, element or parameter, or a value out of its bounds.
    """
    machine = Testbed(file)
    for override in overrides:
        key, separator, text = override.partition("=")
        if not separator:
            raise InputError(f"--set {TESTBED}{override}: allowed: {TESTBED}key.path=value")
        value = parse_yaml(text, f"--set {TESTBED}{override}")
        machine = machine.with_parameter(key, value)
    return _planted(machine, [(text, _entry(text)) for text in effects]).file


def _planted(machine: Testbed, effects: Sequence[tuple[str, EffectEntry]]) -> Testbed:
    """Return the machine with effects, all at once; what is wrong with one is said of that one."""
    try:
        return Testbed(with_effects(machine.file, [entry for _, entry in effects]))
    except InputError:
        for text, entry in effects:
            try:
                machine = Testbed(with_effects(machine.file, [entry]))
            except InputError as err:
                raise InputError(f"--effect {text}: {err}") from None
        raise


def _entry(text: str) -> EffectEntry:
    found = _EFFECT.fullmatch(text)
    if found is None:
        raise InputError(f"--effect {text}: allowed: {_FORM}")
    numbers: dict[str, float] = {}
    for pair in found["numbers"].split(","):
        name, _, value = pair.partition("=")
        try:
            numbers[name.strip()] = float(value)
        except ValueError:
            raise InputError(f"--effect {text}: {pair!r}, allowed: {_FORM}") from None
    elements = [each.strip() for each in (found["elements"] or "").split(",") if each.strip()]
    return EffectEntry(effect=found["id"], elements=tuple(elements), parameters=numbers)
