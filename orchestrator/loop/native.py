"""Calls of C functions by their addresses, from compiled code.

    status = set_values(version, function, instance, references, count, values, number)
    status = do_step(version, function, instance, time, size, flags)

An FMU's functions are known at run time only, as addresses in its shared library. The compiled loop calls them through
these, with addresses for every pointer, so that a step of a native FMU passes no Python at all.
"""

from __future__ import annotations

import ctypes
import sys
import time
from collections.abc import Callable
from typing import Any

from llvmlite import ir  # type: ignore[import-untyped]
from numba import njit, types
from numba.extending import intrinsic

_INT32, _INT64, _DOUBLE = ir.IntType(32), ir.IntType(64), ir.DoubleType()
_POINTER = ir.IntType(8).as_pointer()
_MONOTONIC = 6 if sys.platform == "darwin" else 1  # CLOCK_MONOTONIC


def _function(*kinds: Any) -> Any:
    """A compiled call of a C function that returns int; an int64 stands for every pointer and size_t."""
    signature = types.int32(types.int64, *(types.float64 if kind is _DOUBLE else types.int64 for kind in kinds))

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        values = [
            builder.inttoptr(value, kind)
            if kind is _POINTER
            else builder.trunc(value, kind)
            if kind is _INT32
            else value
            for value, kind in zip(arguments[1:], kinds, strict=True)
        ]
        function = builder.inttoptr(arguments[0], ir.FunctionType(_INT32, kinds).as_pointer())
        return builder.call(function, values)

    return signature, generate


_FMI2_VALUES = _function(_POINTER, _POINTER, _INT64, _POINTER)
_FMI3_VALUES = _function(_POINTER, _POINTER, _INT64, _POINTER, _INT64)
_FMI2_STEP = _function(_POINTER, _DOUBLE, _DOUBLE, _INT32)
_FMI3_STEP = _function(_POINTER, _DOUBLE, _DOUBLE, _INT32, _POINTER, _POINTER, _POINTER, _POINTER)
_CLOCK = _function(_INT32, _POINTER)


@intrinsic
def _fmi2_values(context, address, instance, references, count, values):  # type: ignore[no-untyped-def]
    return _FMI2_VALUES


@intrinsic
def _fmi3_values(context, address, instance, references, count, values, number):  # type: ignore[no-untyped-def]
    return _FMI3_VALUES


@intrinsic
def _fmi2_step(context, address, instance, time, size, keep):  # type: ignore[no-untyped-def]
    return _FMI2_STEP


@intrinsic
def _fmi3_step(context, address, instance, time, size, keep, event, end, early, last):  # type: ignore[no-untyped-def]
    return _FMI3_STEP


@intrinsic
def _clock(context, address, which, result):  # type: ignore[no-untyped-def]
    return _CLOCK


def _element(kind: Any, result: Any) -> Any:
    """A compiled reading of number `place` of the values of a kind from an address on."""

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        pointer = builder.inttoptr(arguments[0], kind.as_pointer())
        return builder.load(builder.gep(pointer, [arguments[1]]))

    return result(types.int64, types.int64), generate


@intrinsic
def load(context, address, place):  # type: ignore[no-untyped-def]
    """Number `place` of the float64 from an address on."""
    return _element(_DOUBLE, types.float64)


@intrinsic
def load_integer(context, address, place):  # type: ignore[no-untyped-def]
    """Number `place` of the int64 from an address on."""
    return _element(_INT64, types.int64)


@intrinsic
def store(context, address, place, value):  # type: ignore[no-untyped-def]
    """Write number `place` of the float64 from an address on."""

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        pointer = builder.inttoptr(arguments[0], _DOUBLE.as_pointer())
        builder.store(arguments[2], builder.gep(pointer, [arguments[1]]))
        return context.get_dummy_value()

    return types.void(types.int64, types.int64, types.float64), generate


@njit(inline="always")
def call_values(version, function, instance, references, count, values, number):  # type: ignore[no-untyped-def]
    """Set or get `number` values by `count` value references; returns the status."""
    if version == 2:
        return _fmi2_values(function, instance, references, count, values)
    return _fmi3_values(function, instance, references, count, values, number)


@njit(inline="always")
def call_step(version, function, instance, time, size, final, flags):  # type: ignore[no-untyped-def]
    """Step; returns the status.

    `final` is 1 if no state before its end is ever set again. `flags` is the address of 32 bytes: of FMI 3, three
    booleans and, 8 on, the last successful time.
    """
    if version == 2:
        return _fmi2_step(function, instance, time, size, final)
    return _fmi3_step(function, instance, time, size, final, flags, flags + 1, flags + 2, flags + 8)


@njit(inline="always")
def nanoseconds(clock, room):  # type: ignore[no-untyped-def]
    """Time of a clock that never goes back, in ns; `room` is the address of 16 bytes, and 0 of `clock` gives 0."""
    if clock == 0:
        return 0
    _clock(clock, _MONOTONIC, room)
    return load_integer(room, 0) * 1_000_000_000 + load_integer(room, 1)


def clock_address() -> int:
    """Address of the C library's clock_gettime; 0 where there is none, and times are not measured."""
    if not hasattr(time, "clock_gettime") or ctypes.sizeof(ctypes.c_long) != 8:
        return 0
    function: Callable[..., int] = ctypes.CDLL(None).clock_gettime
    return ctypes.cast(function, ctypes.c_void_p).value or 0  # type: ignore[arg-type]
