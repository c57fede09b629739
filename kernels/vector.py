"""Eight doubles at once: a numba type that holds a vector register, for loops that do not vectorise by themselves.

Sums, differences, products and quotients of vectors, and of a vector and a number, are the operators; the rest is here.
Vectors live in flat arrays from `aligned`, eight doubles a place. Interpreted (NUMBA_DISABLE_JIT=1) a vector is a numpy
array of eight. Uses numba's documented extension points, and its templates of operators, which are next to them.
"""

import operator
from collections.abc import Callable
from typing import Any

import numba
import numpy as np
from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.core.typing.templates import ConcreteTemplate, infer_global, signature
from numba.extending import intrinsic, lower_builtin, models, register_model

from towatlas.kernels.compiling import helper

LANES = 8  # sixteen spill registers, four leave half of AVX-512 idle
_BYTES = 8 * LANES
_INTERPRETED = bool(numba.config.DISABLE_JIT)  # type: ignore[attr-defined]
_LLVM = ir.VectorType(ir.DoubleType(), LANES)
# As the other kernels: fused multiply-adds, and nothing else that changes a result.
_CONTRACT = ("contract",)


class _Vector(types.Type):
    def __init__(self) -> None:
        super().__init__(name=f"Vector{LANES}")


_vector = _Vector()


@register_model(_Vector)
class _Model(models.PrimitiveModel):
    def __init__(self, manager: Any, kind: Any):
        super().__init__(manager, kind, _LLVM)


def _spread(builder: Any, value: Any) -> Any:
    nothing = ir.Constant(_LLVM, ir.Undefined)
    first = builder.insert_element(nothing, value, ir.Constant(ir.IntType(32), 0))
    return builder.shuffle_vector(first, nothing, ir.Constant(ir.VectorType(ir.IntType(32), LANES), [0] * LANES))


def _as_vector(context: Any, builder: Any, kind: Any, value: Any) -> Any:
    if kind == _vector:
        return value
    return _spread(builder, context.cast(builder, value, kind, types.float64))


def _declare(key: Any, instruction: str) -> None:
    """An operator of two vectors, or of a vector and a number."""
    pairs = [(_vector, _vector), (_vector, types.float64), (types.float64, _vector)]

    class Template(ConcreteTemplate):
        cases = [signature(_vector, *pair) for pair in pairs]  # noqa: RUF012

    infer_global(key)(Template)

    def lower(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        a, b = (_as_vector(context, builder, *pair) for pair in zip(sig.args, args, strict=True))
        return getattr(builder, instruction)(a, b, flags=_CONTRACT)

    for pair in pairs:
        lower_builtin(key, *pair)(lower)


for _name, _instruction in (("add", "fadd"), ("sub", "fsub"), ("mul", "fmul"), ("truediv", "fdiv")):
    _declare(getattr(operator, _name), _instruction)
    _declare(getattr(operator, f"i{_name}"), _instruction)


class _Negative(ConcreteTemplate):
    cases = [signature(_vector, _vector)]  # noqa: RUF012


infer_global(operator.neg)(_Negative)


@lower_builtin(operator.neg, _vector)
def _negative(context: Any, builder: Any, sig: Any, args: Any) -> Any:
    return builder.fneg(args[0])


def _function(name: str) -> Callable:
    """Lowers to an intrinsic of LLVM's of one vector."""

    def lower(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        kind = ir.FunctionType(_LLVM, [_LLVM])
        return builder.call(cgutils.get_or_insert_function(builder.module, kind, f"llvm.{name}.v{LANES}f64"), args)

    return lower


def _pointer(context: Any, builder: Any, kind: Any, array: Any, first: Any) -> Any:
    data = context.make_array(kind)(context, builder, array).data
    return builder.bitcast(builder.gep(data, [first]), _LLVM.as_pointer())


@intrinsic
def _sqrt(typing_context: Any, a: Any) -> Any:
    return _vector(_vector), _function("sqrt")


@intrinsic
def _absolute(typing_context: Any, a: Any) -> Any:
    return _vector(_vector), _function("fabs")


@intrinsic
def _broadcast(typing_context: Any, a: Any) -> Any:
    return _vector(types.float64), lambda context, builder, sig, args: _spread(builder, args[0])


def _loads(each: int) -> Any:
    """Loads a vector from a place, of so many doubles."""

    def load(typing_context: Any, array: Any, place: Any) -> Any:
        def lower(context: Any, builder: Any, sig: Any, args: Any) -> Any:
            index = context.cast(builder, args[1], sig.args[1], types.int64)
            first = builder.mul(index, ir.Constant(index.type, each))
            loaded = builder.load(_pointer(context, builder, sig.args[0], args[0], first))
            # Where none is aligned, loads are twice as slow.
            loaded.align = _BYTES // LANES * each
            return loaded

        return _vector(array, place), lower

    return intrinsic(load)


def _stores(each: int) -> Any:
    def store(typing_context: Any, array: Any, place: Any, value: Any) -> Any:
        def lower(context: Any, builder: Any, sig: Any, args: Any) -> Any:
            index = context.cast(builder, args[1], sig.args[1], types.int64)
            first = builder.mul(index, ir.Constant(index.type, each))
            made = _as_vector(context, builder, sig.args[2], args[2])
            stored = builder.store(made, _pointer(context, builder, sig.args[0], args[0], first))
            stored.align = _BYTES // LANES * each
            return context.get_dummy_value()

        return types.none(array, place, value), lower

    return intrinsic(store)


@intrinsic
def _where_less(typing_context: Any, a: Any, b: Any, x: Any, y: Any) -> Any:
    def lower(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        a, b, x, y = (_as_vector(context, builder, *pair) for pair in zip(sig.args, args, strict=True))
        return builder.select(builder.fcmp_ordered("<", a, b), x, y)

    return _vector(a, b, x, y), lower


def _interpreted_load(array: Any, first: int) -> Any:
    return array[first : first + LANES].copy()


def _interpreted_store(array: Any, first: int, value: Any) -> None:
    array[first : first + LANES] = value


# load(array, place), store(array, place, value), broadcast(number), square_root(a), absolute(a),
# where_less(a, b, x, y): x where a < b, else y, as with a nan. load_from, store_from: from any double on.
load: Any = (lambda array, place: _interpreted_load(array, LANES * place)) if _INTERPRETED else _loads(LANES)
store: Any = (
    (lambda array, place, value: _interpreted_store(array, LANES * place, value)) if _INTERPRETED else _stores(LANES)
)
load_from: Any = _interpreted_load if _INTERPRETED else _loads(1)
store_from: Any = _interpreted_store if _INTERPRETED else _stores(1)
broadcast: Any = (lambda value: np.full(LANES, value)) if _INTERPRETED else _broadcast
square_root: Any = np.sqrt if _INTERPRETED else _sqrt
absolute: Any = np.abs if _INTERPRETED else _absolute
where_less: Any = (lambda a, b, x, y: np.where(np.less(a, b), x, y)) if _INTERPRETED else _where_less


@helper
def aligned(places):
    """Room for so many vectors, zero."""
    room = np.zeros(LANES * (places + 1))
    first = (-(room.ctypes.data >> 3)) & (LANES - 1)
    return room[first : first + LANES * places]
