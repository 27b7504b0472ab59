"""Calling an effect's compiled kernel by its address.

The plant is compiled once; which effects act is data: addresses, elements and parameters. So a new
effect, even one outside this package, needs no change and no recompilation of the plant.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from typing import Any

from llvmlite import ir
from numba import cfunc, config, types
from numba.core.base import BaseContext
from numba.extending import intrinsic
from numba.np.arrayobj import make_array
from numpy import float64
from numpy.typing import NDArray

Array = NDArray[float64]
# Of parameters and signals; with memory also of its states and their rates.
Kernel = Callable[..., None]

POINTER = types.CPointer(types.float64)
SIGNATURE = types.void(POINTER, POINTER)
SIGNATURE_WITH_STATES = types.void(POINTER, POINTER, POINTER, POINTER)

_interpreted: dict[int, Kernel] = {}


@cache
def kernel_address(kernel: Kernel, has_states: bool) -> int:
    """Compile a kernel and return its address.

    It is `kernel(parameters, signals)`, or `kernel(parameters, signals, states, rates)` where it
    has states. With compilation switched off (NUMBA_DISABLE_JIT=1) the address is that of the
    Python function.
    """
    if config.DISABLE_JIT:
        _interpreted[id(kernel)] = kernel
        return id(kernel)
    signature = SIGNATURE_WITH_STATES if has_states else SIGNATURE
    return int(cfunc(signature, cache=True)(kernel).address)


def _array_data(context: BaseContext, builder: ir.IRBuilder, kind: Any, value: Any) -> Any:  # noqa: ANN401
    return make_array(kind)(context, builder, value).data


def _call(context: BaseContext, builder: ir.IRBuilder, address: Any, data: list[Any]) -> Any:  # noqa: ANN401
    pointer = context.get_value_type(POINTER)
    function_type = ir.FunctionType(ir.VoidType(), [pointer] * len(data))
    builder.call(builder.inttoptr(address, function_type.as_pointer()), data)
    return context.get_dummy_value()


@intrinsic
def _call_compiled(typingctx: Any, address: Any, parameters: Any, signals: Any) -> Any:  # noqa: ANN401
    def codegen(context: BaseContext, builder: ir.IRBuilder, signature: Any, args: Any) -> Any:  # noqa: ANN401
        data = [
            _array_data(context, builder, kind, value)
            for kind, value in zip(signature.args[1:], args[1:], strict=True)
        ]
        return _call(context, builder, args[0], data)

    return types.void(types.int64, parameters, signals), codegen


@intrinsic
def _call_compiled_with_states(
    typingctx: Any,  # noqa: ANN401
    address: Any,  # noqa: ANN401
    parameters: Any,  # noqa: ANN401
    signals: Any,  # noqa: ANN401
    state: Any,  # noqa: ANN401
    rate: Any,  # noqa: ANN401
    first: Any,  # noqa: ANN401
) -> Any:  # noqa: ANN401
    def codegen(context: BaseContext, builder: ir.IRBuilder, signature: Any, args: Any) -> Any:  # noqa: ANN401
        data = [
            _array_data(context, builder, kind, value)
            for kind, value in zip(signature.args[1:5], args[1:5], strict=True)
        ]
        data[2:] = [builder.gep(pointer, [args[5]]) for pointer in data[2:]]
        return _call(context, builder, args[0], data)

    return types.void(types.int64, parameters, signals, state, rate, types.int64), codegen


def _call_interpreted(address: int, parameters: Array, signals: Array) -> None:
    _interpreted[address](parameters, signals)


def _call_interpreted_with_states(
    address: int, parameters: Array, signals: Array, state: Array, rate: Array, first: int
) -> None:
    _interpreted[address](parameters, signals, state[first:], rate[first:])


call_kernel = _call_interpreted if config.DISABLE_JIT else _call_compiled
call_kernel_with_states = (
    _call_interpreted_with_states if config.DISABLE_JIT else _call_compiled_with_states
)
