"""What a variable of an FMU is to the model behind it. A copy of this file travels in every FMU."""

from __future__ import annotations

from enum import IntEnum
from typing import NamedTuple


class Role(IntEnum):
    """The numbers are those of native_runtime/c/model.h."""

    TIME = 0
    IN_POSITION = 1
    """Of a wheelset."""
    IN_LOAD = 2
    """Of a port: a force, or the height of what the body's own contact presses against."""
    IN_LOAD_LESS = 3
    """The same, taken off."""
    OUT_POSITION = 4
    OUT_FORCE = 5
    """Of a port: of the body's own contact."""
    OUT_MOTION = 6
    """Of a port."""
    OUT_MOTION_RATE = 7
    OUT_COORDINATE = 8
    """Of the bodies of a vehicle."""
    OUT_RATE = 9
    OUT_ACCELERATION = 10
    HOLD = 11
    INTERNAL_STEP = 12
    NONLINEAR = 13
    STIFFNESS = 14
    """Of all contacts, or of those of a wheelset."""
    HERTZ = 15
    """Likewise."""
    SPEED = 16
    START_POSITION = 17
    START_Z = 18
    """Of a wheelset."""


class Slot(NamedTuple):
    """A variable to the model.

    Attributes
    ----------
    causality : str
        input, output, parameter or independent.
    role : Role
        What it is.
    owner : int
        Of which wheelset, port or coordinate, from 0.
    """

    causality: str
    role: Role
    owner: int
