"""An FMI 2.0 Co-Simulation FMU as a `Component`, through FMPy's ctypes calls."""

from __future__ import annotations

import contextlib
import ctypes
import shutil
from collections.abc import Mapping
from enum import Enum
from functools import cache
from pathlib import Path
from typing import Any, Self

import numpy as np

from railcosim.master.component import ComponentError, FloatArray, Hold
from railcosim.master.fmi.archive import FmuError, unpack
from railcosim.master.fmi.counted import counted
from railcosim.master.fmi.description import HOLD_PARAMETER, FmuDescription, read_description
from railcosim.master.fmi.fmu_instance import WARNING, FmuInstance, FmuState, PreparedCall
from railcosim.master.fmi.fmu_parameters import Scalar, parameter_call
from railcosim.master.fmi.loaded_fmu import LoadedFmu
from railcosim.master.fmi.rollback import rollback_fault

__all__ = ["FmuComponent", "FmuError", "FmuState"]


class _Phase(Enum):
    """Where an FMU is in its life."""

    INSTANTIATED = "instantiated"
    INITIALISING = "in initialisation mode"
    RUNNING = "initialised"


class FmuComponent(LoadedFmu):
    """One instance of an FMI 2.0 Co-Simulation FMU.

    Made by `load`; then `set_parameters`, `enter_initialization`, `exit_initialization`, steps,
    `close`. As a context manager it closes in any case. Strings take no part in coupling.
    Unsuitable calls raise `FmuError`, refusals by the FMU `ComponentError`.

    Attributes
    ----------
    description : FmuDescription
        Identity, interface, parameters and capabilities.
    """

    def __init__(self, name: str, description: FmuDescription, folder: Path) -> None:
        super().__init__(name, description)
        self._instance = FmuInstance(name, description, folder)
        self._phase = _Phase.INSTANTIATED
        self._parameters: dict[str, Scalar] = {}
        self._u_references = description.input_references[: description.real_inputs]
        self._y_references = description.output_references[: description.real_outputs]
        self._t, self._h = ctypes.c_double(), ctypes.c_double()
        self._is_final = ctypes.c_int(1)  # promises that nobody goes back to before a step
        self._n_derivatives = ctypes.c_size_t()
        self._do_step = PreparedCall(self._check_phase, (_Phase.RUNNING,))  # too early
        self.bind(self.u, self.y)

    @classmethod
    def load(cls, path: str | Path, *, name: str | None = None) -> Self:
        """Unpack and instantiate an FMU.

        Parameters
        ----------
        path : str or Path
            The ``.fmu`` file. Its code is run: load only what you would run.
        name : str, optional
            Name of the component; the model's name if not given.

        Returns
        -------
        FmuComponent
            Instantiated, parameters at their defaults.

        Raises
        ------
        FmuError
            If the file is not a usable FMI 2.0 Co-Simulation FMU.
        """
        path = Path(path)
        folder = unpack(path)
        try:
            description = read_description(path, folder)
            return cls(name or description.model_name, description, folder)
        except BaseException:
            shutil.rmtree(folder, ignore_errors=True)
            raise

    # --- interface -----------------------------------------------------------------------------

    @property
    def rollback_fault(self) -> str | None:
        """Why the FMU cannot go back to a saved state; None if it can.

        Tested when first asked for, on an instance in a process of its own: one that fails the
        test is left in a state that nobody knows, or crashes.
        """
        return rollback_fault(self.description, self._parameters, self.u, self._told, self._step)

    @property
    def warned(self) -> str:
        """What the FMU has warned of; see `LoadedFmu`."""
        return self._instance.log.warned()

    @property
    def messages(self) -> tuple[str, ...]:
        """The last messages of the FMU, oldest first, as ``status: text``."""
        return tuple(f"{status}: {text}" for status, text in self._instance.log.messages)

    # --- life cycle ----------------------------------------------------------------------------

    def set_parameters(self, values: Mapping[str, Scalar]) -> None:
        """Set parameters; see `LoadedFmu`."""
        initialised = self._phase is _Phase.RUNNING
        calls = [
            parameter_call(self.description, name, value, initialised=initialised)
            for name, value in values.items()
        ]
        for function, references, array in calls:
            self._instance.call(function, references, 1, array)
        self._parameters.update(values)

    def enter_initialization(
        self, start: float, stop: float | None = None, tolerance: float | None = None
    ) -> None:
        """Announce the time span and enter initialisation mode; see `LoadedFmu`."""
        self._check_phase(_Phase.INSTANTIATED)
        self._instance.time = start
        self._told = start, stop, tolerance
        error = self.description.default_tolerance if tolerance is None else tolerance
        self._instance.call(
            "fmi2SetupExperiment",
            error is not None,
            error or 0.0,
            start,
            stop is not None,
            stop or 0.0,
        )
        self._instance.call("fmi2EnterInitializationMode")
        self._phase = _Phase.INITIALISING

    def exit_initialization(self) -> None:
        """Leave initialisation mode; steps may follow."""
        self._check_phase(_Phase.INITIALISING)
        self._instance.call("fmi2ExitInitializationMode")
        self._phase = _Phase.RUNNING
        self._do_step = self._instance.prepare("fmi2DoStep", self._t, self._h, self._is_final)

    def close(self) -> None:
        """Free the instance, its snapshots, its library and its folder. Harmless to repeat."""
        if self._instance.is_open and self._phase is _Phase.RUNNING:
            with contextlib.suppress(ComponentError):  # going anyway
                self._instance.call("fmi2Terminate")
        if self._instance.is_open:
            self.tell_warnings()
        self._instance.free()

    # --- stepping (the hot path) ---------------------------------------------------------------

    def bind(self, u: FloatArray, y: FloatArray) -> None:
        """Exchange values through these arrays from now on; see `Component.bind`."""
        super().bind(u, y)
        d, (n, m) = self.description, self._reals
        self._set_real = self._prepare("fmi2SetReal", self._u_references, u[:n])
        self._get_real = self._prepare("fmi2GetReal", self._y_references, y[:m])
        self._set_counted = counted("Set", d.inputs, d.input_references, u, self._bound)
        self._get_counted = counted("Get", d.outputs, d.output_references, y, self._bound)
        derivatives = np.zeros((self.max_input_derivative, n))
        self._derivatives = [derivatives[:k] for k in range(len(derivatives) + 1)]  # by order
        if derivatives.size:
            every = self._u_references * len(derivatives)
            self._set_derivatives = self._instance.prepare(
                "fmi2SetRealInputDerivatives",
                ctypes.byref(_references(every)),
                self._n_derivatives,
                ctypes.byref(_orders(n, len(derivatives))),
                ctypes.byref(_doubles(derivatives)),
            )

    def write_inputs(self) -> None:
        """Make `u` the inputs at the present time."""
        call = self._set_real
        status = call.function(*call.arguments)
        if status > WARNING:
            self._instance.refuse("fmi2SetReal", status)
        if self._set_counted:
            for some in self._set_counted:
                some.to_integers()
                self._call(some.call)

    def read_outputs(self) -> None:
        """Put the outputs at the present time, for the inputs last written, into `y`."""
        call = self._get_real
        status = call.function(*call.arguments)
        if status > WARNING:
            self._instance.refuse("fmi2GetReal", status)
        if self._get_counted:
            for some in self._get_counted:
                self._call(some.call)
                some.to_values()

    def set_input_derivatives(self, derivatives: FloatArray) -> None:
        """Give derivatives of the inputs for the next step; see `Component`."""
        order = len(derivatives)
        if order >= len(self._derivatives):
            super().set_input_derivatives(derivatives)
        known = self._derivatives[order]
        known[...] = (
            derivatives if known.shape == derivatives.shape else derivatives[:, : self._reals[0]]
        )
        self._n_derivatives.value = known.size
        call = self._set_derivatives
        status = call.function(*call.arguments)
        if status > WARNING:
            self._instance.refuse("fmi2SetRealInputDerivatives", status)

    def step_derivative(self) -> FloatArray | None:
        """Change of the outputs per change of an input held over the last step; see `Component`."""
        if not self.description.has_directional_derivatives:
            return None
        matrix = np.zeros((self.u.size, self.y.size))
        n = self._reals[1]
        one, column = (ctypes.c_double * 1)(1.0), np.empty(n)
        for j, reference in enumerate(self._u_references):
            self._instance.call(
                "fmi2GetDirectionalDerivative",
                _references(self._y_references),
                n,
                _references((reference,)),
                1,
                one,
                _pointer(column),
            )
            matrix[j, :n] = column
        return matrix.T

    def output_rates(self) -> FloatArray | None:
        """Rates of the outputs at the end of the last step; see `Component`."""
        if not self.description.has_output_rates:
            return None
        rates, n = np.zeros(self.y.size), self._reals[1]
        self._instance.call(
            "fmi2GetRealOutputDerivatives",
            _references(self._y_references),
            n,
            _orders(n, 1),
            _pointer(rates),
        )
        return rates

    def do_step(self, t: float, h: float) -> None:
        """Go from time `t` to `t + h` (s). Raises ComponentError."""
        self._t.value, self._h.value = t, h
        call = self._do_step
        status = call.function(*call.arguments)
        if status > WARNING:
            self._instance.time = t
            self._instance.after_step(status)
        self._instance.time = t + h

    def set_hold(self, hold: Hold) -> None:
        """Choose how the inputs continue from now on; `hold` must be in `holds`."""
        if hold not in self.holds:
            raise FmuError(f"{self.name}: cannot {hold.name} inputs; no parameter {HOLD_PARAMETER}")
        if self.description.has_hold_parameter:
            reference = self.description.parameters[HOLD_PARAMETER].reference
            value = (ctypes.c_int * 1)(hold)
            self._instance.call("fmi2SetInteger", _references((reference,)), 1, value)

    # --- state ---------------------------------------------------------------------------------

    def keep_past(self) -> None:
        """Be told that steps may be taken back from now on; see `Component`."""
        self._is_final.value = 0

    def save_state(self) -> FmuState:
        """Take a snapshot of everything that decides the future; freed when you drop it."""
        self._check_able(self.description.can_get_and_set_state, "canGetAndSetFMUstate")
        pointer = ctypes.c_void_p()
        self._instance.call("fmi2GetFMUstate", ctypes.byref(pointer))
        return self._instance.own(pointer)

    def restore_state(self, state: FmuState) -> None:
        """Go back to a snapshot of this instance, which stays usable."""
        self._check_own(state)
        self._instance.call("fmi2SetFMUstate", state.pointer)

    def serialize_state(self, state: FmuState) -> bytes:
        """Write a snapshot as bytes, to be kept in a file."""
        self._check_able(self.description.can_serialize_state, "canSerializeFMUstate")
        self._check_own(state)
        size = ctypes.c_size_t()
        self._instance.call("fmi2SerializedFMUstateSize", state.pointer, ctypes.byref(size))
        buffer = ctypes.create_string_buffer(size.value)
        self._instance.call("fmi2SerializeFMUstate", state.pointer, buffer, size.value)
        return buffer.raw

    def deserialize_state(self, data: bytes) -> FmuState:
        """Read what `serialize_state` of an instance of the same FMU wrote."""
        self._check_able(self.description.can_serialize_state, "canSerializeFMUstate")
        pointer = ctypes.c_void_p()
        buffer = ctypes.create_string_buffer(data, len(data))
        self._instance.call("fmi2DeSerializeFMUstate", buffer, len(data), ctypes.byref(pointer))
        return self._instance.own(pointer)

    @property
    def _reals(self) -> tuple[int, int]:
        """How many inputs and outputs are Reals."""
        return len(self._u_references), len(self._y_references)

    def _prepare(
        self, function: str, references: tuple[int, ...], values: FloatArray
    ) -> PreparedCall:
        """Bind a call that sets or gets Reals to its arguments."""
        if not references:
            return PreparedCall(int, ())  # no call, and OK
        return self._bound(function, _references(references), _doubles(values))

    def _bound(self, function: str, references: Any, values: Any) -> PreparedCall:
        """Bind a call that sets or gets to ctypes arrays."""
        n = ctypes.c_size_t.from_param(len(references))
        return self._instance.prepare(function, ctypes.byref(references), n, ctypes.byref(values))

    def _call(self, call: PreparedCall) -> None:
        """Make a prepared call that is not on the path of Reals."""
        status = call.function(*call.arguments)
        if status > WARNING:
            self._instance.refuse(call.name, status)

    # --- checks --------------------------------------------------------------------------------

    def _check_phase(self, wanted: _Phase) -> None:
        """Refuse a call out of turn, which would crash some FMUs."""
        self._instance.check_open()
        if self._phase is not wanted:
            raise FmuError(
                f"{self.name}: is {self._phase.value}, but for this call it must be "
                f"{wanted.value}: enter and exit the initialisation, once"
            )

    def _check_able(self, able: bool, flag: str) -> None:
        """Refuse what the FMU does not declare."""
        if not able:
            raise FmuError(f"{self.description.path}: its {flag} is false; no rollback with it")

    def _check_own(self, state: FmuState) -> None:
        """Refuse a snapshot of another instance, which would crash."""
        self._instance.check_open()
        if not self._instance.owns(state):
            raise FmuError(f"{self.name}: this snapshot belongs to another FMU")


@cache
def _orders(n: int, order: int) -> Any:
    """Make a ctypes array of n ones, n twos ..."""
    return (ctypes.c_int * (n * order))(*np.repeat(np.arange(1, order + 1), n).tolist())


@cache
def _references(values: tuple[int, ...]) -> Any:
    """Make a ctypes array of value references."""
    return (ctypes.c_uint * len(values))(*values)


def _doubles(array: FloatArray) -> Any:
    """Make a ctypes array that shares the memory of `array`, and keeps it alive."""
    return (ctypes.c_double * array.size).from_buffer(array.data)


def _pointer(array: FloatArray) -> Any:
    """Make a C pointer to the array's data; the array must outlive it."""
    return array.ctypes.data_as(ctypes.POINTER(ctypes.c_double))
