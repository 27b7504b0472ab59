"""The records of rows in a chunk's content, laid down in compiled code."""

from __future__ import annotations

from typing import Any

import numpy as np
from llvmlite import ir
from numba import config, njit, types
from numba.core.cgutils import raw_memcpy
from numba.extending import intrinsic
from numba.np.arrayobj import make_array
from numpy.typing import NDArray

Bytes = NDArray[np.uint8]
Words = NDArray[np.int64]

# Columns of `forms`: messages, bytes of a payload, offset of its stamp, first and number of runs.
COUNT, SIZE, STAMP, FIRST_RUN, RUNS, COLUMNS = range(6)


@intrinsic
def _copy_compiled(
    _context: Any,  # noqa: ANN401 - numba's types
    out: Any,  # noqa: ANN401
    at: Any,  # noqa: ANN401
    source: Any,  # noqa: ANN401
    first: Any,  # noqa: ANN401
    count: Any,  # noqa: ANN401
) -> Any:  # noqa: ANN401
    """Call memcpy: loops over bytes take 16 times as long, slices 10 times."""

    def generate(context: Any, builder: ir.IRBuilder, signature: Any, arguments: Any) -> Any:  # noqa: ANN401
        to, at, source, first, count = arguments
        kinds = signature.args
        to = builder.gep(make_array(kinds[0])(context, builder, to).data, [at])
        source = builder.gep(make_array(kinds[2])(context, builder, source).data, [first])
        raw_memcpy(builder, to, source, count, 1)
        return context.get_dummy_value()

    return types.void(out, at, source, first, count), generate


def _copy_interpreted(out: Bytes, at: int, source: Bytes, first: int, count: int) -> None:
    out[at : at + count] = source[first : first + count]


_copy = _copy_interpreted if config.DISABLE_JIT else _copy_compiled


_BYTES, _READ_ONLY = types.uint8[::1], types.Array(types.uint8, 1, "C", readonly=True)
_TABLE = types.int64[:, ::1]


@njit(
    types.void(_BYTES, types.int64[::1], _BYTES, _BYTES, _READ_ONLY, _TABLE, _TABLE, _BYTES),
    cache=True,
    nogil=True,
    _nrt=False,
)
def place_rows(
    out: Bytes,
    starts: Words,
    heads: Bytes,
    stamps: Bytes,
    numbers: Bytes,
    forms: Words,
    runs: Words,
    templates: Bytes,
) -> None:
    """Write the records of all channels that carry rows.

    Args:
        out: the content, shape (size,).
        starts: offset of each record, channel after channel, shape (n,).
        heads: what precedes each payload, one after another, shape (n·prefix,).
        stamps: seconds and nanoseconds of each stamp, shape (8·n,).
        numbers: the rows' float64, one after another.
        forms: a row per channel, see `COUNT`.
        runs: offset in the payload and bytes of each unbroken run of numbers, shape (m, 2).
        templates: the channels' payloads with stamp and numbers zero, one after another.
    """
    prefix = len(heads) // max(1, len(starts))
    message = read = template = 0
    for k in range(len(forms)):
        size, first = forms[k, SIZE], forms[k, FIRST_RUN]
        for _ in range(forms[k, COUNT]):
            at = starts[message]
            _copy(out, at, heads, prefix * message, prefix)
            at += prefix
            _copy(out, at, templates, template, size)
            _copy(out, at + forms[k, STAMP], stamps, 8 * message, 8)
            for run in range(first, first + forms[k, RUNS]):
                _copy(out, at + runs[run, 0], numbers, read, runs[run, 1])
                read += runs[run, 1]
            message += 1
        template += size
