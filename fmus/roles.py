"""What a variable of an FMU is to the model behind it. A copy of this file travels in every FMU."""

from __future__ import annotations

from enum import IntEnum
from typing import NamedTuple

PROFILES = "profiles.json"
"""Among an FMU's resources, the table of wheel and rail profiles (`Profiled.told`)."""


class Role(IntEnum):
    """The numbers are those of native_runtime/c/model.h."""

    TIME = 0
    IN_POSITION = 1
    """Of a wheelset."""
    IN_LOAD = 2
    """Of a port: a force, or the height of what the body's own contact presses against. Of a
    rolling contact of its own: of all contacts, the numbers that each is given, see `Rolls`."""
    IN_LOAD_LESS = 3
    """The same, taken off."""
    OUT_POSITION = 4
    OUT_FORCE = 5
    """Of the body's own contact, at a port of what it meets."""
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
    RADIUS = 19
    """This and what follows: of a rolling contact; of all, or of those of a wheelset."""
    HALF_DISTANCE = 20
    CONICITY = 21
    HEAD_RADIUS = 22
    CREEP_ALONG = 23
    CREEP_ACROSS = 24
    CREEP_SPIN = 25
    CREEP_TURN = 26
    ELLIPSE_ALONG = 27
    ELLIPSE_ACROSS = 28
    FRICTION = 29
    FLANGE_STIFFNESS = 30
    FLANGE_CLEARANCE = 31
    FLANGE_DEPTH = 32
    AXLE_INERTIA = 33
    TEXTBOOK = 34
    """Of all contacts."""
    FASTSIM = 35
    """Likewise."""
    DERIVATIVES_OF_STEP = 36
    OUT_SEEN = 37
    """Of what is seen at fixed places."""
    IN_SPEED = 38
    """Of wheels that creep on the body's own contacts, each of which is given it last."""


OF_PROFILES = (Role.FRICTION, Role.FASTSIM, Role.AXLE_INERTIA)
"""Numbers of rolling contacts that a table of profiles does not tell."""


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
