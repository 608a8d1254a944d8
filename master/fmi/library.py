"""The shared library of an FMU, with its functions as FMI 2.0 declares them."""

from __future__ import annotations

import ctypes
from collections.abc import Callable
from pathlib import Path
from typing import Any

import fmpy

from railcosim.master.fmi.archive import FmuError

_INT, _SIZE, _REAL, _POINTER = ctypes.c_int, ctypes.c_size_t, ctypes.c_double, ctypes.c_void_p
_PASS = (_POINTER, _SIZE, _POINTER)
"""Value references, how many, values."""
_SIGNATURES: dict[str, tuple[Any, ...]] = {
    "fmi2SetupExperiment": (_INT, _REAL, _REAL, _INT, _REAL),
    "fmi2EnterInitializationMode": (),
    "fmi2ExitInitializationMode": (),
    "fmi2Terminate": (),
    **{f"fmi2{way}{kind}": _PASS for way in ("Set", "Get")
       for kind in ("Real", "Integer", "Boolean", "String")},
    "fmi2GetFMUstate": (_POINTER,),
    "fmi2SetFMUstate": (_POINTER,),
    "fmi2FreeFMUstate": (_POINTER,),
    "fmi2SerializedFMUstateSize": (_POINTER, _POINTER),
    "fmi2SerializeFMUstate": (_POINTER, _POINTER, _SIZE),
    "fmi2DeSerializeFMUstate": (_POINTER, _SIZE, _POINTER),
    "fmi2GetDirectionalDerivative": (_POINTER, _SIZE, _POINTER, _SIZE, _POINTER, _POINTER),
    "fmi2SetRealInputDerivatives": (_POINTER, _SIZE, _POINTER, _POINTER),
    "fmi2GetRealOutputDerivatives": (_POINTER, _SIZE, _POINTER, _POINTER),
    "fmi2DoStep": (_REAL, _REAL, _INT),
    "fmi2GetStatus": (_INT, _POINTER),
    "fmi2GetBooleanStatus": (_INT, _POINTER),
    "fmi2NewDiscreteStates": (_POINTER,),
    "fmi2EnterContinuousTimeMode": (),
    "fmi2SetContinuousStates": (_POINTER, _SIZE),
    "fmi2GetContinuousStates": (_POINTER, _SIZE),
    "fmi2GetNominalsOfContinuousStates": (_POINTER, _SIZE),
}  # fmt: skip
"""What each function takes after the instance; all of them give a status."""


def library_of(file: Path, folder: Path, identifier: str) -> Path:
    """Find the library of an unpacked FMU.

    Parameters
    ----------
    file, folder : Path
        The FMU, for messages, and where it is unpacked.
    identifier : str
        What the model description calls the library.

    Raises
    ------
    FmuError
        If there is none for this platform, or of that name.
    """
    binaries = folder / "binaries"
    library: Path = binaries / fmpy.platform / (identifier + fmpy.sharedLibraryExtension)
    if library.is_file():
        return library
    found = sorted(p.name for p in binaries.glob("*") if p.is_dir() and any(p.iterdir()))
    others = sorted(p.name for p in library.parent.glob(f"*{fmpy.sharedLibraryExtension}"))
    if others:
        raise FmuError(
            f"{file}: its model description calls the library {library.name}, but in it there is "
            f"{', '.join(others)}; the two must agree: correct modelIdentifier or the file's name"
        )
    raise FmuError(
        f"{file}: no binary for {fmpy.platform}, only for {', '.join(found) or 'nothing'}; "
        "get a build for this platform"
    )


class Library:
    """A loaded library. Nothing of this process is changed by loading it, such as its folder.

    Parameters
    ----------
    path : Path
        Absolute.

    Raises
    ------
    OSError
        If the system cannot load it.
    """

    def __init__(self, path: Path) -> None:
        self._dll = ctypes.CDLL(str(path))

    def function(self, name: str) -> Callable[..., int]:
        """A function that takes Python's numbers; AttributeError if the library has it not."""
        found = getattr(self._dll, name)
        found.argtypes = (_POINTER, *_SIGNATURES[name])
        return found  # type: ignore[no-any-return]

    def bare(self, name: str) -> Callable[..., int]:
        """A function that takes C objects as they are, which is faster."""
        return self._dll[name]

    def instantiate(
        self, name: str, kind: int, guid: str, resources: str, callbacks: Any
    ) -> int | None:
        """Make an instance, and turn its logging on; None if it will not be made.

        Parameters
        ----------
        name, guid : str
            Of the instance, and of the FMU.
        kind : int
            0 for Model Exchange, 1 for Co-Simulation.
        resources : str
            URI of the folder of the resources.
        callbacks : ctypes structure
            Must live as long as the instance.
        """
        make = self._dll["fmi2Instantiate"]
        make.restype = ctypes.c_void_p
        texts = [ctypes.c_char_p(text.encode()) for text in (name, guid, resources)]
        # Logging on: a Python FMU says nothing about its exceptions otherwise.
        instance: int | None = make(
            texts[0], kind, texts[1], texts[2], ctypes.byref(callbacks), 0, 1
        )
        return instance

    def free(self, instance: int) -> None:
        """Free an instance, and unload."""
        end = self._dll["fmi2FreeInstance"]
        end.restype = None
        end(ctypes.c_void_p(instance))
        fmpy.freeLibrary(self._dll._handle)
