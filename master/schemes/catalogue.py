"""All schemes by name, found in the files of this folder: a new one is a new file, no more."""

from __future__ import annotations

from importlib import import_module
from pkgutil import iter_modules

from railcosim.master import schemes
from railcosim.master.schemes.family import Family


def _found() -> dict[str, Family]:
    """The families of all modules that have some."""
    modules = (
        import_module(f"{schemes.__name__}.{m.name}") for m in iter_modules(schemes.__path__)
    )
    families = (f for module in modules for f in getattr(module, "FAMILIES", ()))
    return {family.name: family for family in families}


CATALOGUE = _found()
"""By the name on the command line (`master.names` lists them, too); the files in the order of the
alphabet."""
