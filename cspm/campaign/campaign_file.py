"""The file of a campaign: what is varied, how, and what is measured."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import Field, PositiveInt, model_validator
from typing_extensions import Self

from cspm_msgs_py.errors import InputError
from cspm_msgs_py.recording.run_record import SIM
from cspm_msgs_py.yaml_file import StrictModel, parse_yaml, read_text, validate
from cspm_run.library import find_scenario, find_testbed
from cspm_run.plants import PLANTS

# Keys of axes that are no keys of scenario or test-bed.
SCENARIO, TESTBED, EFFECTS = "scenario", "testbed", "effects"
# Of files that a value may name: code, motions, response amplitudes.
_SUFFIXES = (".py", ".csv", ".yaml", ".yml")
Value = Any
Count = Annotated[int, Field(ge=2)]


class Range(StrictModel):
    """Numbers from one end to the other, both included.

    Attributes:
        low: the first.
        high: the last.
        count: how many; None: every whole number between two whole ends.
        scale: whether their differences or their quotients are equal.
    """

    low: float = Field(alias="from")
    high: float = Field(alias="to")
    count: Count | None = None
    scale: Literal["linear", "log"] = "linear"

    @model_validator(mode="after")
    def _ordered(self) -> Self:
        if not self.low < self.high:
            raise ValueError(f"from: {self.low:g}, to: {self.high:g}, allowed: from below to")
        if self.scale == "log" and self.low <= 0.0:
            raise ValueError(f"from: {self.low:g} with scale log, allowed: a number above 0")
        return self

    @property
    def is_whole(self) -> bool:
        """Whether both ends are whole numbers."""
        return self.low.is_integer() and self.high.is_integer()


class Sample(StrictModel):
    """Points that fill a box evenly.

    Attributes:
        method: Latin hypercube, or Sobol's sequence, scrambled.
        count: how many points.
        seed: of the draw.
        ranges: the box, by key.
    """

    method: Literal["latin_hypercube", "sobol"] = "sobol"
    count: PositiveInt
    seed: Annotated[int, Field(ge=0)] = 1
    ranges: dict[str, Range] = Field(min_length=1)


class Kept(StrictModel):
    """Which runs are recorded, once all are done.

    Attributes:
        worst: so many of them.
        of: by this column, largest first.
        runs: and these, by number.
    """

    worst: Annotated[int, Field(ge=0)] = 0
    of: str | None = None
    runs: tuple[Annotated[int, Field(ge=0)], ...] = ()

    @model_validator(mode="after")
    def _complete(self) -> Self:
        if self.worst and self.of is None:
            raise ValueError("of: missing, allowed: the column by which runs are the worst")
        return self


class CampaignFile(StrictModel):
    """What a campaign's file says. Build it with `load_campaign`.

    Attributes:
        name: of the campaign; empty: the file's.
        scenario: the base, a name or a file beside this one.
        testbed: a machine instead of the scenario's.
        plant: whose equations.
        set: what all runs share, by keys as `cspm run --set` takes them.
        effects: physics in all machines, as `cspm run --effect` takes it.
        grid: values of each key; every combination is run.
        points: combinations by hand, a mapping of keys to values each.
        sample: further keys, drawn.
        metrics: functions of one's own, `FILE.py:FUNCTION` or `MODULE:FUNCTION`.
        recordings: which runs are recorded.
        diagnose: whether each run is diagnosed, by its base machine.
    """

    name: str = ""
    scenario: str
    testbed: str | None = None
    plant: str = SIM
    set: dict[str, Value] = {}
    effects: tuple[str, ...] = ()
    grid: dict[str, Range | list[Value]] = {}
    points: tuple[dict[str, Value], ...] = ()
    sample: Sample | None = None
    metrics: tuple[str, ...] = ()
    recordings: Kept = Kept()
    diagnose: bool = False

    @model_validator(mode="after")
    def _consistent(self) -> Self:
        if self.plant not in PLANTS:
            raise ValueError(f"plant: {self.plant}, allowed: {', '.join(PLANTS)}")
        for key, axis in self.grid.items():
            if isinstance(axis, list) and not axis:
                raise ValueError(f"grid.{key}: an empty list, allowed: at least one value")
            if isinstance(axis, Range) and axis.count is None and not axis.is_whole:
                raise ValueError(f"grid.{key}: no count, allowed: one, or whole from and to")
        _refuse_twice(self)
        return self


def load_campaign(path: Path) -> CampaignFile:
    """Return the campaign of a file, its scenarios and test-beds as absolute paths.

    Raises:
        InputError: naming file, key, value and what is allowed.
    """
    content = parse_yaml(read_text(path), str(path))
    found = validate(CampaignFile, content, str(path))
    folder = path.resolve().parent
    try:
        return found.model_copy(
            update={
                "name": found.name or path.stem,
                SCENARIO: scenario_path(found.scenario, folder),
                TESTBED: None if found.testbed is None else testbed_path(found.testbed, folder),
                "grid": {key: _located(key, axis, folder) for key, axis in found.grid.items()},
                "points": tuple(
                    {key: _located(key, [value], folder)[0] for key, value in point.items()}
                    for point in found.points
                ),
                "set": {key: _absolute(value, folder) for key, value in found.set.items()},
                "metrics": tuple(_metric(each, folder) for each in found.metrics),
            }
        )
    except InputError as err:
        raise InputError(f"{path}: {err}") from None


def scenario_path(name: str, folder: Path) -> str:
    """Return the file of a scenario that a file in `folder` names.

    Raises:
        InputError: there is none.
    """
    return str(find_scenario(_beside(name, folder)).resolve())


def testbed_path(name: str, folder: Path) -> str:
    """Return the file of a test-bed that a file in `folder` names.

    Raises:
        InputError: there is none.
    """
    return str(find_testbed(_beside(name, folder)).resolve())


def _beside(name: str, folder: Path) -> str:
    return str(folder / name) if (folder / name).is_file() else name


def _located(key: str, axis: Any, folder: Path) -> Any:  # noqa: ANN401 - a range or values
    """Return an axis whose file names are absolute."""
    if isinstance(axis, Range):
        return axis
    if key == SCENARIO:
        return [scenario_path(str(each), folder) for each in axis]
    if key == TESTBED:
        return [testbed_path(str(each), folder) for each in axis]
    return [_absolute(each, folder) for each in axis]


def _absolute(value: Value, folder: Path) -> Value:
    """Return a value in which names of files beside the campaign's file are absolute."""
    if isinstance(value, dict):
        return {key: _absolute(inner, folder) for key, inner in value.items()}
    if isinstance(value, list):
        return [_absolute(inner, folder) for inner in value]
    named = file_in(value)
    if named and (folder / named).is_file():
        return f"{folder / named}{str(value)[len(named) :]}"
    return value


def file_in(value: Value) -> str:
    """Return the file that a value may name, alone or as `FILE.py:CLASS`; else nothing."""
    if not isinstance(value, str):
        return ""
    file = value.rpartition(":")[0] if ".py:" in value else value
    return file if Path(file).suffix in _SUFFIXES else ""


def _metric(name: str, folder: Path) -> str:
    file, _, function = name.rpartition(":")
    if not file or not function.isidentifier():
        raise InputError(f"metrics: {name}, allowed: FILE.py:FUNCTION or MODULE:FUNCTION")
    if not file.endswith(".py"):
        return name
    if not (folder / file).is_file():
        raise InputError(f"metrics: {name}: no such file in {folder}, allowed: FILE.py:FUNCTION")
    return f"{folder / file}:{function}"


def _refuse_twice(file: CampaignFile) -> None:
    seen: set[str] = set()
    drawn = file.sample.ranges if file.sample else {}
    by_hand = {key: None for point in file.points for key in point}
    for group in (file.set, file.grid, by_hand, drawn):
        for key in group:
            if key in seen:
                raise ValueError(f"{key}: varied or set twice, allowed: once")
            seen.add(key)
