"""The mapping file: which column of a recording is which number of the contract, and since when.

Times are in s, values in SI, unless a key says otherwise.
"""

from __future__ import annotations

from dataclasses import dataclass
from hashlib import sha256
from pathlib import Path
from typing import Annotated, Literal

from pydantic import (
    Field,
    NonNegativeFloat,
    NonNegativeInt,
    PositiveFloat,
    PositiveInt,
    model_validator,
)
from typing_extensions import Self

from cspm_ident.importing.time_text import TEXT_UNITS
from cspm_ident.importing.units import COUNTS, TIME_UNITS
from cspm_msgs_py.testbed import Name
from cspm_msgs_py.yaml_file import StrictModel, parse_yaml, read_text, validate

Pair = tuple[float, float]


class Clock(StrictModel):
    """When samples were taken.

    The stamps are a column, or the message's own (`stamp`, bags only), or row numbers at a `rate`.
    They are unwrapped, taken to s, then mapped so that `points` lie where they shall, or stretched
    by `skew` from the first stamp on; last, `offset` is added.

    Attributes:
        column: name of the column that holds the time, or of several that are added up.
        rate: samples per second [Hz], where the file has no time.
        stamp: of a bag's messages: `header` or `log`.
        unit: of `column`, or of each; s, or as texts show, unless given.
        wrap: what the time in `column` counts to before it starts again at 0, in its unit.
        points: two instants [s], each as the file has it and as it really was.
        skew: relative stretch; 1e-5 where the clock loses 10 us per s.
        offset: added at the end [s].
        disorder: what to do where a stamp is not later than one before it.
    """

    column: str | tuple[str, ...] | None = None
    rate: PositiveFloat | None = None
    stamp: Literal["header", "log"] | None = None
    unit: str | tuple[str, ...] | None = None
    wrap: PositiveFloat | None = None
    points: tuple[Pair, Pair] | None = None
    skew: float = Field(default=0.0, gt=-0.5, lt=0.5)
    offset: float = 0.0
    disorder: Literal["refuse", "drop", "keep"] = "refuse"

    @property
    def columns(self) -> tuple[str, ...]:
        """Names of the columns that hold the time; none with a rate or stamps of messages."""
        if self.column is None:
            return ()
        return (self.column,) if isinstance(self.column, str) else self.column

    @property
    def units(self) -> tuple[str | None, ...]:
        """Unit of each column, None where it was not given."""
        if isinstance(self.unit, tuple):
            return self.unit
        return (self.unit,) * max(len(self.columns), 1)

    @model_validator(mode="after")
    def _one_way(self) -> Self:
        given = [key for key in ("column", "rate", "stamp") if getattr(self, key) is not None]
        if len(given) != 1:
            raise ValueError(
                f"{' and '.join(given) or 'no time'}, allowed: one of column, rate, stamp"
            )
        for unit in self.units:
            if unit is not None and unit not in TIME_UNITS:
                raise ValueError(f"unit: '{unit}', allowed: {', '.join(TIME_UNITS)}")
        if self.column is None and (self.unit is not None or self.wrap is not None):
            raise ValueError(f"unit or wrap with {given[0]}, allowed: with column")
        if len(self.columns) > 1 and not isinstance(self.unit, tuple):
            raise ValueError("unit: missing for several columns, allowed: a list, one each")
        if self.column is not None and len(self.units) != len(self.columns):
            raise ValueError(
                f"unit: {len(self.units)} for {len(self.columns)} columns, allowed: one each"
            )
        if self.wrap is not None and (len(self.columns) > 1 or self.unit in TEXT_UNITS):
            raise ValueError("wrap, allowed: with one column in a unit of a number")
        if self.points and self.skew:
            raise ValueError("points and skew, allowed: one of them")
        if self.points and not self.points[1][0] > self.points[0][0]:
            raise ValueError("points: the second is not later, allowed: two instants in order")
        if self.points and not self.points[1][1] > self.points[0][1]:
            raise ValueError("points: time runs backwards, allowed: two instants in order")
        return self


class ChannelSource(StrictModel):
    """Where one number of a message comes from.

    SI value = sign · scale · factor · raw + offset, with `factor` that of `unit`, or of the
    encoder.

    Attributes:
        column: name of the column.
        constant: the number itself, in SI, for what was not measured and is known.
        unit: of the column.
        counts_per_turn: of an encoder, with unit `counts`.
        wrap: what the column counts to before it starts again, in its unit.
        sign: -1 where the source counts the other way.
        scale: pure number; in the channel's SI unit per SI unit of the column where those differ,
            such as N·m/V.
        offset: added at the end, in the channel's SI unit.
        invalid: raw values that mean that there is none.
        spikes: what to do with single samples, or zeros, that leave and come back at once.
        jumps: what to do with steps that no motion explains: an encoder that was reset.
        clock: name of its clock; the first of the file unless given.
    """

    column: str | None = None
    constant: float | None = None
    unit: str | None = None
    counts_per_turn: PositiveFloat | None = None
    wrap: PositiveFloat | None = None
    sign: Literal[1, -1] = 1
    scale: float | None = None
    offset: float = 0.0
    invalid: tuple[int | float, ...] = ()
    spikes: Literal["keep", "mask"] = "keep"
    jumps: Literal["keep", "join"] = "keep"

    @property
    def is_mended(self) -> bool:
        """Whether impossible samples are to be changed."""
        return self.spikes != "keep" or self.jumps != "keep"

    clock: str | None = None

    @model_validator(mode="after")
    def _one_source(self) -> Self:
        if (self.column is None) == (self.constant is None):
            found = "no column" if self.column is None else "column and constant"
            raise ValueError(f"{found}, allowed: one of column, constant")
        if self.constant is not None:
            extra = sorted(self.model_fields_set - {"constant"})
            if extra:
                raise ValueError(f"{extra[0]} with constant, allowed: constant alone")
            return self
        if self.unit is None:
            raise ValueError("unit: missing, allowed: the unit of the column")
        if self.counts_per_turn is not None and self.unit != COUNTS:
            raise ValueError(f"counts_per_turn with unit {self.unit}, allowed: with unit {COUNTS}")
        if self.scale == 0.0:
            raise ValueError("scale: 0, allowed: any other number")
        return self


