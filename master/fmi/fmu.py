"""An FMU for Co-Simulation as a `Component`."""

from __future__ import annotations

import contextlib
import shutil
from collections.abc import Callable, Mapping
from enum import Enum
from pathlib import Path
from typing import Self

import numpy as np

from railcosim.master.batch.call import Call, Span
from railcosim.master.component import ComponentError, FloatArray, Hold, Prepared
from railcosim.master.fmi.archive import FmuError, unpack
from railcosim.master.fmi.counted import counted
from railcosim.master.fmi.description import (
    HOLD_PARAMETER,
    OF_STEP_PARAMETER,
    FmuDescription,
    read_description,
)
from railcosim.master.fmi.fmu_parameters import Scalar, Setting, setting_of
from railcosim.master.fmi.kinds import Passed
from railcosim.master.fmi.layers import tell_layers
from railcosim.master.fmi.loaded_fmu import LoadedFmu
from railcosim.master.fmi.prepared import FmuState, memory_of
from railcosim.master.fmi.rollback import rollback_fault
from railcosim.master.fmi.versions import CALLS

__all__ = ["FmuComponent", "FmuError", "FmuState"]


class _Phase(Enum):
    """Where an FMU is in its life."""

    INSTANTIATED = "instantiated"
    INITIALISING = "in initialisation mode"
    RUNNING = "initialised"


