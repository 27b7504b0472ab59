"""Effects that the file has already: less of them than it says, down to nothing.

A friction is never negative. What is found beside a file that has friction is an increment, and
the bounds hold for the sum of both.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import replace

from cspm_msgs_py.testbed import EffectEntry, Testbed, TestbedFile
from cspm_sim.effects import Effect, Elements, catalogue
from cspm_sim.effects.survey import surveyed_to

# The numbers of a file that effects add to, `{i}` for each cable.
_NUMBERS = {
    "cable_exit_offset": "cables[{i}].exit",
    "cable_attachment_offset": "cables[{i}].attachment",
    "cable_length_offset": "cables[{i}].offset_length",
    "winch_drum_radius": "cables[{i}].drum_radius",
    "winch_inertia": "cables[{i}].rotor_inertia",
    "bar_mass": "bar.mass",
    "bar_com": "bar.com",
}
# Noise moves the estimate of an effect that is gone below the file's value.
_SLACK = 1.05


def with_file_bounds(effects: Sequence[Effect], machine: Testbed) -> list[Effect]:
    """Return effects whose increments may be as negative as a machine's file allows."""
    return [_lowered(each, _most(each, machine)) for each in effects]


def with_file_accuracies(effects: Sequence[Effect], file: TestbedFile) -> list[Effect]:
    """Return effects with the accuracies that a file states of the numbers that they add to.

    Without those of numbers that it knows exactly. Of several cables the largest counts for all,
    and none where one has neither a stated accuracy nor a usual one.
    """
    found = []
    for effect in effects:
        stated = _stated(file, effect) if effect.id in _NUMBERS else []
        if not stated:
            found.append(effect)
        elif max(stated) > 0.0:
            found.append(surveyed_to(effect, max(stated)))
    return found


def _stated(file: TestbedFile, effect: Effect) -> list[float]:
    """Return the accuracies of a number of all cables, the usual one where a cable has none."""
    usual = effect.linear[0].usual
    paths = {_NUMBERS[effect.id].format(i=i) for i in range(len(file.testbed.cables))}
    known = [file.provenance[path].accuracy if path in file.provenance else None for path in paths]
    if all(each is None for each in known):
        return []
    found = [usual if each is None else each for each in known]
    return [] if None in found else [each for each in found if each is not None]


def may_be_less(effect: Effect) -> bool:
    """Return whether parameters of two entries of an effect add up, and are never negative."""
    physics, signature = effect.physics, effect.signature
    plain = physics.alter is None and physics.sense is None and not physics.states
    linear = not signature.nonlinear and signature.coefficients is None
    return (
        plain
        and linear
        and effect.table is None
        and effect.acts_on is Elements.CABLES
        and all(p.absent == p.minimum == 0.0 for p in effect.parameters)
    )


def is_less(effect: str, values: Mapping[str, float]) -> bool:
    """Return whether an entry's numbers are less than nothing, so that they belong to another."""
    return any(
        values[p.name] < p.allowed[0] for p in catalogue()[effect].parameters if p.name in values
    )


def joined_entries(machine: Testbed, entries: Iterable[EffectEntry]) -> tuple[EffectEntry, ...]:
    """Return a machine's effects with further entries of one element each.

    One that is less than nothing is taken off the file's own, which is then split by element.
    """
    found = list(machine.effects)
    for entry in entries:
        less = entry.table is None and is_less(entry.effect, entry.numbers)
        found = list(_taken_off(found, entry, machine)) if less else [*found, entry]
    return tuple(found)


def of_all_cells(entries: Sequence[EffectEntry], machine: Testbed) -> list[EffectEntry]:
    """Return entries with one for all load cells where each of them has the same."""
    found: list[EffectEntry] = []
    for entry in entries:
        alike = [e for e in entries if (e.effect, e.parameters) == (entry.effect, entry.parameters)]
        acting = {name for each in alike for name in each.elements}
        cells = entry.table is None and catalogue()[entry.effect].acts_on is Elements.CELLS
        if not (cells and acting == set(machine.cable_names)):
            found.append(entry)
        elif entry is alike[0]:
            found.append(entry.model_copy(update={"elements": (Elements.CELLS.value,)}))
    return found


def _most(effect: Effect, machine: Testbed) -> Mapping[str, float]:
    """Return the largest value of each parameter among a file's entries of an effect."""
    own = [each.numbers for each in machine.effects if each.effect == effect.id]
    if not own or not may_be_less(effect):
        return {}
    return {p.name: max(each.get(p.name, 0.0) for each in own) for p in effect.parameters}


def _lowered(effect: Effect, most: Mapping[str, float]) -> Effect:
    if not any(most.values()):
        return effect
    parameters = tuple(
        replace(p, minimum=min(p.minimum, -_SLACK * most[p.name])) for p in effect.parameters
    )
    return replace(effect, parameters=parameters)


def _taken_off(
    known: Sequence[EffectEntry], less: EffectEntry, machine: Testbed
) -> Iterator[EffectEntry]:
    """Yield entries with `less` taken off the first that acts on its element."""
    (element,) = less.elements
    names = [cable.name for cable in machine.cables]
    found = False
    for entry in known:
        acting = entry.elements or names
        if found or entry.effect != less.effect or element not in acting:
            yield entry
            continue
        found = True
        if rest := tuple(name for name in acting if name != element):
            yield entry.model_copy(update={"elements": rest})
        left = {k: max(0.0, v + less.numbers.get(k, 0.0)) for k, v in entry.numbers.items()}
        yield less.model_copy(update={"parameters": left})
    if not found:
        yield less
