"""A call that is made in every step, bound to its arguments for Python and for C."""

from __future__ import annotations

import ctypes
from collections.abc import Callable
from dataclasses import dataclass, field
from enum import IntEnum
from typing import Any

_SPAN = ctypes.c_double * 2


class By(IntEnum):
    """Who makes a call, and how: by Python, or in C a gather, or FMI's functions of a version."""

    PYTHON = 0
    GATHER = 1
    PASS2 = 2
    PASS3 = 3
    STEP2 = 4
    STEP3 = 5


class Row(ctypes.Structure):
    """What `c/batch.c` makes a call of; see there."""

    _fields_ = (
        ("kind", ctypes.c_int32),
        ("is_final", ctypes.c_int32),
        ("function", ctypes.c_void_p),
        ("instance", ctypes.c_void_p),
        ("places", ctypes.c_void_p),
        ("count", ctypes.c_size_t),
        ("values", ctypes.c_void_p),
        ("size", ctypes.c_size_t),
        ("from_", ctypes.c_void_p),
        ("span", ctypes.c_void_p),
        ("flags", ctypes.c_void_p),
        ("last", ctypes.c_void_p),
        ("time", ctypes.c_double),
    )


class Span:
    """The step to be made, where Python and C see it.

    Attributes
    ----------
    begin, length : c_double
        s.
    address : int
        Of both.
    """

    def __init__(self) -> None:
        self._memory = _SPAN()
        self.begin = ctypes.c_double.from_buffer(self._memory, 0)
        self.length = ctypes.c_double.from_buffer(self._memory, ctypes.sizeof(ctypes.c_double))
        self.address = ctypes.addressof(self._memory)


def _nothing(status: int) -> None:
    """What there is to see to after a call that has no status."""


@dataclass(slots=True, eq=False, weakref_slot=True)
class Call:
    """A call; to look up its function and to convert its arguments costs more than to make it.

    Attributes
    ----------
    function : callable
        Gives a status: 0, or nothing, if it was done and there is no more to it.
    arguments : tuple
        C objects, or Python's, as it takes them; they keep the memory alive that C sees.
    name : str
        For messages.
    see_to : callable
        Told of any other status: raises, unless one can go on.
    row : Row
        The same for C.
    keeps : object
        Memory that only C sees.
    """

    function: Callable[..., int | None]
    arguments: tuple[Any, ...] = ()
    name: str = ""
    see_to: Callable[[int], None] = _nothing
    row: Row = field(default_factory=Row)
    keeps: Any = None

    def make(self) -> None:
        """Make it, and see to its status."""
        status = self.function(*self.arguments)
        if status:
            self.see_to(status)

    def go_on(self, status: int) -> None:
        """After it was made, here or in C."""
        if status:
            self.see_to(status)

    def become(self, function: Callable[..., int | None], *arguments: Any) -> None:
        """Be another call from now on, made by Python."""
        self.row.kind = By.PYTHON
        self.function, self.arguments = function, arguments

    def become_c(
        self, kind: By, function: Any, *arguments: Any, instance: int, **row: int | None
    ) -> None:
        """Be a function of an FMU; `row` is what C sees of the arguments after the instance."""
        self.become(function, ctypes.c_void_p.from_param(instance), *arguments)
        address = ctypes.cast(function, ctypes.c_void_p).value
        for name, value in {"function": address, "instance": instance, **row}.items():
            setattr(self.row, name, value)
        self.row.kind = kind


@dataclass(slots=True, eq=False, weakref_slot=True)
class StepCall(Call):
    """A step of an FMU.

    Attributes
    ----------
    span : Span
        Which.
    asks : object
        Its `value` is not 0 if there is more to a step than its status.
    """

    span: Span = field(default_factory=Span)
    asks: Any = None

    def make(self) -> None:
        """Make it, and see to what it asks, too."""
        self.go_on(self.function(*self.arguments) or 0)

    def go_on(self, status: int) -> None:
        """See to its status and to what it asks; note where the FMU is."""
        if status or (self.asks is not None and self.asks.value):
            self.see_to(status)
        self.row.time = self.span.begin.value + self.span.length.value
