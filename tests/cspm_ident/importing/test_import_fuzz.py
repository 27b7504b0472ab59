"""Any mapping and any file: one line of refusal, or what an independent reader finds.

`make fuzz` tries 10 000 of each kind.
"""

import csv
import json
import os
from decimal import Decimal, InvalidOperation

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from import_samples import imported
from lab_bags import EPOCH_NS, STEP_NS, bag, joints
from mcap.writer import CompressionType

from cspm_msgs_py.errors import InputError

STATE = "/winches/state"
EXAMPLES = int(os.environ.get("CSPM_FUZZ_EXAMPLES", "40"))
FUZZ = settings(
    max_examples=EXAMPLES,
    deadline=None,
    suppress_health_check=[HealthCheck.too_slow, HealthCheck.data_too_large],
)


def outcome(path, mapping):
    """What is imported, or the line of refusal."""
    try:
        return imported(path, mapping)
    except InputError as refused:
        return str(refused)


def is_refused(found):
    """Whether it was, in one line."""
    return isinstance(found, str) and len(found) > 10 and "\n" not in found


@st.composite
def tables(draw):
    """Text of a table with its form, perhaps spoiled: (text, form, unit, factor)."""
    delimiter = draw(st.sampled_from([",", ";", "\t", "|"]))
    decimal = draw(st.sampled_from([".", "."] if delimiter == "," else [".", ","]))
    thousands = draw(st.sampled_from([None, None, "'", "." if decimal == "," else ","]))
    thousands = None if thousands == delimiter else thousands
    numbers = st.decimals(-99999, 99999, places=draw(st.integers(0, 5)))
    rows = draw(st.lists(st.tuples(numbers, numbers), min_size=2, max_size=12))

    def shown(value):
        text = f"{value:,}" if thousands and draw(st.booleans()) else f"{value}"
        text = text.replace(",", "T").replace(".", decimal).replace("T", thousands or "")
        return f'"{text}"' if draw(st.integers(0, 9)) == 0 else text

    lines = [delimiter.join(["t", "q", "x"])]
    for i, (q, x) in enumerate(rows):
        cells = [f"{i}", shown(q), shown(x)]
        if draw(st.integers(0, 5)) == 0:
            cells[draw(st.integers(1, 2))] = draw(
                st.sampled_from(
                    ["", "nan", "n/a", "1.5", "1,5", "1 5", "x", "1e3", "-", "0x1", "1_0"]
                )
            )
        if draw(st.integers(0, 15)) == 0:
            cells.insert(draw(st.integers(0, 3)), draw(st.sampled_from(["", "7", "#"])))
        if draw(st.integers(0, 15)) == 0:
            cells.pop()
        lines.append(delimiter.join(cells))
    form = f"delimiter: '{delimiter}', decimal: '{decimal}'"
    form = form.replace("'\t'", '"\\t"') + (f', thousands: "{thousands}"' if thousands else "")
    unit, factor = draw(st.sampled_from([("rad", 1.0), ("turn", 2 * np.pi), ("mrad", 1e-3)]))
    return "\n".join(lines) + "\n", (delimiter, decimal, thousands), form, unit, factor


MAPPING = """
name: rig
csv: {%s, missing: [n/a]}
clocks: {pc: {column: t}}
channels:
  /winches/state: {position/surge: {column: q, unit: %s}}
"""


def independent(text, marks):
    """Rows (stamp, number) of a table by csv and Decimal; None where it is none."""
    delimiter, decimal, thousands = marks
    found = []
    for number, line in enumerate(text.splitlines()[1:]):
        line = line.split("#")[0]
        if not line.strip():
            continue
        cells = next(csv.reader([line], delimiter=delimiter))
        if len(cells) < 3 or any(cell.strip() for cell in cells[3:]):
            return None
        try:
            stamp, value = (_number(cell, decimal, thousands) for cell in cells[:2])
        except (ValueError, InvalidOperation):
            return None
        if stamp is None or value is None:
            continue
        found.append((stamp, value, number))
    return found


def _number(cell, decimal, thousands):
    cell = cell.strip()
    if cell in ("", "n/a", "nan"):
        return None
    if thousands:
        whole, mark, rest = cell.partition(decimal)
        groups = whole.lstrip("+-").split(thousands)
        if len(groups) > 1 and (
            not all(len(group) == 3 and group.isdigit() for group in groups[1:])
            or not 1 <= len(groups[0]) <= 3
            or groups[0].startswith("0")
        ):
            raise ValueError
        cell = whole.replace(thousands, "") + mark + rest
    if "_" in cell or "x" in cell.lower() or (decimal == "," and "." in cell):
        raise ValueError
    return float(Decimal(cell.replace(decimal, ".")))


