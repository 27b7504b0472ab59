"""In which encoding a text table is written."""

from __future__ import annotations

import gzip
from codecs import BOM_UTF8, BOM_UTF16_BE, BOM_UTF16_LE
from pathlib import Path

from cspm_ident.importing.mapping import CsvFormat
from cspm_msgs_py.errors import InputError

_MARKS = {BOM_UTF8: "utf-8-sig", BOM_UTF16_LE: "utf-16", BOM_UTF16_BE: "utf-16"}
_WIDE = 0.2
"""Share of zero bytes: text in UTF-16 has half, text with some lost to a power cut a few."""
_CONTROL = frozenset(range(1, 32)) - frozenset(b"\t\n\v\f\r\x1a")


def encoding_of(path: Path, form: CsvFormat, *, packed: bool) -> str:
    """Return the encoding of a text: by the mark at its beginning, else as the mapping says."""
    with gzip.open(path) if packed else path.open("rb") as file:
        start = file.read(4)
    said = form.encoding.lower().replace("_", "-")
    for mark, encoding in _MARKS.items():
        if start.startswith(mark) and said in ("utf-8", "utf8", "utf-16"):
            return encoding
    return form.encoding


def refuse_binary(path: Path, start: bytes, form: CsvFormat, inside: str, allowed: str) -> None:
    """Refuse what begins with bytes that no text has.

    Raises:
        InputError: naming what can be read, or the encoding of text that it may be.
    """
    if start.startswith(tuple(_MARKS)) or not form.encoding.lower().startswith("utf-8"):
        return
    zeros = [start[0::2].count(0), start[1::2].count(0)]
    if max(zeros) > _WIDE * len(start) > 8 * min(zeros):
        name = "utf-16-be" if zeros[0] > zeros[1] else "utf-16-le"
        raise InputError(
            f"{path}: text{inside} of two bytes a letter, allowed: csv.encoding: {name}"
        )
    if sum(zeros) > _WIDE * len(start) or any(byte in _CONTROL for byte in start):
        raise InputError(f"{path}: no text{inside}, {allowed}")
