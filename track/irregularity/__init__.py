"""Vertical track irregularity: classes, random profiles, measured ones, single defects."""

from .defects import dip, joint, wheel_flat
from .files import read_profile, write_profile
from .profile import Profile, flat
from .repetition import repeated
from .spectra import QUALITIES, Quality, Spectrum
from .synthesis import coherence, estimated_density, synthesise

__all__ = [
    "QUALITIES",
    "Profile",
    "Quality",
    "Spectrum",
    "coherence",
    "dip",
    "estimated_density",
    "flat",
    "joint",
    "read_profile",
    "repeated",
    "synthesise",
    "wheel_flat",
    "write_profile",
]