class Segment(StrictModel):
    """A stretch to leave out, in s from the first stamp of the import; both ends included."""

    start: float
    end: float
    topics: tuple[str, ...] = ()
    reason: str = ""

    @model_validator(mode="after")
    def _ordered(self) -> Self:
        if not self.start < self.end:
            raise ValueError(f"start {self.start:g}, end {self.end:g}, allowed: start < end")
        return self


class CsvFormat(StrictModel):
    """How a text table is written, or where in a spreadsheet it is.

    Attributes:
        delimiter: between cells; found from the line of names unless given; `blank` for any
            number of blanks.
        decimal: mark of the decimals.
        thousands: mark between thousands, which is taken out.
        names_line: which line holds the names, from 1; 0 for none: columns are then 1, 2, ….
        first_line: first line of numbers; the one after the names unless given.
        comment: what starts a comment.
        names: of the columns, in place of those in the file.
        short_rows: what to do with a row that ends before the last column.
        missing: texts that mean that there is no number, besides nothing and nan.
        encoding: of the text.
        sheet: of a spreadsheet; the first unless given.
    """

    delimiter: str | None = None
    decimal: Literal[".", ","] = "."
    thousands: Literal[".", ",", "'", " ", "_"] | None = None
    names_line: NonNegativeInt = 1
    first_line: PositiveInt | None = None
    comment: str = "#"
    names: Annotated[tuple[str, ...], Field(min_length=1)] | None = None
    short_rows: Literal["refuse", "fill"] = "refuse"
    missing: tuple[str, ...] = ()
    encoding: str = "utf-8"
    sheet: str | None = None

    @model_validator(mode="after")
    def _readable(self) -> Self:
        if self.delimiter is not None and self.delimiter != "blank" and len(self.delimiter) != 1:
            raise ValueError(f"delimiter: '{self.delimiter}', allowed: one character, or blank")
        if self.first_line is not None and self.first_line <= self.names_line:
            raise ValueError(
                f"first_line: {self.first_line}, allowed: after names_line, {self.names_line}"
            )
        taken = (self.decimal, self.delimiter, " " if self.delimiter == "blank" else None)
        if self.thousands is not None and self.thousands in taken:
            raise ValueError(
                f"thousands: '{self.thousands}' is the decimal mark or the delimiter as well,"
                " allowed: another mark"
            )
        try:
            "".encode(self.encoding)
        except LookupError:
            raise ValueError(
                f"encoding: '{self.encoding}', allowed: such as utf-8, latin-1, utf-16"
            ) from None
        return self


class BesideFile(StrictModel):
    """Another file of the experiment.

    Attributes:
        path: seen from the folder of the mapping.
        csv: how it is written, where it is a text table or a spreadsheet.
    """

    path: Annotated[str, Field(min_length=1)]
    csv: CsvFormat = CsvFormat()


class Mapping(StrictModel):
    """A whole mapping file. Build it with `load_mapping`.

    Attributes:
        name: what the recording shall be called.
        description: what it is of.
        csv: how a text table is written.
        files: others beside the one that is imported, by the name before their columns.
        clocks: by name; the first serves every channel that names none.
        channels: by topic and field, such as `/winches/state` and `position/surge`.
        nan: what to do with a message of which a number is missing.
        pairing: how far stamps of one message may differ [s]; unless given a twentieth of the
            shortest step, 0 for none.
        unpaired: what to do with samples that have no partner in a message of several.
        drop: stretches to leave out.
    """

    name: Name
    description: str = ""
    csv: CsvFormat = CsvFormat()
    files: dict[Name, BesideFile] = Field(default_factory=dict)
    clocks: dict[str, Clock] = Field(default_factory=dict)
    channels: Annotated[
        dict[str, Annotated[dict[str, ChannelSource], Field(min_length=1)]], Field(min_length=1)
    ]
    nan: Literal["drop", "keep", "refuse"] = "drop"
    pairing: NonNegativeFloat | None = None
    unpaired: Literal["refuse", "drop"] = "refuse"
    drop: tuple[Segment, ...] = ()

    @model_validator(mode="after")
    def _clocks_exist(self) -> Self:
        for topic, fields in self.channels.items():
            for field, source in fields.items():
                if source.clock is not None and source.clock not in self.clocks:
                    raise ValueError(
                        f"channels.{topic}.{field}.clock: '{source.clock}', allowed:"
                        f" {', '.join(self.clocks) or 'none, the file has no clocks'}"
                    )
        for i, segment in enumerate(self.drop):
            for topic in segment.topics:
                if topic not in self.channels:
                    raise ValueError(
                        f"drop[{i}].topics: '{topic}', allowed: {', '.join(self.channels)}"
                    )
        return self


@dataclass(frozen=True)
class MappingFile:
    """A mapping with the text and the path that it came from."""

    mapping: Mapping
    text: str
    path: Path

    @property
    def sha256(self) -> str:
        """SHA-256 of the text, hexadecimal."""
        return sha256(self.text.encode()).hexdigest()


def load_mapping(path: Path) -> MappingFile:
    """Read and check a mapping file.

    Raises:
        InputError: naming file, key, value and what is allowed.
    """
    text = read_text(path)
    return MappingFile(validate(Mapping, parse_yaml(text, str(path)), str(path)), text, path)
