"""Taking a topic's messages from the middleware and reading their rows, compiled.

All of it is in one file: numba compiles a function anew when its own file changes, but not when
another does from which it took in a function.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from llvmlite import ir
from numba import njit, types
from numba.extending import intrinsic
from numpy.typing import NDArray

from cspm_msgs_py.wire import UNIT_LENGTH_TOLERANCE

Words = NDArray[np.int64]
Bits = NDArray[np.uint64]
Array = NDArray[np.float64]

# Places in `form`, which says how to take a topic's messages and what stands where in them.
TAKE, SUBSCRIPTION, MESSAGE, INFO, BUFFER, SIZE, SECONDS, QUATERNION = range(8)
# Places in `state`, the words that the middleware writes beside the content.
FOUND_BUFFER, FOUND_LENGTH, FOUND_RECEIVED, FOUND_NUMBER, FOUND_GID = 0, 1, 9, 10, 13
# Places in `found` and `due`: stamp [ns], sender's number, and from one stamp to the next [ns].
STAMP, NUMBER, STEP = range(3)
UNKNOWN = -1  # number of a middleware that counts nothing
# How a look ends, beside an error's code: an intact message was taken, nothing was there, or a
# malformed one lies in the buffer.
TAKEN, NOTHING, STRANGE = 0, 401, -1

_NANOSECONDS = 1_000_000_000
# Who is near the limit gets a second look: rounding must not decide between two readers.
_NEARLY = 0.5 * UNIT_LENGTH_TOLERANCE


@intrinsic
def _take(_context: Any, function: Any, subscription: Any, message: Any, info: Any) -> Any:  # noqa: ANN401 - numba's types
    """Call `rcl_take_serialized_message` by address: of ctypes' functions numba caches nothing."""

    def generate(_context: Any, builder: Any, _signature: Any, arguments: Any) -> Any:  # noqa: ANN401 - llvmlite's
        word = ir.IntType(64)
        kind = ir.FunctionType(ir.IntType(32), [word] * 4).as_pointer()
        called = builder.inttoptr(arguments[0], kind)
        return builder.call(called, [*arguments[1:], ir.Constant(word, 0)])

    return types.int32(*[types.int64] * 4), generate


@njit(cache=True)
def take_row(
    form: Words,
    state: Words,
    content: Bits,
    same: Bits,
    places: Words,
    found: Words,
    row: Array,
) -> int:
    """Take a message; read it if it is intact and has the contract's own bytes.

    Args:
        form: addresses to call and to write to, and the form of the topic's messages, (8,).
        state: what the middleware writes beside the content, (n,).
        content: the buffer that it writes a message to, (m,).
        same: which of these bits all messages share, and what they are, (2, m).
        places: where in it the row's numbers begin, in half words, (width,).
        found: takes stamp and number, (2,) or more.
        row: takes the row, (width,).

    Returns:
        how it ended.
    """
    code = _take(form[TAKE], form[SUBSCRIPTION], form[MESSAGE], form[INFO])
    if code != TAKEN:
        return int(code)
    # A message that is longer than the buffer was made to move it.
    if state[FOUND_BUFFER] != form[BUFFER] or state[FOUND_LENGTH] != form[SIZE]:
        return STRANGE
    halves = content.view(np.uint32)
    seconds = np.int64(np.int32(halves[form[SECONDS]]))
    nanoseconds = np.int64(halves[form[SECONDS] + 1])
    if seconds < 0 or nanoseconds >= _NANOSECONDS:
        return STRANGE
    for i in range(same.shape[1]):
        if content[i] & same[0, i] != same[1, i]:
            return STRANGE
    # CDR aligns numbers to 4 bytes of the buffer only: they are copied by halves.
    copied = row.view(np.uint32)
    for i in range(len(places)):
        copied[2 * i] = halves[places[i]]
        copied[2 * i + 1] = halves[places[i] + 1]
    if not _is_valid(row, form[QUATERNION] != 0):
        return STRANGE
    found[STAMP] = seconds * _NANOSECONDS + nanoseconds
    found[NUMBER] = state[FOUND_NUMBER]
    return TAKEN


@njit(cache=True)
def take_rows(
    form: Words,
    state: Words,
    content: Bits,
    same: Bits,
    places: Words,
    found: Words,
    due: Words,
    rows: Array,
) -> tuple[int, int]:
    """Take messages as `take_row` while each is the next one that is due.

    Args:
        form: this and the next five as in `take_row`.
        state: likewise.
        content: likewise.
        same: likewise.
        places: likewise.
        found: likewise.
        due: stamp and number of the first, and from stamp to stamp, (3,); moves on with them.
        rows: takes their rows, (most, width).

    Returns:
        how many were taken so, and how that ended.
    """
    for count in range(len(rows)):
        row = rows[count]
        end = take_row(form, state, content, same, places, found, row)
        if end != TAKEN:
            return count, end
        if found[STAMP] != due[STAMP] or found[NUMBER] not in (due[NUMBER], UNKNOWN):
            return count, STRANGE
        due[STAMP] += due[STEP]
        due[NUMBER] += 1
    return len(rows), TAKEN


@njit(cache=True)
def take_own_rows(
    form: Words,
    state: Words,
    content: Bits,
    same: Bits,
    places: Words,
    found: Words,
    own: Words,
    times: Words,
    rows: Array,
) -> tuple[int, int]:
    """Take messages as `take_row` while each is the next one of one publisher.

    Args:
        form: this and the next five as in `take_row`.
        state: likewise.
        content: likewise.
        same: likewise.
        places: likewise.
        found: likewise.
        own: the publisher's identity and its next number, (3,); moves on with them.
        times: takes their stamps and times of reception [ns], (most, 2).
        rows: takes their rows, (most, width).

    Returns:
        how many were taken so, and how that ended.
    """
    for count in range(len(rows)):
        end = take_row(form, state, content, same, places, found, rows[count])
        if end != TAKEN:
            return count, end
        known = state[FOUND_GID] == own[0] and state[FOUND_GID + 1] == own[1]
        if not known or found[NUMBER] != own[2]:
            return count, STRANGE
        times[count, 0] = found[STAMP]
        times[count, 1] = state[FOUND_RECEIVED]
        own[2] += 1
    return len(rows), TAKEN


@njit(cache=True)
def _is_valid(row: Array, has_pose: bool) -> bool:
    """Return whether all is finite and the quaternion behind a position, if any, of length 1."""
    for number in row:
        if not math.isfinite(number):
            return False
    if not has_pose:
        return True
    squares = row[3] * row[3] + row[4] * row[4] + row[5] * row[5] + row[6] * row[6]
    return abs(math.sqrt(squares) - 1.0) <= _NEARLY
