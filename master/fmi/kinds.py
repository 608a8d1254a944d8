"""The types of FMI's variables, by version: how they are passed, what they are to a system."""

from __future__ import annotations

import ctypes
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from railcosim.master.component import Type

EXACT = 2**53
"""Whole numbers up to here are floating-point numbers."""


@dataclass(frozen=True)
class Kind:
    """How one FMI type is passed.

    Attributes
    ----------
    name : str
        As FMI calls it.
    type : Type or None
        What its values are to a system; None for texts and bytes, which take no part in coupling.
    function : str
        End of the names of the functions that set and get it.
    c_type : ctypes type
        Of one value.
    convert : callable
        From what a user gives.
    """

    name: str
    type: Type | None
    function: str
    c_type: Any
    convert: Callable[[Any], Any]

    @property
    def common(self) -> str:
        """Its name whatever the version: ``Real``, ``Integer``, ``Boolean``, ``String`` ..."""
        return self.name if self.type is None else self.type.value

    @property
    def range(self) -> tuple[float, float]:
        """Least and largest number that it holds, and that a system can hold exactly."""
        return range_of(np.dtype(self.c_type))


def range_of(dtype: np.dtype[Any]) -> tuple[float, float]:
    """Least and largest number of a type that a system can hold exactly."""
    if dtype.kind == "b":
        return 0, 1
    if dtype.kind == "f":
        largest = float(np.finfo(dtype).max)
        return -largest, largest
    whole = np.iinfo(dtype)
    return max(int(whole.min), -EXACT), min(int(whole.max), EXACT)


def _table(*kinds: Kind) -> dict[str, Kind]:
    return {kind.name: kind for kind in kinds}


KINDS = {
    2: _table(
        Kind("Real", Type.REAL, "Real", ctypes.c_double, float),
        Kind("Integer", Type.INTEGER, "Integer", ctypes.c_int32, int),
        Kind("Enumeration", Type.ENUMERATION, "Integer", ctypes.c_int32, int),
        Kind("Boolean", Type.BOOLEAN, "Boolean", ctypes.c_int32, bool),
        Kind("String", None, "String", ctypes.c_char_p, str),
    ),
    3: _table(
        Kind("Float64", Type.REAL, "Float64", ctypes.c_double, float),
        Kind("Float32", Type.REAL, "Float32", ctypes.c_float, float),
        Kind("Int8", Type.INTEGER, "Int8", ctypes.c_int8, int),
        Kind("UInt8", Type.INTEGER, "UInt8", ctypes.c_uint8, int),
        Kind("Int16", Type.INTEGER, "Int16", ctypes.c_int16, int),
        Kind("UInt16", Type.INTEGER, "UInt16", ctypes.c_uint16, int),
        Kind("Int32", Type.INTEGER, "Int32", ctypes.c_int32, int),
        Kind("UInt32", Type.INTEGER, "UInt32", ctypes.c_uint32, int),
        Kind("UInt64", Type.INTEGER, "UInt64", ctypes.c_uint64, int),
        Kind("Int64", Type.INTEGER, "Int64", ctypes.c_int64, int),
        Kind("Enumeration", Type.ENUMERATION, "Int64", ctypes.c_int64, int),
        Kind("Boolean", Type.BOOLEAN, "Boolean", ctypes.c_bool, bool),
        Kind("String", None, "String", ctypes.c_char_p, str),
        Kind("Binary", None, "Binary", ctypes.c_char_p, str),
    ),
}
"""By major version of FMI and type, in the order in which they stand in a system's arrays: Reals
first, and next to each other what one function passes."""


@dataclass(frozen=True)
class Passed:
    """Neighbouring inputs or outputs that one function passes together.

    Attributes
    ----------
    function : str
        End of its name.
    c_type : ctypes type
        Of one value.
    references, sizes : tuple of int
        Of the variables, and how many values each has; an array is one.
    first, count : int
        Where their values begin among all inputs or outputs, and how many they are.
    jumps : bool
        Whether any of them may change at events only.
    """

    function: str
    c_type: Any
    references: tuple[int, ...]
    sizes: tuple[int, ...]
    first: int
    count: int
    jumps: bool = False

    @property
    def part(self) -> slice:
        """Where the values are among all inputs or outputs."""
        return slice(self.first, self.first + self.count)

    @property
    def is_float(self) -> bool:
        """Whether they are floating-point numbers."""
        return bool(np.dtype(self.c_type).kind == "f")

    @property
    def is_shared(self) -> bool:
        """Whether the FMU can read and write a system's array itself."""
        return self.c_type is ctypes.c_double
