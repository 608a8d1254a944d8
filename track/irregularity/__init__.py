"""Track irregularity: classes, random profiles, measured ones, single defects."""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from .defects import Defect
    from .files import read_profile, write_profile
    from .named_defects import defect
    from .profile import Profile, flat
    from .quantities import QUANTITIES, Quantity
    from .rail_defects import Corrugation, Dip, Joint, Weld
    from .repetition import repeated
    from .spectra import QUALITIES, Quality, Spectrum
    from .synthesis import coherence, estimated_density, synthesise
    from .wheel_defects import Flat, FreshFlat

__all__ = [
    "QUALITIES",
    "QUANTITIES",
    "Corrugation",
    "Defect",
    "Dip",
    "Flat",
    "FreshFlat",
    "Joint",
    "Profile",
    "Quality",
    "Quantity",
    "Spectrum",
    "Weld",
    "coherence",
    "defect",
    "estimated_density",
    "flat",
    "read_profile",
    "repeated",
    "synthesise",
    "write_profile",
]

_PLACES = {
    "defects": ("Defect",),
    "files": ("read_profile", "write_profile"),
    "named_defects": ("defect",),
    "profile": ("Profile", "flat"),
    "quantities": ("QUANTITIES", "Quantity"),
    "rail_defects": ("Corrugation", "Dip", "Joint", "Weld"),
    "repetition": ("repeated",),
    "spectra": ("QUALITIES", "Quality", "Spectrum"),
    "synthesis": ("coherence", "estimated_density", "synthesise"),
    "wheel_defects": ("Flat", "FreshFlat"),
}


def __getattr__(name: str) -> Any:
    """Load what is asked for: the names of the classes are there without numpy."""
    for module, names in _PLACES.items():
        if name in names:
            found = getattr(import_module(f"{__name__}.{module}"), name)
            globals()[name] = found
            return found
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
