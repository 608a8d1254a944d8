"""What is asked of one instance of an FMU, whatever version of FMI it is of.

A version is one subclass (`fmi2`, `fmi3`), chosen in `versions`; nothing else knows of versions.
"""

from __future__ import annotations

import ctypes
import shutil
import weakref
from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path
from typing import Any, ClassVar, NamedTuple, NoReturn

import numpy as np

from railcosim.master.batch.call import By, Call, Span, StepCall
from railcosim.master.component import ComponentError, FloatArray
from railcosim.master.fmi.archive import FmuError
from railcosim.master.fmi.description import FmuDescription
from railcosim.master.fmi.fmu_log import FmuLog, status_name
from railcosim.master.fmi.fmu_parameters import Setting
from railcosim.master.fmi.kinds import Kind, Passed
from railcosim.master.fmi.library import Library, Signature, library_of
from railcosim.master.fmi.prepared import FmuState, StateNames, memory_of

WARNING, DISCARD, _FATAL = 1, 2, 4
MODEL_EXCHANGE, CO_SIMULATION = 0, 1
EVENT_ITERATIONS = 100
"""How often an FMU may ask for another event iteration before it counts as stuck."""


class Updated(NamedTuple):
    """What an FMU answers to an event iteration."""

    again: bool
    ends: bool
    next_time: float


