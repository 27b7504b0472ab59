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
Kernel = Callable[[Array, Array], None]

POINTER = types.CPointer(types.float64)
SIGNATURE = types.void(POINTER, POINTER)

_interpreted: dict[int, Kernel] = {}


@cache
def kernel_address(kernel: Kernel) -> int:
    """Compile `kernel(parameters, signals)` and return its address.

    With compilation switched off (NUMBA_DISABLE_JIT=1) the address stands for the Python function.
    """
    if config.DISABLE_JIT:
        _interpreted[id(kernel)] = kernel
        return id(kernel)
    return int(cfunc(SIGNATURE, cache=True)(kernel).address)


def _array_data(context: BaseContext, builder: ir.IRBuilder, kind: Any, value: Any) -> Any:  # noqa: ANN401
    return make_array(kind)(context, builder, value).data


@intrinsic
def _call_compiled(typingctx: Any, address: Any, parameters: Any, signals: Any) -> Any:  # noqa: ANN401
    def codegen(context: BaseContext, builder: ir.IRBuilder, signature: Any, args: Any) -> Any:  # noqa: ANN401
        data = [
            _array_data(context, builder, kind, value)
            for kind, value in zip(signature.args[1:], args[1:], strict=True)
        ]
        pointer = context.get_value_type(POINTER)
        function_type = ir.FunctionType(ir.VoidType(), [pointer, pointer])
        builder.call(builder.inttoptr(args[0], function_type.as_pointer()), data)
        return context.get_dummy_value()

    return types.void(types.int64, parameters, signals), codegen


def _call_interpreted(address: int, parameters: Array, signals: Array) -> None:
    _interpreted[address](parameters, signals)


call_kernel = _call_interpreted if config.DISABLE_JIT else _call_compiled
