"""Compiled functions and arrays by their addresses.

Compiled code that takes in other compiled functions compiles them anew. A function that is called
by its address is compiled once, whoever calls it, and which one is called is data. So are the
arrays that it works on: it and the Python object that owns them change the same numbers.
"""

from __future__ import annotations

import ctypes
from collections.abc import Callable, Sequence
from functools import cache
from typing import Any

import numpy as np
from llvmlite import ir
from numba import config, types
from numba.core.base import BaseContext
from numba.core.errors import TypingError
from numba.core.typing.templates import Signature
from numba.extending import intrinsic
from numba.np.arrayobj import make_array, populate_array
from numpy.typing import NDArray

Places = NDArray[np.int64]

# Numbers that describe an array: address and up to three extents.
PER_ARRAY = 4
_interpreted: dict[int, Callable[..., Any]] = {}


@cache
def address_of(function: Any, signature: Signature) -> int:  # noqa: ANN401 - numba's dispatcher
    """Return the address of an `njit` function compiled for a signature; see `caller_of`.

    It is looked up once: numba takes 0.1 ms to find what it compiled.

    With compilation switched off (NUMBA_DISABLE_JIT=1) the address is that of the Python function.
    """
    if config.DISABLE_JIT:
        _interpreted[id(function)] = function
        return id(function)
    function.compile(signature)
    compiled = function.overloads[signature.args]
    return int(compiled.library.get_pointer_to_function(compiled.fndesc.llvm_func_name))


def places_of(arrays: Sequence[NDArray[Any]]) -> Places:
    """Return addresses and shapes of arrays, which have to outlive the use of them.

    Raises:
        ValueError: the numbers of one do not lie side by side.
    """
    found = np.zeros((len(arrays), PER_ARRAY), dtype=np.int64)
    for row, array in zip(found, arrays, strict=True):
        if not (array.flags.c_contiguous or array.flags.f_contiguous):
            raise ValueError(f"an array of shape {array.shape} with gaps, allowed: contiguous ones")
        row[0], row[1 : 1 + array.ndim] = array.ctypes.data, array.shape
    return found.ravel()


def caller_of(signature: Signature) -> Any:  # noqa: ANN401 - a function of numba
    """Return what calls a compiled function of a signature: `call(address, *arguments)`.

    The function must not raise.
    """
    if config.DISABLE_JIT:
        return lambda address, *arguments: _interpreted[address](*arguments)

    def codegen(context: BaseContext, builder: ir.IRBuilder, sig: Any, values: Any) -> Any:  # noqa: ANN401
        convention: Any = context.call_conv
        kind = convention.get_function_type(signature.return_type, signature.args)
        function = builder.inttoptr(values[0], kind.as_pointer())
        arguments = values[1]
        unpacked = [builder.extract_value(arguments, i) for i in range(len(signature.args))]
        _, result = convention.call_function(
            builder, function, signature.return_type, signature.args, unpacked
        )
        return result

    @intrinsic
    def call(typingctx: Any, address: Any, *arguments: Any) -> Any:  # noqa: ANN401
        return signature.return_type(types.int64, types.Tuple(signature.args)), codegen

    return call


def caller_returning(kind: Any) -> Any:  # noqa: ANN401 - a function of numba
    """Return what calls a compiled function that returns a type: `call(address, *arguments)`.

    The function is compiled for the types of the arguments, of which arrays are contiguous: for one
    row or column it does not matter in which order. It must not raise.
    """
    if config.DISABLE_JIT:
        return lambda address, *arguments: _interpreted[address](*arguments)

    def codegen(context: BaseContext, builder: ir.IRBuilder, sig: Any, values: Any) -> Any:  # noqa: ANN401
        convention: Any = context.call_conv
        given = sig.args[1].types
        function_type = convention.get_function_type(kind, given)
        function = builder.inttoptr(values[0], function_type.as_pointer())
        unpacked = [builder.extract_value(values[1], i) for i in range(len(given))]
        _, result = convention.call_function(builder, function, kind, given, unpacked)
        return result

    @intrinsic
    def call(typingctx: Any, address: Any, *arguments: Any) -> Any:  # noqa: ANN401
        given = tuple(types.unliteral(each) for each in arguments)
        gaps = [each for each in given if isinstance(each, types.Array) and each.layout == "A"]
        if gaps:
            raise TypingError(f"{gaps[0]} by address, allowed: contiguous arrays")
        return kind(types.int64, types.Tuple(given)), codegen

    return call


def _array_of(dtype: Any, ndim: int, layout: str, *, readonly: bool = False) -> Any:  # noqa: ANN401
    """Return what makes the array that places describe: `at(places, i)` for the i-th."""
    if config.DISABLE_JIT:
        return _interpreted_at(np.dtype(str(dtype)), ndim, layout)
    kind = types.Array(dtype, ndim, layout, readonly=readonly)
    width = np.dtype(str(dtype)).itemsize

    def codegen(context: BaseContext, builder: ir.IRBuilder, sig: Any, values: Any) -> Any:  # noqa: ANN401
        places = make_array(sig.args[0])(context, builder, values[0])
        first = builder.mul(values[1], context.get_constant(types.int64, PER_ARRAY))
        numbers: list[Any] = []
        for i in range(ndim + 1):
            place = builder.add(first, context.get_constant(types.int64, i))
            numbers.append(builder.load(builder.gep(places.data, [place])))
        size: Any = context.get_constant(types.intp, width)
        strides, step = [size] * ndim, size
        for axis in range(ndim) if layout == "F" else reversed(range(ndim)):
            strides[axis] = step
            step = builder.mul(step, numbers[1 + axis])
        array = make_array(kind)(context, builder)
        data = builder.inttoptr(numbers[0], context.get_data_type(dtype).as_pointer())
        populate_array(array, data, numbers[1:], strides, size, None)
        return array._getvalue()

    @intrinsic
    def at(typingctx: Any, places: Any, i: Any) -> Any:  # noqa: ANN401
        return kind(places, types.int64), codegen

    return at


def _interpreted_at(dtype: np.dtype[Any], ndim: int, layout: Any) -> Callable[..., NDArray[Any]]:  # noqa: ANN401
    def at(places: Places, i: int) -> NDArray[Any]:
        address, *shape = places[PER_ARRAY * i : PER_ARRAY * i + 1 + ndim].tolist()
        size = int(np.prod(shape)) * dtype.itemsize
        flat = memoryview((ctypes.c_char * size).from_address(address))
        return np.frombuffer(flat, dtype).reshape(shape, order=layout)

    return at


# Arrays of float64: (n,), (rows, columns) in row order, in row order and not to be written, in
# column order, and (a, b, c); of int64: (n,) and (rows, columns); of bool: (n,).
vector_at = _array_of(types.float64, 1, "C")
matrix_at = _array_of(types.float64, 2, "C")
fixed_matrix_at = _array_of(types.float64, 2, "C", readonly=True)
columns_at = _array_of(types.float64, 2, "F")
cube_at = _array_of(types.float64, 3, "C")
integers_at = _array_of(types.int64, 1, "C")
integer_matrix_at = _array_of(types.int64, 2, "C")
flags_at = _array_of(types.bool_, 1, "C")
