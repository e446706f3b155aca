"""The step loop in machine code: FMU functions by address, values moved between their buffers, rows recorded.

It knows no FMU: `program` writes its tables. All numbers are computed as in `exchange`, in the same order, so that both
give the same bits. The file calls nothing of ours, so that numba sees by its date whether what it keeps is still right.
"""

from __future__ import annotations

from functools import cache
from types import FunctionType
from typing import Any

from llvmlite import ir
from numba import njit, types
from numba.core import cgutils
from numba.extending import intrinsic as _numbas

from ..kernels import compiled_cache

MOVE, VALUES_2, VALUES_3, STEP_2, STEP_3, GIVE, ADD = range(7)
"""Operations: hand values on; set or get of FMI 2, 3; doStep of both; tables given or added."""
OP_WIDTH = 7
DONE = -1
"""In place of an operation: it did not stop within a step."""
F64, F32, I8, I16, I32, I64, U8, U16, U32, BOOL = range(10)
"""Types in memory; 64 bits without sign count as I64, whose bits they share."""
_WARNING = 1
intrinsic: Any = _numbas  # its type keeps the first argument, which numba gives

_BITS = {I8: 8, I16: 16, I32: 32, I64: 64, U8: 8, U16: 16, U32: 32, BOOL: 8}


@intrinsic
def _call(typingctx: Any, function: Any, arguments: Any) -> Any:
    """``int function(pointer or number, ...)``, all arguments in whole registers."""
    count = len(arguments)

    def codegen(context: Any, builder: Any, signature: Any, values: Any) -> Any:
        i64, i32 = ir.IntType(64), ir.IntType(32)
        target = builder.inttoptr(values[0], ir.FunctionType(i32, [i64] * count).as_pointer())
        return builder.call(target, [builder.extract_value(values[1], k) for k in range(count)])

    return types.int32(function, arguments), codegen


@intrinsic
def _call_step_2(typingctx: Any, function: Any, component: Any, time: Any, dt: Any) -> Any:
    """``fmi2DoStep``."""

    def codegen(context: Any, builder: Any, signature: Any, values: Any) -> Any:
        i64, i32, f64 = ir.IntType(64), ir.IntType(32), ir.DoubleType()
        target = builder.inttoptr(values[0], ir.FunctionType(i32, [i64, f64, f64, i32]).as_pointer())
        return builder.call(target, [*values[1:], i32(1)])

    return types.int32(function, component, time, dt), codegen


@intrinsic
def _call_step_3(typingctx: Any, function: Any, component: Any, time: Any, dt: Any, answers: Any) -> Any:
    """``fmi3DoStep``."""

    def codegen(context: Any, builder: Any, signature: Any, values: Any) -> Any:
        i64, i32, f64 = ir.IntType(64), ir.IntType(32), ir.DoubleType()
        target = builder.inttoptr(values[0], ir.FunctionType(i32, [i64, f64, f64, i32, *[i64] * 4]).as_pointer())
        pointers = [builder.extract_value(values[4], k) for k in range(4)]
        return builder.call(target, [*values[1:4], i32(1), *pointers])

    return types.int32(function, component, time, dt, answers), codegen


@intrinsic
def _load_real(typingctx: Any, place: Any, kind: Any) -> Any:
    def codegen(context: Any, builder: Any, signature: Any, values: Any) -> Any:
        f64, f32 = ir.DoubleType(), ir.FloatType()
        result = cgutils.alloca_once(builder, f64)
        with builder.if_else(builder.icmp_signed("==", values[1], values[1].type(F64))) as (double, single):
            with double:
                builder.store(builder.load(builder.inttoptr(values[0], f64.as_pointer())), result)
            with single:
                value = builder.load(builder.inttoptr(values[0], f32.as_pointer()))
                builder.store(builder.fpext(value, f64), result)
        return builder.load(result)

    return types.float64(place, kind), codegen


@intrinsic
def _store_real(typingctx: Any, place: Any, kind: Any, value: Any) -> Any:
    def codegen(context: Any, builder: Any, signature: Any, values: Any) -> Any:
        f64, f32 = ir.DoubleType(), ir.FloatType()
        with builder.if_else(builder.icmp_signed("==", values[1], values[1].type(F64))) as (double, single):
            with double:
                builder.store(values[2], builder.inttoptr(values[0], f64.as_pointer()))
            with single:
                value = builder.fptrunc(values[2], f32)
                builder.store(value, builder.inttoptr(values[0], f32.as_pointer()))
        return context.get_dummy_value()

    return types.void(place, kind, value), codegen


@intrinsic
def _load_integer(typingctx: Any, place: Any, kind: Any) -> Any:
    def codegen(context: Any, builder: Any, signature: Any, values: Any) -> Any:
        i64 = ir.IntType(64)
        result = cgutils.alloca_once_value(builder, i64(0))
        for name, bits in _BITS.items():
            with builder.if_then(builder.icmp_signed("==", values[1], values[1].type(name))):
                value = builder.load(builder.inttoptr(values[0], ir.IntType(bits).as_pointer()))
                signed = name in (I8, I16, I32)
                wide = value if bits == 64 else builder.sext(value, i64) if signed else builder.zext(value, i64)
                builder.store(wide, result)
        return builder.load(result)

    return types.int64(place, kind), codegen


