"""One instance of an FMU: its library, its calls, its snapshots, its end."""

from __future__ import annotations

import ctypes
import shutil
import time
import weakref
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NoReturn

from railcosim.master.component import ComponentError, RunEnded
from railcosim.master.fmi.archive import FmuError
from railcosim.master.fmi.description import FmuDescription
from railcosim.master.fmi.fmu_log import FmuLog, status_name
from railcosim.master.fmi.library import Library, library_of

WARNING, _DISCARD, _FATAL, _PENDING = 1, 2, 4, 5
_DO_STEP_STATUS, _TERMINATED = 0, 3  # of what FMI 2 gives a status
_LONGEST_NAP = 0.01  # s
MODEL_EXCHANGE, CO_SIMULATION = 0, 1


@dataclass(slots=True)
class PreparedCall:
    """A call that is made often, bound to its arguments; see `FmuInstance.prepare`."""

    function: Callable[..., Any]
    arguments: tuple[Any, ...]
    name: str = ""


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
    kind : int
        `MODEL_EXCHANGE` or `CO_SIMULATION`.

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
        kind: int = CO_SIMULATION,
    ) -> None:
        # PythonFMU's loader reads this file, whatever tool the FMU claims to come from.
        is_python = (folder / "resources" / "slavemodule.txt").is_file()
        self.log = FmuLog(is_format=not is_python)
        self.time = 0.0
        self.is_open = True
        self._prepared: dict[str, PreparedCall] = {}
        self._name = name
        self._states: weakref.WeakSet[FmuState] = weakref.WeakSet()
        library = library_of(description.path, folder, description.model_identifier)
        try:
            self._library = Library(library)
            self._functions: dict[str, Callable[..., int]] = {}
            resources = (folder / "resources").as_uri()
            instance = self._library.instantiate(
                name, kind, description.guid, resources, self.log.callbacks
            )
        except (OSError, AttributeError) as error:
            raise FmuError(f"{description.path}: cannot be loaded ({error})") from error
        if instance is None:
            raise FmuError(f"{description.path}: cannot be instantiated.{self.log.quote()}")
        self._component: int = instance
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
        status = self._function(function)(self._component, *arguments)
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
        try:
            found = self._library.bare(function)
        except AttributeError:
            raise self._missing(function) from None
        call = PreparedCall(found, (instance, *arguments), function)
        self._prepared[function] = call
        return call

    def _function(self, name: str) -> Callable[..., int]:
        """A function of the library."""
        if name not in self._functions:
            try:
                self._functions[name] = self._library.function(name)
            except AttributeError:
                raise self._missing(name) from None
        return self._functions[name]

    def _missing(self, function: str) -> FmuError:
        return FmuError(f"{self._name}: its library has no {function}, which FMI asks for")

    def refuse(self, function: str, status: int) -> NoReturn:
        """Raise ComponentError for a status worse than a warning; see `call`."""
        if status == _FATAL:
            self._abandon()
        raise ComponentError(
            f"{self._name}: {function} at t = {self.time:.9g} s gave status "
            f"{status_name(status)}.{self.log.quote()}"
        )

    def after_step(self, status: int) -> None:
        """Wait for a step that goes on by itself; raise for one that was not made.

        Raises
        ------
        RunEnded
            If the FMU ends the run, and has complained of nothing.
        ComponentError
            If it refused the step.
        """
        nap = 1e-5
        while status == _PENDING:
            time.sleep(nap)
            nap = min(2 * nap, _LONGEST_NAP)
            status = self._status("fmi2GetStatus", _DO_STEP_STATUS, _PENDING)
        if status <= WARNING:
            return
        failed = any(s in {"error", "fatal"} for s, _ in self.log.messages)
        if (
            status == _DISCARD
            and not failed
            and self._status("fmi2GetBooleanStatus", _TERMINATED, 0)
        ):
            said = self.log.quote() if self.log.messages else ""
            raise RunEnded(f"{self._name} ended the run after t = {self.time:.9g} s.{said}")
        self.refuse("fmi2DoStep", status)

    def _status(self, function: str, kind: int, default: int) -> int:
        """Ask about the last step; an FMU that does not know may say so."""
        value = ctypes.c_int(default)
        try:
            known = self._function(function)(self._component, kind, ctypes.byref(value))
        except FmuError:
            known = _DISCARD
        if known > WARNING:
            return default if default != _PENDING else known
        return value.value

    def own(self, pointer: ctypes.c_void_p) -> FmuState:
        """Wrap a snapshot that the FMU made, so that it is freed in time."""
        function, component = self._function("fmi2FreeFMUstate"), self._component

        def free(pointer: ctypes.c_void_p) -> None:
            function(component, ctypes.byref(pointer))

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
        self._library.free(self._component)
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
