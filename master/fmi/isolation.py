"""An FMU in a process of its own: what it does to that process is an error here, and no more.

It is a guard against mistakes, not against malice: the process may do what its user may.
"""

from __future__ import annotations

import contextlib
import itertools
import json
import shutil
import weakref
from collections import deque
from collections.abc import Mapping
from pathlib import Path
from typing import Self

import numpy as np

from railcosim.master.component import ComponentError, FloatArray, Hold, RunEnded
from railcosim.master.fmi.archive import FmuError, unpack
from railcosim.master.fmi.description import FmuDescription, read_description
from railcosim.master.fmi.fmu_parameters import Scalar
from railcosim.master.fmi.fmu_process import FmuProcess
from railcosim.master.fmi.layers import tell_layers
from railcosim.master.fmi.loaded_fmu import LoadedFmu

LIMIT = 60.0
"""Seconds that a call may take unless told otherwise."""


class IsolatedState:
    """A snapshot inside an FMU in another process; freed some time after it is dropped."""

    def __init__(self, owner: IsolatedComponent, key: int, dropped: deque[int]) -> None:
        self.owner = weakref.ref(owner)
        self.key = key
        # Told with the next message: a snapshot can be dropped at any moment, also in another one.
        weakref.finalize(self, dropped.append, key).atexit = False


