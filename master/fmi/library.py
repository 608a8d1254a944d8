"""The shared library of an FMU, with its functions as a version of FMI declares them."""

from __future__ import annotations

import ctypes
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import fmpy

from railcosim.master.fmi.archive import FmuError

POINTER = ctypes.c_void_p
Signature = tuple[Any, ...]
"""What a function takes after the instance; those with a signature give a status."""


def library_of(file: Path, binaries: Path, identifier: str) -> Path:
    """Find the library of an unpacked FMU.

    Parameters
    ----------
    file, binaries : Path
        The FMU, for messages, and its folder of libraries for this platform.
    identifier : str
        What the model description calls the library.

    Raises
    ------
    FmuError
        If there is none for this platform, or of that name.
    """
    library: Path = binaries / (identifier + fmpy.sharedLibraryExtension)
    if library.is_file():
        return library
    others = sorted(p.name for p in binaries.glob(f"*{fmpy.sharedLibraryExtension}"))
    if others:
        raise FmuError(
            f"{file}: its model description calls the library {library.name}, but in it there is "
            f"{', '.join(others)}; the two must agree: correct modelIdentifier or the file's name"
        )
    unpacked = binaries.parent.parent
    if not (unpacked / "modelDescription.xml").is_file():  # it was read a moment ago
        raise FmuError(
            f"{file}: what was unpacked into {unpacked} has been removed by something; set the "
            "environment variable TMPDIR to a folder that nothing cleans"
        )
    found = sorted(p.name for p in binaries.parent.glob("*") if p.is_dir() and any(p.iterdir()))
    raise FmuError(
        f"{file}: no binary for {binaries.name}, only for {', '.join(found) or 'nothing'}; "
        "get a build for this platform"
    )


class Library:
    """A loaded library. Nothing of this process is changed by loading it, such as its folder.

    Parameters
    ----------
    path : Path
        Absolute.
    signatures : mapping of str to tuple of ctypes types
        What functions take after the instance.

    Raises
    ------
    OSError
        If the system cannot load it.
    """

    def __init__(self, path: Path, signatures: Mapping[str, Signature]) -> None:
        self._dll = ctypes.CDLL(str(path))
        self._signatures = signatures

    def function(self, name: str) -> Callable[..., int]:
        """A function that takes Python's numbers; AttributeError if the library has it not."""
        found = getattr(self._dll, name)
        found.argtypes = (POINTER, *self._signatures[name])
        return found  # type: ignore[no-any-return]

    def bare(self, name: str) -> Callable[..., Any]:
        """A function that takes C objects as they are, which is faster."""
        return self._dll[name]

    def unload(self) -> None:
        """Unload it."""
        fmpy.freeLibrary(self._dll._handle)
