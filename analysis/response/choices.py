"""What may be chosen of a response, in words; what they mean takes longer to load."""

from __future__ import annotations

from enum import StrEnum

CONICITIES = (0.05, 0.1, 0.15, 0.2)
"""Tangents of the angle of conical wheels, from new to worn."""


class Method(StrEnum):
    """How an FMU is linearised."""

    BEST = "best"
    EXACT = "exact"
    DIFFERENCES = "differences"
    PULSES = "pulses"


class Wheels(StrEnum):
    """What holds the wheels."""

    FIXED = "fixed"
    CONTACT = "contact"
    RAILS = "rails"


class Gravity(StrEnum):
    """How the weight on conical wheels centres a wheelset."""

    NORMALS = "normals"
    TEXTBOOK = "textbook"


class Rails(StrEnum):
    """How the two rails of a track move in a wave."""

    ALIKE = "alike"
    OPPOSITE = "opposite"


class Subject(StrEnum):
    """Whose resonances."""

    VEHICLE = "vehicle"
    TRACK = "track"
    PAIR = "pair"