@intrinsic
def _store_integer(typingctx: Any, place: Any, kind: Any, value: Any) -> Any:
    def codegen(context: Any, builder: Any, signature: Any, values: Any) -> Any:
        i64 = ir.IntType(64)
        for name, bits in _BITS.items():
            with builder.if_then(builder.icmp_signed("==", values[1], values[1].type(name))):
                value = values[2]
                if name == BOOL:
                    value = builder.zext(builder.icmp_signed("!=", value, i64(0)), i64)
                value = value if bits == 64 else builder.trunc(value, ir.IntType(bits))
                builder.store(value, builder.inttoptr(values[0], ir.IntType(bits).as_pointer()))
        return context.get_dummy_value()

    return types.void(place, kind, value), codegen


@intrinsic
def _copy(typingctx: Any, target: Any, source: Any, size: Any) -> Any:
    def codegen(context: Any, builder: Any, signature: Any, values: Any) -> Any:
        byte = ir.IntType(8).as_pointer()
        cgutils.raw_memcpy(builder, builder.inttoptr(values[0], byte), builder.inttoptr(values[1], byte), values[2], 1)
        return context.get_dummy_value()

    return types.void(target, source, size), codegen


def _loop(
    ops: Any, moves: Any, scales: Any, tables: Any, clock: Any, at: Any, decimation: int, times: Any, row: Any,
    asked: Any,
) -> int:  # fmt: skip
    """Take steps; see `program.Program.run`.

    Parameters
    ----------
    ops : ndarray of int64, shape (m, OP_WIDTH)
        One communication step: operation and its arguments.
    moves : ndarray of int64, shape (c, 4)
        Address and type of target, address and type of source.
    scales : ndarray of float64, shape (c, 2)
        Factor and offset of each.
    tables : ndarray of int64, shape (t, 3)
        Address of a buffer, address of its table's first row, size of a row [bytes].
    clock : ndarray of float64, shape (2,)
        Start time and step [s].
    at : ndarray of int64, shape (3,)
        Step to begin with, operation of it to begin with, step to end before; afterwards where it stopped (`DONE`).
    decimation : int
        Every n-th communication point is recorded; 0 for none.
    times, row : ndarray
        The recorder's times, and its number of rows, shape (1,).
    asked : ndarray of int32, shape (1,)
        Other than 0 when the user wants to stop: then after the step.

    Returns
    -------
    int
        Status of the operation that it stopped at, or 0.
    """
    start, step = clock[0], clock[1]
    k, first, end = at[0], at[1], at[2]
    while k < end:
        time = start + k * step
        for i in range(first, ops.shape[0]):
            kind, status, ended = ops[i, 0], 0, False
            if kind == MOVE:
                for m in range(ops[i, 1], ops[i, 2]):
                    if moves[m, 1] <= F32:
                        if moves[m, 3] <= F32:
                            value = _load_real(moves[m, 2], moves[m, 3])
                        else:
                            value = float(_load_integer(moves[m, 2], moves[m, 3]))
                        if scales[m, 0] != 1.0 or scales[m, 1] != 0.0:
                            value = scales[m, 0] * value + scales[m, 1]
                        _store_real(moves[m, 0], moves[m, 1], value)
                    else:
                        _store_integer(moves[m, 0], moves[m, 1], _load_integer(moves[m, 2], moves[m, 3]))
            elif kind == VALUES_2:
                status = _call(ops[i, 1], (ops[i, 2], ops[i, 3], ops[i, 4], ops[i, 5]))
            elif kind == VALUES_3:
                status = _call(ops[i, 1], (ops[i, 2], ops[i, 3], ops[i, 4], ops[i, 5], ops[i, 6]))
            elif kind == STEP_2:
                status = _call_step_2(ops[i, 1], ops[i, 2], time, step)
            elif kind == STEP_3:
                answers = (ops[i, 3], ops[i, 4], ops[i, 5], ops[i, 6])
                status = _call_step_3(ops[i, 1], ops[i, 2], time, step, answers)
                ended = _load_integer(ops[i, 4], BOOL) != 0
            elif kind == GIVE:
                _store_real(ops[i, 1], ops[i, 2], _load_real(ops[i, 3] + 8 * k, F64))
            else:
                more = _load_real(ops[i, 3] + 8 * k, F64)
                _store_real(ops[i, 1], ops[i, 2], _load_real(ops[i, 1], ops[i, 2]) + more)
            if status > _WARNING or status < 0 or ended:
                at[0], at[1] = k, i
                return status
        first = 0
        k += 1
        if decimation > 0 and k % decimation == 0:
            r = row[0]
            times[r] = start + k * step
            for t in range(tables.shape[0]):
                _copy(tables[t, 1] + r * tables[t, 2], tables[t, 0], tables[t, 2])
            row[0] = r + 1
        if asked[0] != 0:
            break
    at[0], at[1] = k, DONE
    return 0


_SIGNATURE = types.int64(
    *(types.int64[:, ::1], types.int64[:, ::1], types.float64[:, ::1], types.int64[:, ::1], types.float64[::1]),
    *(types.int64[::1], types.int64, types.float64[::1], types.int64[::1], types.int32[::1]),
)


@cache
def compiled_loop(free: bool) -> Any:
    """`_loop`, compiled; ``free`` gives the interpreter lock back meanwhile."""
    loop = FunctionType(_loop.__code__, globals())
    loop.__qualname__ = "free_loop" if free else "loop"  # by which numba keeps it: the lock is not in its key
    with compiled_cache.kept(__name__, own_file=True) as keep:
        return njit(_SIGNATURE, nogil=free, cache=keep)(loop)  # with a signature loaded here, not in the first step
