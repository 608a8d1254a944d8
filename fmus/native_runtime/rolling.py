"""The rolling law of the C runtime for who has no FMU: a master that owns the contact.

The same C that an FMU with contact runs (`c/rolling_law.h`), from the library of which FMUs are
made. Where there is none, and no compiler, `mechanics.contact` does the same in numpy, thirty times
slower.
"""

from __future__ import annotations

import ctypes
from collections.abc import Callable
from functools import cache
from typing import Any

import numpy as np

from railcosim.compiling.platforms import UnknownPlatform
from railcosim.mechanics.arrays import FloatArray
from railcosim.mechanics.contact.at_ports import GIVEN, PORTS, AtPorts, apart
from railcosim.mechanics.contact.profiled import NUMBERS, Profiled
from railcosim.mechanics.contact.profiles import COLUMNS

from ..roles import OF_PROFILES, Role
from .compile import CacheRefused, CompilationFailed, CompilerMissing, build

NUMBERS_OF_CONES = (
    *(Role(k) for k in range(Role.RADIUS, Role.FLANGE_DEPTH + 1)), Role.HERTZ, Role.TEXTBOOK,
    Role.FASTSIM, Role.AXLE_INERTIA,
)  # fmt: skip
"""Those that the C law takes, in its order."""


@cache
def _library() -> ctypes.CDLL | None:
    """With the law; None where there is none."""
    try:
        (path,) = build(2).values()
        library = ctypes.CDLL(str(path))
    except (CacheRefused, CompilationFailed, CompilerMissing, UnknownPlatform, OSError):
        return None
    library.railcosim_rolling_size.restype = ctypes.c_size_t
    library.railcosim_rolling_size.argtypes = [ctypes.c_size_t]
    library.railcosim_rolling_make.argtypes = [
        ctypes.c_void_p, ctypes.c_size_t, ctypes.c_void_p, ctypes.c_void_p, ctypes.c_size_t,
        ctypes.c_void_p, ctypes.c_void_p,
    ]  # fmt: skip
    library.railcosim_rolling_ask.restype = None
    library.railcosim_rolling_ask.argtypes = [
        ctypes.c_void_p, ctypes.c_size_t, ctypes.c_void_p, ctypes.c_void_p, ctypes.c_void_p
    ]  # fmt: skip
    return library


class CompiledRolling:
    """A law at `PORTS` as one of `GIVEN` numbers; a `ForceLaw` of 8 forces.

    Parameters
    ----------
    library : CDLL
        With the law.
    law : AtPorts
        The same in numpy.
    each : callable
        Numbers of a role, one a contact.
    profiles : Profiled or None
        Of wheels and rails; None: cones.

    Raises
    ------
    ValueError
        If the profiles make no sense.
    """

    def __init__(
        self,
        library: ctypes.CDLL,
        law: AtPorts,
        each: Callable[[Role], FloatArray],
        profiles: Profiled | None,
    ) -> None:
        side = np.ascontiguousarray(law.contact.side)
        numbers = np.zeros((side.size, len(NUMBERS_OF_CONES)))
        for role in OF_PROFILES if profiles else NUMBERS_OF_CONES:
            numbers[:, NUMBERS_OF_CONES.index(role)] = each(role)
        told = profiles.told() if profiles else {}
        columns = [told["columns"][name] for name in COLUMNS] if profiles else np.zeros((1, 0))
        self._table = np.ascontiguousarray(np.transpose(columns))  # which the C law goes on reading
        about = np.array([told[name] for name in NUMBERS if profiles])
        self._contacts, self._law, self._profiled = side.size, law, profiles is not None
        self._laws = np.zeros(-(-library.railcosim_rolling_size(side.size) // 8))
        made = library.railcosim_rolling_make(
            _at(self._laws), side.size, _at(side), _at(numbers), len(self._table),
            _at(self._table), _at(about),
        )  # fmt: skip
        if not made:
            raise ValueError("the table of wheel and rail profiles makes no sense")
        self._ask, self._where = library.railcosim_rolling_ask, _at(self._laws)

    def force(self, motion: FloatArray) -> FloatArray:
        """Forces, shape (..., n, 8), of motions, rates and speeds, shape (..., n, 17)."""
        return self._found(motion, None)

    def tangent(self, motion: FloatArray) -> FloatArray:
        """Their derivatives, shape (..., n, 8, 17)."""
        tangents = np.empty((*motion.shape[:-1], len(PORTS), GIVEN))
        self._found(motion, tangents)
        return tangents

    def _found(self, motion: FloatArray, tangents: FloatArray | None) -> FloatArray:
        own = np.ascontiguousarray(motion)
        forces = np.empty((*own.shape[:-1], len(PORTS)))
        times = own.size // (GIVEN * self._contacts)
        to = None if tangents is None else _at(tangents)
        self._ask(self._where, times, _at(own), _at(forces), to)
        if self._profiled and not np.isfinite(forces).all():
            self._law.force(*apart(own))  # says which wheel is off its table
        return forces


def compiled_rolling(
    law: AtPorts, each: Callable[[Role], FloatArray], profiles: Profiled | None
) -> CompiledRolling | None:
    """The law compiled, see `CompiledRolling`; None where there is no library."""
    library = _library()
    return None if library is None else CompiledRolling(library, law, each, profiles)


def _at(array: FloatArray) -> Any:
    """Where an array begins."""
    return array.__array_interface__["data"][0]
