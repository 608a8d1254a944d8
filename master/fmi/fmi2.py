"""The calls of FMI 2.0."""

from __future__ import annotations

import ctypes
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import fmpy
import fmpy.fmi2
import numpy as np

from railcosim.master.batch.call import By, Call
from railcosim.master.component import FloatArray, RunEnded
from railcosim.master.fmi.archive import FmuError
from railcosim.master.fmi.calls import DISCARD, WARNING, Calls, Updated
from railcosim.master.fmi.fmu_parameters import Setting
from railcosim.master.fmi.kinds import Kind, Passed
from railcosim.master.fmi.library import POINTER, Signature
from railcosim.master.fmi.prepared import (
    StateNames,
    memory_of,
    orders_of,
    pointer_to,
    references_of,
)

_INT, _SIZE, _REAL = ctypes.c_int, ctypes.c_size_t, ctypes.c_double
_PASS = (POINTER, _SIZE, POINTER)
"""Value references, how many, values."""
_SIGNATURES: dict[str, Signature] = {
    "fmi2SetupExperiment": (_INT, _REAL, _REAL, _INT, _REAL),
    "fmi2EnterInitializationMode": (),
    "fmi2ExitInitializationMode": (),
    "fmi2Terminate": (),
    **{f"fmi2{way}{kind}": _PASS for way in ("Set", "Get")
       for kind in ("Real", "Integer", "Boolean", "String")},
    "fmi2GetFMUstate": (POINTER,),
    "fmi2SetFMUstate": (POINTER,),
    "fmi2FreeFMUstate": (POINTER,),
    "fmi2SerializedFMUstateSize": (POINTER, POINTER),
    "fmi2SerializeFMUstate": (POINTER, POINTER, _SIZE),
    "fmi2DeSerializeFMUstate": (POINTER, _SIZE, POINTER),
    "fmi2GetDirectionalDerivative": (POINTER, _SIZE, POINTER, _SIZE, POINTER, POINTER),
    "fmi2SetRealInputDerivatives": (POINTER, _SIZE, POINTER, POINTER),
    "fmi2GetRealOutputDerivatives": (POINTER, _SIZE, POINTER, POINTER),
    "fmi2DoStep": (_REAL, _REAL, _INT),
    "fmi2GetStatus": (_INT, POINTER),
    "fmi2GetBooleanStatus": (_INT, POINTER),
    "fmi2NewDiscreteStates": (POINTER,),
    "fmi2EnterContinuousTimeMode": (),
    "fmi2SetContinuousStates": (POINTER, _SIZE),
    "fmi2GetContinuousStates": (POINTER, _SIZE),
    "fmi2GetNominalsOfContinuousStates": (POINTER, _SIZE),
}  # fmt: skip
"""What each function takes after the instance."""
_PENDING = 5
_DO_STEP_STATUS, _TERMINATED = 0, 3  # of what FMI 2 gives a status
_LONGEST_NAP = 0.01  # s
"""How often an FMU may ask for another event iteration before it counts as stuck."""