class FmuComponent(LoadedFmu):
    """One instance of an FMU for Co-Simulation, of FMI 2.0 or 3.0.

    Made by `load`; then `set_parameters`, `enter_initialization`, `exit_initialization`, steps,
    `close`. As a context manager it closes in any case.
    Unsuitable calls raise `FmuError`, refusals by the FMU `ComponentError`.

    Attributes
    ----------
    description : FmuDescription
        Identity, interface, parameters and capabilities.
    """

    def __init__(self, name: str, description: FmuDescription, folder: Path) -> None:
        super().__init__(name, description, folder)
        self._calls = CALLS[description.fmi](name, description, folder)
        self._phase = _Phase.INSTANTIATED
        self._parameters: dict[str, Scalar] = {}
        self._do_step = self._calls.step
        self._do_step.become(self._check_phase, _Phase.RUNNING)  # too early
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
            If the file is not a usable FMU for Co-Simulation, FMI 2.0 or 3.0.
        """
        path = Path(path)
        folder = unpack(path)
        try:
            description = read_description(path, folder)
            tell_layers(path, folder)
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
        return self._calls.log.warned()

    @property
    def messages(self) -> tuple[str, ...]:
        """The last messages of the FMU, oldest first, as ``status: text``."""
        return tuple(f"{status}: {text}" for status, text in self._calls.log.messages)

    # --- life cycle ----------------------------------------------------------------------------

    def set_parameters(self, values: Mapping[str, Scalar]) -> None:
        """Set parameters; see `LoadedFmu`."""
        initialised = self._phase is _Phase.RUNNING
        description = self._resized(values) if self._phase is _Phase.INSTANTIATED else None
        settings: list[Setting] = []
        structural: list[Setting] = []
        for name, value in values.items():
            setting = setting_of(
                description or self.description, name, value, initialised=initialised
            )
            (structural if setting.is_structural else settings).append(setting)
        if structural:
            self._check_phase(_Phase.INSTANTIATED)
            self._calls.resize(structural)
        if description is not None and description is not self.description:
            self._reshape(description)
            self.bind(self.u, self.y)
        for setting in settings:
            self._calls.set_value(setting)
        self._parameters.update(values)

    def enter_initialization(
        self, start: float, stop: float | None = None, tolerance: float | None = None
    ) -> None:
        """Announce the time span and enter initialisation mode; see `LoadedFmu`."""
        self._check_phase(_Phase.INSTANTIATED)
        self._calls.time = start
        self._told = start, stop, tolerance
        error = self.description.default_tolerance if tolerance is None else tolerance
        self._calls.enter_initialization(start, stop, error)
        self._phase = _Phase.INITIALISING

    def exit_initialization(self) -> None:
        """Leave initialisation mode; steps may follow."""
        self._check_phase(_Phase.INITIALISING)
        self._calls.exit_initialization()
        self._phase = _Phase.RUNNING
        self._calls.prepare_step()

    def close(self) -> None:
        """Free the instance, its snapshots, its library and its folder. Harmless to repeat."""
        if self._calls.is_open and self._phase is _Phase.RUNNING:
            with contextlib.suppress(ComponentError):  # going anyway
                self._calls.terminate()
        if self._calls.is_open:
            self.tell_warnings()
        self._calls.free()

    # --- stepping (the hot path) ---------------------------------------------------------------

    def bind(self, u: FloatArray, y: FloatArray) -> None:
        """Exchange values through these arrays from now on; see `Component.bind`."""
        super().bind(u, y)
        d, prepare = self.description, self._calls.passing
        self._set_real = self._shared("Set", d.passed_in, u)
        self._get_real = self._shared("Get", d.passed_out, y)
        self._set_counted = counted("Set", d.inputs, d.passed_in, u, prepare)
        self._get_counted = counted("Get", d.outputs, d.passed_out, y, prepare)
        self._highest = self.max_input_derivative  # which nothing changes until the next binding
        self._derivatives: Callable[[FloatArray], None] | None = None
        if self._highest:
            some = d.passed_in[0]
            self._derivatives = self._calls.input_derivatives(some, u[some.part], self._highest)

    def prepared(self, span: Span) -> Prepared:
        """Bare calls of the FMU's functions, if nothing is to be converted; see `Component`."""
        if type(self) is not FmuComponent:  # which may do any of them in its own way
            return super().prepared(span)
        self._calls.share(span)
        return Prepared(
            Call(self.write_inputs) if self._set_counted else self._set_real,
            Call(self.read_outputs) if self._get_counted else self._get_real,
            self._do_step,
        )

    def write_inputs(self) -> None:
        """Make `u` the inputs at the present time."""
        self._set_real.make()
        for some in self._set_counted:
            some.to_own()
            some.call.make()

    def read_outputs(self) -> None:
        """Put the outputs at the present time, for the inputs last written, into `y`."""
        self._get_real.make()
        for some in self._get_counted:
            some.call.make()
            some.to_values()

    def set_input_derivatives(self, derivatives: FloatArray) -> None:
        """Give derivatives of the inputs for the next step; see `Component`."""
        if self._derivatives is None or len(derivatives) > self._highest:
            super().set_input_derivatives(derivatives)
        else:
            self._derivatives(derivatives[:, : self.description.passed_in[0].count])

    def step_derivative(self) -> FloatArray | None:
        """Change of the outputs per change of an input held over the last step; see `Component`."""
        if not self.description.tells_step_derivatives:
            return None
        # Each time: a state restored brings the parameter's old value back.
        self._calls.set_value(
            setting_of(self.description, OF_STEP_PARAMETER, True, initialised=True)
        )
        matrix = np.zeros((self.u.size, self.y.size))
        for knowns in _reals(self.description.passed_in):
            for unknowns in _reals(self.description.passed_out):
                self._derive(unknowns, knowns, matrix[knowns.part, unknowns.part])
        return matrix.T

    def _derive(self, unknowns: Passed, knowns: Passed, matrix: FloatArray) -> None:
        """Rows of changes of the outputs `unknowns`, an input of `knowns` a row."""
        first, change = 0, np.empty(unknowns.count)
        for reference, size in zip(knowns.references, knowns.sizes, strict=True):
            for k in range(size):
                seed = np.zeros(size)
                seed[k] = 1.0
                self._calls.derivative(unknowns.references, (reference,), seed, change)
                matrix[first + k] = change
            first += size

    def output_rates(self) -> FloatArray | None:
        """Rates of the outputs at the end of the last step; see `Component`."""
        if not self.description.has_output_rates:
            return None
        rates = np.zeros(self.y.size)
        for some in _reals(self.description.passed_out):
            part = np.empty(some.count)
            self._calls.get_output_rates(some.references, part)
            rates[some.part] = part
        return rates

    def do_step(self, t: float, h: float) -> None:
        """Go from time `t` to `t + h` (s). Raises ComponentError."""
        step = self._do_step
        step.span.begin.value, step.span.length.value = t, h
        step.make()

    def get_text(self, name: str) -> bytes:
        """What an output of `texts_out` is now."""
        text = self.description.texts_out[name]
        return self._calls.get_text(text.kind, text.reference)

    def set_text(self, name: str, text: bytes) -> None:
        """Make `text` the value of an input of `texts_in`."""
        known = self.description.texts_in[name]
        self._calls.set_value(Setting(known.kind, known.reference, text))

    def set_hold(self, hold: Hold) -> None:
        """Choose how the inputs continue from now on; `hold` must be in `holds`."""
        if hold not in self.holds:
            raise FmuError(f"{self.name}: cannot {hold.name} inputs; no parameter {HOLD_PARAMETER}")
        if self.description.has_hold_parameter:
            self._calls.set_value(
                setting_of(self.description, HOLD_PARAMETER, int(hold), initialised=False)
            )

    # --- state ---------------------------------------------------------------------------------

    def keep_past(self) -> None:
        """Be told that steps may be taken back from now on; see `Component`."""
        self._calls.is_final = False
        if self._phase is _Phase.RUNNING:
            self._calls.prepare_step()

    def save_state(self) -> FmuState:
        """Take a snapshot of everything that decides the future; freed when you drop it."""
        self._check_able(self.description.can_get_and_set_state, "canGetAndSetFMUstate")
        return self._calls.save_state()

    def restore_state(self, state: FmuState) -> None:
        """Go back to a snapshot of this instance, which stays usable."""
        self._check_own(state)
        self._calls.restore_state(state)

    def serialize_state(self, state: FmuState) -> bytes:
        """Write a snapshot as bytes, to be kept in a file."""
        self._check_able(self.description.can_serialize_state, "canSerializeFMUstate")
        self._check_own(state)
        return self._calls.serialize_state(state)

    def deserialize_state(self, data: bytes) -> FmuState:
        """Read what `serialize_state` of an instance of the same FMU wrote."""
        self._check_able(self.description.can_serialize_state, "canSerializeFMUstate")
        return self._calls.deserialize_state(data)

    def _shared(self, way: str, passed: tuple[Passed, ...], values: FloatArray) -> Call:
        """Bind the call that passes those values that the FMU sees in their place."""
        for some in passed:
            if some.is_shared:
                return self._calls.passing(way, some, memory_of(values[some.part]))
        return Call(int)  # no call, and OK

    # --- checks --------------------------------------------------------------------------------

    def _check_phase(self, wanted: _Phase) -> None:
        """Refuse a call out of turn, which would crash some FMUs."""
        self._calls.check_open()
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
        self._calls.check_open()
        if not self._calls.owns(state):
            raise FmuError(f"{self.name}: this snapshot belongs to another FMU")


def _reals(passed: tuple[Passed, ...]) -> list[Passed]:
    """Those that derivatives are of."""
    return [some for some in passed if some.is_float]
