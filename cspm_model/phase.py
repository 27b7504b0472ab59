"""One part of a simulation step as compiled code: a function of a row of signals and of places.

All phases have one signature, so that a compiled loop steps any of them, in any order, by address:
`phase(step, row, places) -> code`. `row` holds every signal of the present instant, `places` are
the addresses and shapes of the arrays that the phase works on. Those belong to Python objects,
which find them changed: loop and objects may take turns at every step.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np
from numba import types
from numpy.typing import NDArray

from cspm_model.kernels.native import address_of, places_of

Places = NDArray[np.int64]

PHASE = types.int64(types.int64, types.float64[::1], types.int64[::1])
# What a phase returns: it is done; it did nothing, its Python object is to do it; it is done, its
# Python object is to look at what came of it.
DONE, LEAVE, LOOK = 0, 1, 2


def _nothing() -> None:
    pass


def _always() -> bool:
    return True


@dataclass
class Phase:
    """A compiled phase of one object.

    Attributes:
        kernel: the `njit` function.
        places: addresses and shapes of the arrays, as the kernel reads them.
        arrays: what the kernel reads and writes, kept while the phase is.
        ready: whether the kernel may go on where the object is now.
        refresh: brings the arrays up to date with the object.
        room: given a step, returns from which step on Python has to prepare something anew.
        parts: phases that the kernel calls, kept while this one is.
    """

    kernel: Any
    places: Places
    arrays: tuple[NDArray[Any], ...]
    ready: Callable[[], bool] = _always
    refresh: Callable[[], None] = _nothing
    room: Callable[[int], int] | None = None
    parts: tuple[Phase, ...] = ()

    @cached_property
    def address(self) -> int:
        """The kernel's address."""
        return address_of(self.kernel, PHASE)


def make_phase(kernel: Any, *arrays: NDArray[Any], **more: Any) -> Phase:  # noqa: ANN401
    """Return a phase that works on these arrays; `more` are the other attributes."""
    return Phase(kernel, places_of(arrays), arrays, **more)


@dataclass
class Slots:
    """Where each signal is in the row.

    Attributes:
        width: of the row so far.
    """

    width: int = 0
    _found: dict[str, slice] = field(default_factory=dict)

    def add(self, widths: Mapping[str, int]) -> None:
        """Give signals of these widths their places."""
        for name, width in widths.items():
            self._found[name] = slice(self.width, self.width + width)
            self.width += width

    def __contains__(self, name: str) -> bool:
        return name in self._found

    def __getitem__(self, name: str) -> slice:
        return self._found[name]

    def first(self, name: str) -> int:
        """Return the first column of a signal, −1 where there is none of this name."""
        return self._found[name].start if name in self._found else -1