class Fmi2Calls(Calls):
    """See `Calls`."""

    continuous_time = "fmi2EnterContinuousTimeMode"
    platform = fmpy.platform
    signatures = _SIGNATURES
    states = StateNames(
        "fmi2GetFMUstate",
        "fmi2SetFMUstate",
        "fmi2FreeFMUstate",
        "fmi2SerializedFMUstateSize",
        "fmi2SerializeFMUstate",
        "fmi2DeSerializeFMUstate",
    )

    # --- life ----------------------------------------------------------------------------------

    def _instantiate(self, kind: int, resources: Path) -> int | None:
        """Make the instance, with its logging on; None if it will not be made."""
        make = self._library.bare("fmi2Instantiate")
        make.restype = ctypes.c_void_p  # type: ignore[attr-defined]
        known = (self._name, self._description.guid, resources.as_uri())
        name, guid, place = (ctypes.c_char_p(text.encode()) for text in known)
        self._callbacks = self.log.fmi2_callbacks()  # must live as long as the instance
        # Logging on: a Python FMU says nothing about its exceptions otherwise.
        instance: int | None = make(name, kind, guid, place, ctypes.byref(self._callbacks), 0, 1)
        return instance

    def _free_instance(self) -> None:
        """Free the instance."""
        end = self._library.bare("fmi2FreeInstance")
        end.restype = None  # type: ignore[attr-defined]
        end(ctypes.c_void_p(self._component))

    def set_value(self, setting: Setting) -> None:
        """Give a parameter its value."""
        value = (setting.kind.c_type * 1)(setting.value)
        name = f"fmi2Set{setting.kind.function}"
        self.call(name, references_of((setting.reference,)), 1, value)

    def get_text(self, kind: Kind, reference: int) -> bytes:
        """What a text is now."""
        value = (ctypes.c_char_p * 1)()
        self.call(f"fmi2Get{kind.function}", references_of((reference,)), 1, value)
        return value[0] or b""

    def resize(self, settings: Sequence[Setting]) -> None:
        """There are no structural parameters."""

    def enter_initialization(
        self, start: float, stop: float | None, tolerance: float | None
    ) -> None:
        """Announce the time span, s, and enter initialisation mode."""
        self.call(
            "fmi2SetupExperiment",
            tolerance is not None,
            tolerance or 0.0,
            start,
            stop is not None,
            stop or 0.0,
        )
        self.call("fmi2EnterInitializationMode")

    def exit_initialization(self) -> None:
        """Leave it."""
        self.call("fmi2ExitInitializationMode")

    def terminate(self) -> None:
        """Say that the run is over."""
        self.call("fmi2Terminate")

    # --- values --------------------------------------------------------------------------------

    def passing(self, way: str, passed: Passed, values: Any) -> Call:
        """Bind a call that sets or gets to an array's memory."""
        references = references_of(passed.references)
        return self.prepare(
            f"fmi2{way}{passed.function}",
            ctypes.byref(references),
            ctypes.c_size_t.from_param(passed.count),
            ctypes.byref(values),
            kind=By.PASS2,
            places=ctypes.addressof(references),
            count=passed.count,
            values=ctypes.addressof(values),
        )

    def input_derivatives(
        self, passed: Passed, u: FloatArray, highest: int
    ) -> Callable[[FloatArray], None]:
        """What gives Real inputs their derivatives for the next step."""
        del u  # the FMU knows them
        n = passed.count
        known = np.zeros((highest, n))
        number = ctypes.c_size_t()
        call = self.prepare(
            "fmi2SetRealInputDerivatives",
            ctypes.byref(references_of(passed.references * highest)),
            number,
            ctypes.byref(orders_of(n, highest)),
            ctypes.byref(memory_of(known)),
        )

        def give(derivatives: FloatArray) -> None:
            order = len(derivatives)
            known[:order] = derivatives
            number.value = order * n
            call.make()

        return give

    def get_output_rates(self, references: Sequence[int], rates: FloatArray) -> None:
        """Rates of Real outputs at the end of the last step."""
        n, all_of = rates.size, references_of(tuple(references))
        self.call("fmi2GetRealOutputDerivatives", all_of, n, orders_of(n, 1), pointer_to(rates))

    def derivative(
        self,
        unknowns: Sequence[int],
        knowns: Sequence[int],
        seed: FloatArray,
        change: FloatArray,
    ) -> None:
        """Change of the unknowns for a change `seed` of the knowns."""
        self.call(
            "fmi2GetDirectionalDerivative",
            references_of(tuple(unknowns)),
            len(unknowns),
            references_of(tuple(knowns)),
            len(knowns),
            pointer_to(seed),
            pointer_to(change),
        )

    # --- steps ---------------------------------------------------------------------------------

    def prepare_step(self) -> None:
        """Bind the step to its numbers."""
        span, is_final = self.step.span, ctypes.c_int.from_param(self.is_final)
        self._bind(
            self.step, "fmi2DoStep", span.begin, span.length, is_final,
            kind=By.STEP2, is_final=self.is_final, span=span.address,
        )  # fmt: skip

    def after_step(self, status: int) -> None:
        """Wait for a step that goes on by itself; raise for one that was not made."""
        self.time = self.step.span.begin.value
        nap = 1e-5
        while status == _PENDING:
            time.sleep(nap)
            nap = min(2 * nap, _LONGEST_NAP)
            status = self._status("fmi2GetStatus", _DO_STEP_STATUS, _PENDING)
        if status <= WARNING:
            return
        failed = any(s in {"error", "fatal"} for s, _ in self.log.messages)
        if (
            status == DISCARD
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
            known = DISCARD
        if known > WARNING:
            return default if default != _PENDING else known
        return value.value

    # --- Model Exchange ------------------------------------------------------------------------

    def update_discrete_states(self) -> Updated:
        """Let one event iteration pass."""
        info = fmpy.fmi2.fmi2EventInfo()
        self.call("fmi2NewDiscreteStates", ctypes.byref(info))
        next_time = info.nextEventTime if info.nextEventTimeDefined else np.inf
        return Updated(
            bool(info.newDiscreteStatesNeeded), bool(info.terminateSimulation), next_time
        )

    def set_states(self, states: FloatArray) -> None:
        """Set the continuous states."""
        self.call("fmi2SetContinuousStates", pointer_to(states), states.size)

    def get_states(self, states: FloatArray, nominals: FloatArray) -> None:
        """Get them, and how large they typically are."""
        self.call("fmi2GetContinuousStates", pointer_to(states), states.size)
        self.call("fmi2GetNominalsOfContinuousStates", pointer_to(nominals), states.size)
