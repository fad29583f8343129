"""Smaller and larger of two numbers in compiled loops, as vector instructions.

Python's `min` and `max` become branches there, which are not vectorized.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from llvmlite import ir
from numba import types
from numba.extending import intrinsic

if TYPE_CHECKING:

    def smaller(first: float, second: float) -> float:
        """Return the smaller of two floats, neither NaN, in compiled functions."""

    def larger(first: float, second: float) -> float:
        """Return the larger of two floats, neither NaN, in compiled functions."""

else:

    def _of_llvm(name: str) -> Any:
        def typed(_context: Any, first: Any, second: Any) -> tuple[Any, Any]:
            def code(_target: Any, builder: Any, _signature: Any, args: Any) -> Any:
                kind = ir.FunctionType(args[0].type, [args[0].type] * 2)
                intrinsic = builder.module.declare_intrinsic(name, [args[0].type], kind)
                return builder.call(intrinsic, args, fastmath=("nnan", "nsz"))

            both = types.float32 if first == second == types.float32 else types.float64
            return both(both, both), code

        return intrinsic(typed)

    smaller, larger = _of_llvm("llvm.minnum"), _of_llvm("llvm.maxnum")
