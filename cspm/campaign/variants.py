"""The runs of a campaign: every combination of its axes."""

from __future__ import annotations

import json
import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from itertools import product
from typing import Any

import numpy as np
from scipy.stats import qmc

from cspm.campaign.campaign_file import EFFECTS, SCENARIO, TESTBED, CampaignFile, Range, Sample
from cspm_msgs_py.errors import InputError

Point = Mapping[str, Any]
_OF_EFFECT = f"{EFFECTS}."


@dataclass(frozen=True)
class Variant:
    """One run, as `cspm run` takes it.

    Attributes:
        number: its place in the campaign.
        values: what is varied, by key.
        scenario: file.
        testbed: file of a machine instead of the scenario's, if any.
        overrides: `KEY=VALUE` each.
        effects: `EFFECT@ELEMENTS:PARAMETER=VALUE,…` each.
    """

    number: int
    values: dict[str, Any]
    scenario: str
    testbed: str | None
    overrides: tuple[str, ...]
    effects: tuple[str, ...]


def variants_of(file: CampaignFile) -> list[Variant]:
    """Return the runs of a campaign, in an order that its file alone decides.

    Raises:
        InputError: an effect's axis is not written as one.
    """
    parts = product(_grid(file.grid), file.points or ({},), _drawn(file.sample))
    points = ({**a, **b, **c} for a, b, c in parts)
    return [_variant(number, file, point) for number, point in enumerate(points)]


def _grid(axes: Mapping[str, Range | list[Any]]) -> Iterator[Point]:
    values = [_values(axis) if isinstance(axis, Range) else axis for axis in axes.values()]
    for combination in product(*values):
        yield dict(zip(axes, combination, strict=True))


def _values(axis: Range) -> list[float] | list[int]:
    if axis.count is None:
        return list(range(int(axis.low), int(axis.high) + 1))
    space = np.geomspace if axis.scale == "log" else np.linspace
    found: list[float] = space(axis.low, axis.high, axis.count).tolist()
    return found


def _drawn(sample: Sample | None) -> list[Point]:
    """Return the points of a sample: one without any, where nothing is drawn."""
    if sample is None:
        return [{}]
    count, ranges = sample.count, [*sample.ranges.values()]
    if sample.method == "sobol":
        # Its first 2^m points fill a box most evenly: of fewer, the first of these.
        engine = qmc.Sobol(len(ranges), rng=sample.seed)
        unit = engine.random_base2(math.ceil(math.log2(count)))[:count]
    else:
        unit = qmc.LatinHypercube(len(ranges), rng=sample.seed).random(count)
    columns = [_scaled(axis, unit[:, i]).tolist() for i, axis in enumerate(ranges)]
    return [dict(zip(sample.ranges, row, strict=True)) for row in zip(*columns, strict=True)]


def _scaled(axis: Range, unit: np.ndarray[Any, np.dtype[np.float64]]) -> Any:  # noqa: ANN401
    if axis.scale == "log":
        return np.exp(np.log(axis.low) + unit * np.log(axis.high / axis.low))
    return axis.low + unit * (axis.high - axis.low)


def _variant(number: int, file: CampaignFile, point: Point) -> Variant:
    changes = {**file.set, **point}
    effects: dict[str, list[str]] = {each: [] for each in file.effects}
    overrides = []
    for key, value in changes.items():
        if key == EFFECTS:
            listed = value if isinstance(value, list) else [value]
            effects |= {str(each): [] for each in listed if each is not None}
        elif key.startswith(_OF_EFFECT):
            _add_effect(effects, key.removeprefix(_OF_EFFECT), value)
        elif key not in (SCENARIO, TESTBED):
            overrides.append(f"{key}={json.dumps(value)}")
    return Variant(
        number,
        dict(point),
        str(changes.get(SCENARIO, file.scenario)),
        changes.get(TESTBED, file.testbed),
        tuple(overrides),
        tuple(f"{name}:{','.join(pairs)}" if pairs else name for name, pairs in effects.items()),
    )


def _add_effect(effects: dict[str, list[str]], key: str, value: object) -> None:
    """Add a parameter of an effect's axis; nothing where its value is null."""
    name, separator, parameter = key.partition(":")
    if not separator or not parameter:
        raise InputError(
            f"{_OF_EFFECT}{key}: allowed: {_OF_EFFECT}EFFECT@ELEMENTS:PARAMETER, such as"
            f" {_OF_EFFECT}winch_coulomb_friction@sway_3:torque"
        )
    if value is not None:
        effects.setdefault(name, []).append(f"{parameter}={value}")