@FUZZ
@given(tables())
def test_any_table_is_refused_or_read_as_by_another_reader(tmp_path_factory, table):
    text, marks, form, unit, factor = table
    path = tmp_path_factory.mktemp("fuzz") / "a.csv"
    path.write_text(text, encoding="utf-8")
    found = outcome(path, MAPPING % (form, unit))
    if is_refused(found):
        return
    expected = independent(text, marks)
    assert expected is not None
    assert found.stamps[STATE].tolist() == [round(stamp * 1e9) for stamp, _, _ in expected]
    values = [value * factor for _, value, _ in expected]
    assert found.rows[STATE][:, 0].tolist() == pytest.approx(values, rel=1e-12, abs=1e-12)


@pytest.fixture(scope="module")
def lab_bag(tmp_path_factory):
    """A bag of 60 messages in chunks that carry a CRC, and its numbers by stamp."""
    path = tmp_path_factory.mktemp("bag") / "a.mcap"
    numbers = {EPOCH_NS + i * STEP_NS: 0.01 * i for i in range(60)}
    messages = [(t, "/js", joints(t, ["surge"], [q])) for t, q in numbers.items()]
    bag(path, messages, chunk=1500, compression=CompressionType.ZSTD)
    return path.read_bytes(), numbers


BAG = """
name: rig
channels:
  /winches/state: {position/surge: {column: '/js:position[surge]', unit: rad}}
"""
DAMAGE = st.tuples(
    st.floats(0.0, 1.0),
    st.sampled_from(["cut", "zeros", "flip", "insert", "remove"]),
    st.integers(1, 64),
    st.integers(1, 255),
)


@FUZZ
@given(damages=st.lists(DAMAGE, min_size=1, max_size=3))
def test_any_damaged_bag_is_refused_or_gives_what_was_recorded(tmp_path_factory, lab_bag, damages):
    content, numbers = bytearray(lab_bag[0]), lab_bag[1]
    for share, kind, length, flip in damages:
        at = int(share * len(content))
        if kind == "cut":
            del content[at:]
        elif kind == "remove":
            del content[at : at + length]
        elif kind == "insert":
            content[at:at] = bytes(length)
        else:
            part = content[at : at + length]
            content[at : at + length] = bytes(b ^ flip if kind == "flip" else 0 for b in part)
    path = tmp_path_factory.mktemp("fuzz") / "a.mcap"
    path.write_bytes(content)
    found = outcome(path, BAG)
    if not is_refused(found):
        got = zip(found.stamps[STATE].tolist(), found.rows[STATE][:, 0].tolist(), strict=True)
        assert {(stamp, numbers.get(stamp)) for stamp, _ in got} <= set(numbers.items())
        assert [numbers[t] for t in found.stamps[STATE].tolist()] == found.rows[STATE][
            :, 0
        ].tolist()


KEYS = ["name", "csv", "clocks", "channels", "nan", "unpaired", "pairing", "drop", "column", "rate"]
KEYS += [
    "stamp",
    "unit",
    "wrap",
    "points",
    "skew",
    "offset",
    "disorder",
    "constant",
    "sign",
    "scale",
]
KEYS += ["invalid", "spikes", "jumps", "clock", "names", "thousands", "pc", "position/surge", STATE]
SCALARS = st.one_of(
    st.none(),
    st.booleans(),
    st.integers(-(2**70), 2**70),
    st.floats(allow_nan=True, allow_infinity=True),
    st.text(max_size=6),
    st.sampled_from(
        ["t", "q", "rad", "s", "ms", "drop", "keep", "mask", "join", "iso8601", "datenum"]
    ),
)
NODES = st.recursive(
    SCALARS,
    lambda inner: st.one_of(
        st.lists(inner, max_size=3), st.dictionaries(st.sampled_from(KEYS), inner, max_size=3)
    ),
    max_leaves=6,
)


@FUZZ
@given(key=st.sampled_from(KEYS), node=NODES, place=st.integers(0, 3))
def test_any_mapping_is_refused_in_one_line_or_read(tmp_path_factory, key, node, place):
    channel = {"column": "q", "unit": "rad"}
    clock = {"column": "t"}
    mapping = {
        "name": "rig",
        "clocks": {"pc": clock},
        "channels": {STATE: {"position/surge": channel}},
    }
    (mapping, clock, channel, mapping["channels"][STATE])[place][key] = node
    path = tmp_path_factory.mktemp("fuzz") / "a.csv"
    rows = [f"{0.01 * i:.2f},{np.sin(0.1 * i):.4f}" for i in range(40)]
    path.write_text("t,q\n" + "\n".join(rows) + "\n", encoding="utf-8")
    found = outcome(path, json.dumps(mapping))
    assert is_refused(found) or len(found.stamps[STATE]) <= 40
