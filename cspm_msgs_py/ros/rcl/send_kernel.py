"""Writing a topic's row into a message and sending it, compiled."""

from __future__ import annotations

from typing import Any

import numpy as np
from llvmlite import ir
from numba import njit, types
from numba.extending import intrinsic
from numpy.typing import NDArray

Words = NDArray[np.int64]
Array = NDArray[np.float64]
Halves = NDArray[np.uint32]

# Places in `form`: addresses of rcl's function, publisher and message, and where the stamp is.
PUBLISH, PUBLISHER, MESSAGE, SECONDS, FORM = range(5)
SENT = 0

_NANOSECONDS = 1_000_000_000


@intrinsic
def _publish(_context: Any, function: Any, publisher: Any, message: Any) -> Any:  # noqa: ANN401 - numba's types
    """Call `rcl_publish_serialized_message` by address, as `take_kernel` does."""

    def generate(_context: Any, builder: Any, _signature: Any, arguments: Any) -> Any:  # noqa: ANN401 - llvmlite's
        word = ir.IntType(64)
        kind = ir.FunctionType(ir.IntType(32), [word] * 3).as_pointer()
        called = builder.inttoptr(arguments[0], kind)
        return builder.call(called, [*arguments[1:], ir.Constant(word, 0)])

    return types.int32(*[types.int64] * 3), generate


_ARRAYS = types.int64[::1], types.uint32[::1], types.int64[::1]
SIGNATURE = types.int64(*_ARRAYS, types.int64, types.float64[::1])


@njit(cache=True)
def send_row(form: Words, content: Halves, places: Words, stamp_ns: int, row: Array) -> int:
    """Write stamp and row into a message that holds all else, and send it.

    Args:
        form: addresses to call, and the place of the stamp, in half words, (4,).
        content: the message's buffer, (m,).
        places: where in it the row's numbers begin, in half words, (width,).
        stamp_ns: of the row [ns].
        row: (width,).

    Returns:
        what rcl returns, `SENT` for none of its errors.
    """
    seconds = stamp_ns // _NANOSECONDS
    content[form[SECONDS]] = np.uint32(seconds)
    content[form[SECONDS] + 1] = np.uint32(stamp_ns - seconds * _NANOSECONDS)
    # CDR aligns numbers to 4 bytes of the buffer only: they are copied by halves.
    copied = row.view(np.uint32)
    for i in range(len(places)):
        content[places[i]] = copied[2 * i]
        content[places[i] + 1] = copied[2 * i + 1]
    return int(_publish(form[PUBLISH], form[PUBLISHER], form[MESSAGE]))
