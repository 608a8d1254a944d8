"""The pythonfmu slave: FMI calls to a model. Needs numpy only; pythonfmu travels with the FMU.

All state is kept in one place and copied on get and set, because pythonfmu's own handler would
leave numpy state behind; values are one flat vector, because its own accessors take one variable
at a time.
"""

from __future__ import annotations

import io
import json
import traceback
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np
from numpy.typing import NDArray
from pythonfmu import Fmi2Slave
from pythonfmu.enums import Fmi2Status

from ...mechanics.arrays import FloatArray
from ...mechanics.contact.profiled import Profiled
from ...mechanics.modal import ModalBody
from ...mechanics.stepping import State
from ..roles import PROFILES, Role, Slot
from .models import Model

EXTRAPOLATED, INTERPOLATED = 1, 2  # of input_hold; with 0 inputs are held


class RailcosimSlave(Fmi2Slave):  # type: ignore[misc]  # pythonfmu has no types
    """One FMU instance; what it is, `interface.json` and `model.npz` in its resources say."""

    def __init__(self, **kwargs: Any) -> None:
        super().__init__(**kwargs)
        resources = Path(self.resources)
        interface = json.loads((resources / "interface.json").read_text(encoding="utf-8"))
        with np.load(resources / "model.npz", allow_pickle=False) as stored:
            body = ModalBody.from_arrays({key: stored[key] for key in stored.files})
        self.table: list[dict[str, Any]] = interface["variables"]
        self.names = [row["name"] for row in self.table]
        # Every variable in one vector, a Boolean as 0 or 1; an FMI reference is a place in it.
        self.values = np.array([float(row["start"] or 0) for row in self.table])
        self.u_refs, self.y_refs = self._refs("input"), self._refs("output")
        least = [self.table[k]["minimum"] for k in self.u_refs]
        self.least = np.array([-np.inf if one is None else one for one in least])
        self.slots = [Slot(row["causality"], Role(row["role"]), row["index"]) for row in self.table]
        table = resources / PROFILES
        profiles = None
        if table.is_file():
            profiles = Profiled.of(json.loads(table.read_text(encoding="utf-8")))
        self.model = Model(body, self.slots, profiles)
        self.hold_ref = self.names.index("input_hold")
        self.configured: dict[tuple[Role, int], float] | None = None
        self.running, self.stale = False, True
        self.time = self.last_step = 0.0
        # Values that outputs are for: inputs as set, or where the last step took them.
        self.shown = self.values.copy()
        self.u_start = self.u_end = self.values[self.u_refs]  # of the last step
        self.behind = 0.0  # see `Model.behind`
        self.state = State(np.empty(0, complex), np.empty(0), np.empty(0))

    def _refs(self, causality: str) -> NDArray[np.intp]:
        rows = [k for k, row in enumerate(self.table) if row["causality"] == causality]
        return np.array(rows, dtype=int)

    def to_xml(self, model_options: Any = None) -> ElementTree.Element:
        """The description written at export, not pythonfmu's, which has no units."""
        return ElementTree.parse(Path(self.resources) / "modelDescription.xml").getroot()

    # --- values -----------------------------------------------------------------------------

    def get_real(self, vrs: list[int]) -> list[float]:
        """Values of variables; outputs are for the inputs last set."""
        if self.stale:
            self._refresh()
        return self.values[vrs].tolist()  # type: ignore[no-any-return]

    def set_real(self, vrs: list[int], values: list[float]) -> None:
        """Set inputs and parameters."""
        self.values[vrs] = values
        self.shown[vrs] = values
        self.stale = True

    def get_integer(self, vrs: list[int]) -> list[int]:
        """Values of Integer variables."""
        return [int(v) for v in self.get_real(vrs)]

    def get_boolean(self, vrs: list[int]) -> list[bool]:
        """Values of Boolean variables."""
        return [bool(v) for v in self.get_real(vrs)]

    set_integer = set_real
    set_boolean = set_real

    def _refresh(self) -> None:
        if not self.running:
            self._settle()
        y, u = np.empty(self.y_refs.size), self.shown[self.u_refs]
        speed = self.model.speed(self.u_end if self.running else u)
        self.model.write(self.state, self.model.read(u), speed * self.time - self.behind, y)
        self.values[self.y_refs] = y
        self.stale = False

    # --- life cycle -------------------------------------------------------------------------

    def setup_experiment(
        self, start_time: float, stop_time: float | None = None, tolerance: float | None = None
    ) -> None:
        """Start the clock."""
        self.time = start_time
        self.stale = True

    def exit_initialization_mode(self) -> None:
        """What is at rest under the parameters and inputs set is the start of the run."""
        self._settle()
        self.u_start = self.u_end = self.values[self.u_refs]
        self.running = True

    def _settle(self) -> None:
        self._configure()
        self.state = self.model.rest(self.model.read(self.values[self.u_refs]))

    def _configure(self) -> None:
        parameters = {
            (slot.role, slot.owner): float(value)
            for row, slot, value in zip(self.table, self.slots, self.values, strict=True)
            if slot.causality == "parameter" and row["variability"] == "fixed"
        }
        if parameters != self.configured:  # a restored state rarely brings others
            self.model.configure(parameters)
            self.configured = parameters

    def do_step(self, current_time: float, step_size: float) -> bool:
        """Step; on failure say why in the log and keep the state."""
        try:
            start, end = self._inputs_over(step_size)
            state = self.model.mover.step(
                self.state, self.model.read(start), self.model.read(end), step_size
            )
        except Exception:
            self.log(traceback.format_exc(), Fmi2Status.error)
            return False
        self.behind += self.model.behind(self.time, step_size, self.u_end, start, end)
        self.state, self.time, self.last_step = state, current_time + step_size, step_size
        self.u_start, self.u_end, self.shown[self.u_refs] = start, end, end
        self.stale = True
        return True

    def _inputs_over(self, step: float) -> tuple[FloatArray, FloatArray]:
        """Inputs at both ends of the step, as `input_hold` says, which may have changed."""
        u, hold = self.values[self.u_refs], int(self.values[self.hold_ref])
        if not (np.isfinite(step) and step > 0):
            raise ValueError(f"step size {step!r} s: must be finite and > 0")
        if not np.isfinite(u).all():
            k = int(self.u_refs[np.argmin(np.isfinite(u))])
            raise ValueError(f"input {self.names[k]} = {self.values[k]!r}: must be finite")
        start, end = u, u
        if hold == EXTRAPOLATED and self.last_step > 0:
            end = u + (u - self.u_start) * (step / self.last_step)
        if hold == INTERPOLATED:
            start = self.u_end
        self._check_range(start, end)
        return start, end

    def _check_range(self, *ends: FloatArray) -> None:
        """Raise ValueError for a speed at which wheels do not creep."""
        for u in ends:
            for k in np.flatnonzero(u < self.least):
                raise ValueError(
                    f"input {self.names[self.u_refs[k]]} = {u[k]:g}: must be at least "
                    f"{self.least[k]:g}, also at the end of a step: standing wheels do not creep, "
                    "they hold"
                )

    # --- state ------------------------------------------------------------------------------

    def _get_fmu_state(self) -> dict[str, Any]:
        return {
            "values": self.values.copy(),
            "u_start": self.u_start.copy(),
            "u_end": self.u_end.copy(),
            "shown": self.shown.copy(),
            "clock": np.array([self.time, self.last_step, self.behind]),
            "flags": np.array([self.running, self.stale]),
            "s": self.state.s.copy(),
            "r": self.state.r.copy(),
            "v": self.state.v.copy(),
        }

    def _set_fmu_state(self, state: dict[str, Any]) -> None:
        self.values = state["values"].copy()
        self.u_start, self.u_end = state["u_start"].copy(), state["u_end"].copy()
        self.shown = state["shown"].copy()
        self.time, self.last_step, self.behind = state["clock"].tolist()
        self.running, self.stale = state["flags"].tolist()
        self.state = State(state["s"].copy(), state["r"].copy(), state["v"].copy())
        self._configure()

    @staticmethod
    def _fmu_state_to_bytes(state: dict[str, Any]) -> bytes:
        buffer = io.BytesIO()
        np.savez(buffer, **state)
        return buffer.getvalue()

    @staticmethod
    def _fmu_state_from_bytes(state: bytes) -> dict[str, Any]:
        with np.load(io.BytesIO(state), allow_pickle=False) as stored:
            return {key: stored[key] for key in stored.files}
