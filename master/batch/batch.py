"""Calls made one after the other: in C as far as C can, else in Python."""

from __future__ import annotations

import ctypes
from collections.abc import Sequence

from railcosim.master.batch.call import By, Call, Row
from railcosim.master.batch.library import in_c


class Batch:
    """A list of calls that are always made together.

    Parameters
    ----------
    calls : sequence of Call
        In their order. What they become later is what is made.

    Attributes
    ----------
    run : callable
        Makes them all; raises what one of them raises, and makes none after that.
    """

    def __init__(self, calls: Sequence[Call]) -> None:
        self._calls = tuple(calls)
        self._in_c = in_c()
        self._n = len(self._calls)
        self._rows = (ctypes.POINTER(Row) * self._n)(*(ctypes.pointer(c.row) for c in self._calls))
        self._status = ctypes.c_int32()
        self._prepared = (
            ctypes.byref(self._rows), ctypes.c_size_t.from_param(self._n),
            ctypes.c_size_t.from_param(0), ctypes.byref(self._status),
        )  # fmt: skip
        # To ask C for the sake of one call takes longer than to make it.
        several = sum(call.row.kind != By.PYTHON for call in self._calls) > 1
        self.run = self._by_c if self._in_c is not None and several else self._by_python

    def _by_python(self) -> None:
        for call in self._calls:
            call.make()

    def _by_c(self) -> None:
        assert self._in_c is not None
        at = self._in_c(*self._prepared)
        while at < self._n:
            call, status = self._calls[at], self._status.value
            if status < 0:  # none of C's
                call.make()
            else:
                call.go_on(status)
            rows, n, _, told = self._prepared
            at = self._in_c(rows, n, ctypes.c_size_t(at + 1), told)
