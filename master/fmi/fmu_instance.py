"""One instance of an FMU: its library, its calls, its snapshots, its end."""

from __future__ import annotations

import contextlib
import ctypes
import shutil
import weakref
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NoReturn

import fmpy
import fmpy.fmi2
from fmpy.fmi1 import FMICallException

from railcosim.master.component import ComponentError
from railcosim.master.fmi.archive import FmuError
from railcosim.master.fmi.description import FmuDescription
from railcosim.master.fmi.fmu_log import FmuLog, status_name

WARNING, _FATAL = 1, 4


@dataclass(slots=True)
class PreparedCall:
    """A call that is made often, bound to its arguments; see `FmuInstance.prepare`."""

    function: Callable[..., Any]
    arguments: tuple[Any, ...]


class FmuState:
    """A snapshot inside an FMU; freed when nothing refers to it, or when the FMU is closed."""

    def __init__(self, pointer: ctypes.c_void_p, free: Callable[[ctypes.c_void_p], None]) -> None:
        self.pointer = pointer
        # The finaliser is the one place that frees, at most once. Not at interpreter exit: the
        # instance may be gone by then.
        self.free = weakref.finalize(self, free, pointer)
        self.free.atexit = False


class FmuInstance:
    """An instantiated FMU, for `FmuComponent`: calls with errors that explain themselves.

    Parameters
    ----------
    name : str
        Instance name.
    description : FmuDescription
        What the FMU says of itself.
    folder : Path
        Where it is unpacked; removed at the end.
    kind : type
        FMPy's class for the kind of FMU: ``FMU2Slave`` or ``FMU2Model``.

    Attributes
    ----------
    time : float
        Time (s) quoted in errors.
    is_open : bool
        Whether calls are possible.

    Raises
    ------
    FmuError
        If it cannot be instantiated here.
    """

    def __init__(
        self,
        name: str,
        description: FmuDescription,
        folder: Path,
        kind: type[Any] = fmpy.fmi2.FMU2Slave,
    ) -> None:
        # PythonFMU's loader reads this file, whatever tool the FMU claims to come from.
        is_python = (folder / "resources" / "slavemodule.txt").is_file()
        self.log = FmuLog(is_format=not is_python)
        self.time = 0.0
        self.is_open = True
        self._prepared: dict[str, PreparedCall] = {}
        self._name = name
        self._states: weakref.WeakSet[FmuState] = weakref.WeakSet()
        self._fmu = _instantiate(name, description, folder, self.log, kind)
        self._component = self._fmu.component
        self._remove_folder = weakref.finalize(self, shutil.rmtree, folder, ignore_errors=True)

    def call(self, function: str, *arguments: Any) -> None:
        """Call an FMI function, arguments after the instance.

        Raises
        ------
        ComponentError
            If the FMU's status is worse than a warning, with all that is known.
        FmuError
            If the instance is closed.
        """
        if not self.is_open:
            self.check_open()
        # The C function as FMPy has declared it: its own wrapper would cost as much as a vehicle.
        status = getattr(self._fmu.dll, function)(self._component, *arguments)
        if status > WARNING:
            self.refuse(function, status)

    def prepare(self, function: str, *arguments: Any) -> PreparedCall:
        """Bind a call that is made often to its arguments after the instance, which are C objects.

        To look a function up and to convert arguments costs several times what the call does.

        Returns
        -------
        PreparedCall
            ``call.function(*call.arguments)`` gives the FMU's status; give one worse than WARNING
            to `refuse`. Once the instance is closed, it raises FmuError. It is the only one of its
            function: one prepared before must not be used any more.
        """
        self.check_open()
        instance = ctypes.c_void_p.from_param(self._component)
        # What [] looks up is new, without the conversion of arguments that FMPy has declared.
        call = PreparedCall(self._fmu.dll[function], (instance, *arguments))
        self._prepared[function] = call
        return call

    def refuse(self, function: str, status: int) -> NoReturn:
        """Raise ComponentError for a status worse than a warning; see `call`."""
        if status == _FATAL:
            self._abandon()
        raise ComponentError(
            f"{self._name}: {function} at t = {self.time:.9g} s gave status "
            f"{status_name(status)}.{self.log.quote()}"
        )

    def own(self, pointer: ctypes.c_void_p) -> FmuState:
        """Wrap a snapshot that the FMU made, so that it is freed in time."""
        fmu, component = self._fmu, self._component

        def free(pointer: ctypes.c_void_p) -> None:
            with contextlib.suppress(FMICallException):
                fmu.fmi2FreeFMUstate(component, ctypes.byref(pointer))

        state = FmuState(pointer, free)
        self._states.add(state)
        return state

    def owns(self, state: FmuState) -> bool:
        """Tell whether a snapshot is of this instance and not freed."""
        return state in self._states and state.free.alive

    def check_open(self) -> None:
        """Raise FmuError if the instance is closed."""
        if not self.is_open:
            self._raise_closed()

    def _raise_closed(self) -> NoReturn:
        raise FmuError(f"{self._name}: closed, or given up after a fatal error; load it again")

    def free(self) -> None:
        """Free everything, unless that has happened."""
        if not self.is_open:
            return
        for state in list(self._states):  # FMI: before the instance
            state.free()
        self._close()
        self._fmu.freeInstance()
        self._remove_folder()

    def _close(self) -> None:
        """Let no further call through."""
        self.is_open = False
        for call in self._prepared.values():
            call.function, call.arguments = self._raise_closed, ()

    def _abandon(self) -> None:
        """Let go after a fatal status: FMI forbids any further call, even to free."""
        self._close()
        for state in list(self._states):
            state.free.detach()
        self._remove_folder()


def _instantiate(
    name: str, description: FmuDescription, folder: Path, log: FmuLog, kind: type[Any]
) -> Any:
    """Load the shared library and make an instance."""
    path, identifier = description.path, description.model_identifier
    library = folder / "binaries" / fmpy.platform / (identifier + fmpy.sharedLibraryExtension)
    if not library.is_file():
        found = sorted(p.name for p in (folder / "binaries").glob("*") if p.is_dir())
        raise FmuError(
            f"{path}: no binary for {fmpy.platform}, only for {', '.join(found) or 'nothing'}; "
            "get a build for this platform"
        )
    try:
        # fmpy changes the working directory to load, and stays there if loading fails.
        with contextlib.chdir(Path.cwd()):
            fmu = kind(
                guid=description.guid,
                modelIdentifier=identifier,
                unzipDirectory=str(folder),
                instanceName=name,
            )
        # Logging on: a Python FMU says nothing about its exceptions otherwise.
        fmu.instantiate(callbacks=log.callbacks, loggingOn=True)
    except Exception as error:  # fmpy raises bare Exception
        raise FmuError(f"{path}: cannot be instantiated ({error}).{log.quote()}") from error
    return fmu
