"""What calls are made with: snapshots, memory shared with C."""

from __future__ import annotations

import ctypes
import weakref
from collections.abc import Callable
from functools import cache
from typing import Any, NamedTuple

import numpy as np

from railcosim.master.component import FloatArray


class StateNames(NamedTuple):
    """What a version calls its functions of states, which are alike in all."""

    get: str
    set: str
    free: str
    size: str
    write: str
    read: str


class FmuState:
    """A snapshot inside an FMU; freed when nothing refers to it, or when the FMU is closed.

    Attributes
    ----------
    beside : tuple of float
        What the master has to remember with it.
    """

    def __init__(
        self,
        pointer: ctypes.c_void_p,
        free: Callable[[ctypes.c_void_p], None],
        beside: tuple[float, ...] = (),
    ) -> None:
        self.pointer = pointer
        self.beside = beside
        # The finaliser is the one place that frees, at most once. Not at interpreter exit: the
        # instance may be gone by then.
        self.free = weakref.finalize(self, free, pointer)
        self.free.atexit = False


@cache
def references_of(values: tuple[int, ...]) -> Any:
    """Make a ctypes array of value references."""
    return (ctypes.c_uint * len(values))(*values)


@cache
def orders_of(n: int, order: int) -> Any:
    """Make a ctypes array of n ones, n twos ..."""
    return (ctypes.c_int * (n * order))(*np.repeat(np.arange(1, order + 1), n).tolist())


def memory_of(array: Any, c_type: Any = ctypes.c_double) -> Any:
    """Make a ctypes array that shares the memory of `array`, and keeps it alive."""
    return (c_type * array.size).from_buffer(array.data)


def pointer_to(array: FloatArray) -> Any:
    """Make a C pointer to the array's data; the array must outlive it."""
    return array.ctypes.data_as(ctypes.POINTER(ctypes.c_double))