class IsolatedComponent(LoadedFmu):
    """An FMU like `FmuComponent`, with the same bits, in a process of its own.

    A crash, an exit or a hang of the FMU is a ComponentError that names it. Commands that have no
    result are told when a result is asked for, or a step is to be made; so a step costs one
    message and one answer, FMUs of a Jacobi step work at once, and an error may come up in the
    call after the one that caused it.

    What the FMU prints is quoted if its process ends too early; otherwise it is lost.
    """

    def __init__(self, name: str, description: FmuDescription, folder: Path, limit: float) -> None:
        super().__init__(name, description, folder)
        self._process = FmuProcess(name, description.path, folder, limit)
        self._keys = itertools.count()

    @classmethod
    def load(cls, path: str | Path, *, name: str | None = None, limit: float = LIMIT) -> Self:
        """Unpack an FMU, and instantiate it in a new process.

        Parameters
        ----------
        path : str or Path
            The ``.fmu`` file. Its code is run: load only what you would run.
        name : str, optional
            Name of the component; the model's name if not given.
        limit : float, optional
            Seconds a call may take.

        Returns
        -------
        IsolatedComponent
            Instantiated, parameters at their defaults.

        Raises
        ------
        FmuError
            If the file is not a usable FMU for Co-Simulation, FMI 2.0 or 3.0.
        ComponentError
            If the process ends or hangs.
        """
        path = Path(path)
        folder = unpack(path)
        try:
            description = read_description(path, folder)
            tell_layers(path, folder)
            return cls(name or description.model_name, description, folder, limit)
        except BaseException:
            shutil.rmtree(folder, ignore_errors=True)
            raise

    # --- life cycle ----------------------------------------------------------------------------

    @property
    def rollback_fault(self) -> str | None:
        """Why the FMU cannot go back to a saved state; None if it can."""
        fault: str | None = json.loads(self._process.ask("rollback_fault", self._step))
        return fault

    @property
    def warned(self) -> str:
        """What the FMU has warned of; nothing once its process has ended."""
        return str(json.loads(self._process.ask("warned"))) if self._process.is_open else ""

    @property
    def messages(self) -> tuple[str, ...]:
        """The last messages of the FMU, oldest first; none once its process has ended."""
        return tuple(json.loads(self._process.ask("messages"))) if self._process.is_open else ()

    def set_parameters(self, values: Mapping[str, Scalar]) -> None:
        """Set parameters; see `LoadedFmu`."""
        self._process.ask("set_parameters", dict(values))
        description = self._resized(values)
        if description is not self.description:
            self._reshape(description)

    def enter_initialization(
        self, start: float, stop: float | None = None, tolerance: float | None = None
    ) -> None:
        """Announce the time span and enter initialisation mode; see `LoadedFmu`."""
        self._process.ask("enter_initialization", start, stop, tolerance)

    def exit_initialization(self) -> None:
        """Leave initialisation mode; steps may follow."""
        self._process.ask("exit_initialization")

    def close(self) -> None:
        """End the process. Harmless to repeat."""
        if self._process.is_open:
            with contextlib.suppress(ComponentError, FmuError, RunEnded):  # going anyway
                self.tell_warnings()
                self._process.ask("close")
        self._process.end()

    # --- stepping ------------------------------------------------------------------------------

    def write_inputs(self) -> None:
        """Make `u` the inputs at the present time."""
        if self.u.size:
            self._process.tell("write_inputs", self.u.tobytes())

    def read_outputs(self) -> None:
        """Put the outputs at the present time, for the inputs last written, into `y`."""
        if self.y.size:
            self.y[:] = self._floats(self.y.size, "read_outputs")

    def set_input_derivatives(self, derivatives: FloatArray) -> None:
        """Give derivatives of the inputs for the next step; see `Component`."""
        self._process.tell("set_input_derivatives", derivatives.tobytes())

    def step_derivative(self) -> FloatArray | None:
        """Change of the outputs per change of an input held over the last step; see `Component`."""
        if not self.description.tells_step_derivatives:
            return None
        n, m = self.y.size, self.u.size
        # Transposed as from an FMU in this process: sums over it then have the same bits.
        return self._floats(n * m, "step_derivative").reshape(m, n).T

    def output_rates(self) -> FloatArray | None:
        """Rates of the outputs at the end of the last step; see `Component`."""
        if not self.description.has_output_rates:
            return None
        return self._floats(self.y.size, "output_rates")

    def do_step(self, t: float, h: float) -> None:
        """Go from time `t` to `t + h` (s). A failure may come up in the next call."""
        self._process.tell("do_step", t, h)
        if self.y.size:
            self._process.flush()
        else:  # nobody will ask for anything that would tell how it went
            self._process.ask("ready")

    def get_text(self, name: str) -> bytes:
        """What an output of `texts_out` is now."""
        return self._process.ask("get_text", name)

    def set_text(self, name: str, text: bytes) -> None:
        """Make `text` the value of an input of `texts_in`."""
        self._process.tell("set_text", name, text)

    def set_hold(self, hold: Hold) -> None:
        """Choose how the inputs continue from now on; `hold` must be in `holds`."""
        self._process.ask("set_hold", int(hold))

    # --- state ---------------------------------------------------------------------------------

    def keep_past(self) -> None:
        """Be told that steps may be taken back from now on; see `Component`."""
        self._process.tell("keep_past")

    def save_state(self) -> IsolatedState:
        """Take a snapshot of everything that decides the future."""
        state = self._new_state()
        self._process.tell("save_state", state.key)
        return state

    def restore_state(self, state: IsolatedState) -> None:
        """Go back to a snapshot of this instance, which stays usable."""
        self._process.tell("restore_state", self._own(state))

    def serialize_state(self, state: IsolatedState) -> bytes:
        """Write a snapshot as bytes, to be kept in a file."""
        return self._process.ask("serialize_state", self._own(state))

    def deserialize_state(self, data: bytes) -> IsolatedState:
        """Read what `serialize_state` of an instance of the same FMU wrote."""
        state = self._new_state()
        self._process.ask("deserialize_state", state.key, data)
        return state

    def _new_state(self) -> IsolatedState:
        return IsolatedState(self, next(self._keys), self._process.dropped)

    def _own(self, state: IsolatedState) -> int:
        """Key of a snapshot; FmuError if it is another FMU's."""
        if state.owner() is not self:
            raise FmuError(f"{self.name}: this snapshot belongs to another FMU")
        return state.key

    def _floats(self, n: int, question: str) -> FloatArray:
        """Ask for `n` numbers."""
        answer = self._process.ask(question)
        if len(answer) != 8 * n:
            raise ComponentError(f"{self.name}: {question} gave {len(answer)} bytes for {n} values")
        return np.frombuffer(answer)