class Calls(ABC):
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
    is_open : bool
        Whether calls are possible.
    step : StepCall
        A step over its `span`, for ever the same object; to be made after `prepare_step`.
    is_final : bool
        Whether nobody will go back to before it.

    Raises
    ------
    FmuError
        If it cannot be instantiated here.
    """

    platform: ClassVar[str]
    continuous_time: ClassVar[str]
    """Folder of the libraries for this machine."""
    signatures: ClassVar[dict[str, Signature]]
    states: ClassVar[StateNames]

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
        self.is_open = True
        self.step = StepCall(self.check_open, see_to=self.after_step)
        self.is_final = True
        self._prepared: weakref.WeakSet[Call] = weakref.WeakSet()
        self._name = name
        self._description = description
        self._states: weakref.WeakSet[FmuState] = weakref.WeakSet()
        library = library_of(
            description.path, folder / "binaries" / self.platform, description.model_identifier
        )
        try:
            self._library = Library(library, self.signatures)
            self._functions: dict[str, Callable[..., int]] = {}
            instance = self._instantiate(kind, folder / "resources")
        except (OSError, AttributeError) as error:
            raise FmuError(f"{description.path}: cannot be loaded ({error})") from error
        if instance is None:
            raise FmuError(f"{description.path}: cannot be instantiated.{self.log.quote()}")
        self._component: int = instance
        self._remove_folder = weakref.finalize(self, shutil.rmtree, folder, ignore_errors=True)

    # --- what versions do in different ways ----------------------------------------------------

    @abstractmethod
    def _instantiate(self, kind: int, resources: Path) -> int | None:
        """Make the instance, with its logging on; None if it will not be made."""

    @abstractmethod
    def _free_instance(self) -> None:
        """Free the instance."""

    @abstractmethod
    def set_value(self, setting: Setting) -> None:
        """Give a parameter its value."""

    @abstractmethod
    def get_text(self, kind: Kind, reference: int) -> bytes:
        """What a text or bytes are now."""

    @abstractmethod
    def resize(self, settings: Sequence[Setting]) -> None:
        """Give structural parameters their values."""

    @abstractmethod
    def enter_initialization(
        self, start: float, stop: float | None, tolerance: float | None
    ) -> None:
        """Announce the time span, s, and enter initialisation mode."""

    @abstractmethod
    def exit_initialization(self) -> None:
        """Leave it."""

    @abstractmethod
    def terminate(self) -> None:
        """Say that the run is over."""

    @abstractmethod
    def passing(self, way: str, passed: Passed, values: Any) -> Call:
        """Bind a call that sets or gets (``Set``, ``Get``) to an array's memory."""

    @abstractmethod
    def prepare_step(self) -> None:
        """Bind the step to its span and to `is_final`."""

    @abstractmethod
    def after_step(self, status: int) -> None:
        """See to the end of a step that has more to it than that it was made.

        Raises
        ------
        RunEnded
            If the FMU ends the run.
        ComponentError
            If it refused the step.
        """

    @abstractmethod
    def input_derivatives(
        self, passed: Passed, u: FloatArray, highest: int
    ) -> Callable[[FloatArray], None]:
        """What gives Real inputs, held in `u`, derivatives of shape (order, n) for a step."""

    @abstractmethod
    def get_output_rates(self, references: Sequence[int], rates: FloatArray) -> None:
        """Rates of Real outputs at the end of the last step."""

    @abstractmethod
    def derivative(
        self,
        unknowns: Sequence[int],
        knowns: Sequence[int],
        seed: FloatArray,
        change: FloatArray,
    ) -> None:
        """Change of the unknowns for a change `seed` of the knowns; both by value references."""

    def adjoint(
        self,
        unknowns: Sequence[int],
        knowns: Sequence[int],
        seed: FloatArray,
        change: FloatArray,
    ) -> None:
        """Sum of `seed` times the derivatives of the unknowns, by each of the knowns."""
        raise FmuError(f"{self._name}: has no adjoint derivatives")

    @abstractmethod
    def update_discrete_states(self) -> Updated:
        """Let one event iteration pass."""

    def enter_continuous_time(self, time: float) -> None:
        """Model Exchange: let the events at the beginning pass, and go on in continuous time."""
        for _ in range(EVENT_ITERATIONS):
            updated = self.update_discrete_states()
            if updated.ends:
                raise ComponentError(f"{self._description.path}: ends at once, at t = {time:g} s")
            if not updated.again:
                self.call(self.continuous_time)
                return
        raise ComponentError(
            f"{self._description.path}: its events at t = {time:g} s do not end "
            f"({EVENT_ITERATIONS} iterations)"
        )

    @abstractmethod
    def set_states(self, states: FloatArray) -> None:
        """Model Exchange: set the continuous states."""

    @abstractmethod
    def get_states(self, states: FloatArray, nominals: FloatArray) -> None:
        """Model Exchange: get them, and how large they typically are."""

    def beside_state(self) -> tuple[float, ...]:
        """What the master has to remember with a snapshot."""
        return ()

    def take_back(self, beside: tuple[float, ...]) -> None:  # noqa: B027 - most need it not
        """Be as `beside_state` said."""

    # --- what all do alike ---------------------------------------------------------------------

    def exchange(self, way: str, passed: Passed, values: FloatArray) -> None:
        """Set or get once, values as floating-point numbers."""
        own = np.zeros(passed.count, dtype=np.dtype(passed.c_type))
        own[...] = values if way == "Set" else own
        self.passing(way, passed, memory_of(own, passed.c_type)).make()
        if way == "Get":
            values[...] = own

    def save_state(self) -> FmuState:
        """Take a snapshot."""
        pointer = ctypes.c_void_p()
        self.call(self.states.get, ctypes.byref(pointer))
        return self._own(pointer, self.beside_state())

    def restore_state(self, state: FmuState) -> None:
        """Go back to one."""
        self.call(self.states.set, state.pointer)
        self.take_back(state.beside)

    def serialize_state(self, state: FmuState) -> bytes:
        """Write one as bytes."""
        size = ctypes.c_size_t()
        self.call(self.states.size, state.pointer, ctypes.byref(size))
        buffer = ctypes.create_string_buffer(size.value)
        self.call(self.states.write, state.pointer, buffer, size.value)
        return np.array(state.beside).tobytes() + buffer.raw

    def deserialize_state(self, data: bytes) -> FmuState:
        """Read one."""
        n = 8 * len(self.beside_state())
        beside, data = tuple(np.frombuffer(data[:n]).tolist()), data[n:]
        pointer = ctypes.c_void_p()
        buffer = ctypes.create_string_buffer(data, len(data))
        self.call(self.states.read, buffer, len(data), ctypes.byref(pointer))
        return self._own(pointer, beside)

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

    def prepare(
        self, function: str, *arguments: Any, kind: By = By.PYTHON, **row: int | None
    ) -> Call:
        """Bind a call that is made often to its arguments after the instance, which are C objects.

        Returns
        -------
        Call
            For as long as it is kept. Once the instance is closed, it raises FmuError.
        """
        call = Call(self.check_open, see_to=partial(self._see_to, function))
        self._bind(call, function, *arguments, kind=kind, **row)
        return call

    def _bind(
        self, call: Call, function: str, *arguments: Any, kind: By, **row: int | None
    ) -> None:
        """Make a call one of the FMU's functions, for Python and for C, which sees the row."""
        self.check_open()
        try:
            found = self._library.bare(function)
        except AttributeError:
            raise self._missing(function) from None
        call.become_c(kind, found, *arguments, instance=self._component, **row)
        call.name = function
        self._prepared.add(call)

    def _see_to(self, function: str, status: int) -> None:
        """After a call that gave another status than that all is well."""
        if status > WARNING:
            self.refuse(function, status)

    @property
    def time(self) -> float:
        """Where the FMU is, s."""
        time: float = self.step.row.time
        return time

    @time.setter
    def time(self, time: float) -> None:
        self.step.row.time = time

    def share(self, span: Span) -> None:
        """Make steps over this span from now on."""
        is_bound = self.step in self._prepared
        self.step.span = span
        if is_bound:
            self.prepare_step()

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

    def _own(self, pointer: ctypes.c_void_p, beside: tuple[float, ...]) -> FmuState:
        """Wrap a snapshot that the FMU made, so that it is freed in time."""
        function, component = self._function(self.states.free), self._component

        def free(pointer: ctypes.c_void_p) -> None:
            function(component, ctypes.byref(pointer))

        state = FmuState(pointer, free, beside)
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
        self._free_instance()
        self._library.unload()
        self._remove_folder()

    def _close(self) -> None:
        """Let no further call through."""
        self.is_open = False
        for call in [*self._prepared, self.step]:
            call.become(self._raise_closed)

    def _abandon(self) -> None:
        """Let go after a fatal status: FMI forbids any further call, even to free."""
        self._close()
        for state in list(self._states):
            state.free.detach()
        self._remove_folder()
