"""The calls of FMI 3.0."""

from __future__ import annotations

import ctypes
import os
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, NoReturn

import fmpy
import fmpy.fmi3
import numpy as np

from railcosim.master.batch.call import By, Call
from railcosim.master.component import ComponentError, FloatArray, RunEnded
from railcosim.master.fmi.archive import FmuError
from railcosim.master.fmi.calls import CO_SIMULATION, DISCARD, WARNING, Calls, Updated
from railcosim.master.fmi.fmi3_events import Events
from railcosim.master.fmi.fmi3_interpolation import Interpolation
from railcosim.master.fmi.fmi3_signatures import SIGNATURES
from railcosim.master.fmi.fmu_log import fmi3_logger
from railcosim.master.fmi.fmu_parameters import Setting
from railcosim.master.fmi.kinds import Kind, Passed
from railcosim.master.fmi.prepared import (
    StateNames,
    memory_of,
    orders_of,
    pointer_to,
    references_of,
)

_ROUNDING = 1e-12
"""Part of a step that counts as nothing."""
_PIECES = 10_000
"""Into how many pieces an FMU may cut a step."""


class Fmi3Calls(Calls):
    """See `Calls`. Event mode is used of FMUs with clocks alone; others see to their own events."""

    continuous_time = "fmi3EnterContinuousTimeMode"
    platform = fmpy.platform_tuple
    signatures = SIGNATURES
    states = StateNames(
        "fmi3GetFMUState",
        "fmi3SetFMUState",
        "fmi3FreeFMUState",
        "fmi3SerializedFMUStateSize",
        "fmi3SerializeFMUState",
        "fmi3DeserializeFMUState",
    )

    # --- life ----------------------------------------------------------------------------------

    def _instantiate(self, kind: int, resources: Path) -> int | None:
        """Make the instance, with its logging on; None if it will not be made."""
        d = self._description
        self._flags = (ctypes.c_bool * 4)()  # event, end, early return, inputs given derivatives
        self.step.asks = ctypes.c_uint32.from_buffer(self._flags)
        self._last = ctypes.c_double()
        self._piece_begin, self._piece_length = ctypes.c_double(), ctypes.c_double()
        self._events = Events(self, d) if d.clocks and kind == CO_SIMULATION else None
        self._interpolation = Interpolation(self) if d.can_interpolate_inputs else None
        known = (self._name, d.guid, str(resources) + os.sep)
        texts = [ctypes.c_char_p(text.encode()) for text in known]
        if kind != CO_SIMULATION:
            make = self._library.bare("fmi3InstantiateModelExchange")
            make.restype = ctypes.c_void_p  # type: ignore[attr-defined]
            return make(  # type: ignore[no-any-return]
                *texts, ctypes.c_bool(False), ctypes.c_bool(True), ctypes.c_void_p(self.log.key),
                fmi3_logger,
            )  # fmt: skip
        has_events = ctypes.c_bool(self._events is not None)
        between = self._interpolation
        references = between.references if between is not None else ()
        self._callback = (  # must live as long as the instance
            fmpy.fmi3.fmi3IntermediateUpdateCallback(between.update)
            if between is not None
            else fmpy.fmi3.fmi3IntermediateUpdateCallback()
        )
        make = self._library.bare("fmi3InstantiateCoSimulation")
        make.restype = ctypes.c_void_p  # type: ignore[attr-defined]
        return make(  # type: ignore[no-any-return]
            *texts, ctypes.c_bool(False), ctypes.c_bool(True), has_events, has_events,
            references_of(references), ctypes.c_size_t(len(references)),
            ctypes.c_void_p(self.log.key), fmi3_logger, self._callback,
        )  # fmt: skip

    def _free_instance(self) -> None:
        """Free the instance."""
        end = self._library.bare("fmi3FreeInstance")
        end.restype = None  # type: ignore[attr-defined]
        end(ctypes.c_void_p(self._component))

    def set_value(self, setting: Setting) -> None:
        """Give a parameter or text its value; of an array one element."""
        if self._events is None:
            self._set_value(setting)
        else:
            self._events.let(lambda: self._set_value(setting))

    def _set_value(self, setting: Setting) -> None:
        """The same, in the mode that is."""
        kind, n = setting.kind, setting.size
        references = references_of((setting.reference,))
        if kind.type is not None:
            values = np.zeros(n, dtype=np.dtype(kind.c_type))
            memory = memory_of(values, kind.c_type)
            if n > 1:
                self.call(f"fmi3Get{kind.function}", references, 1, memory, n)
            values[setting.element] = setting.value
            self.call(f"fmi3Set{kind.function}", references, 1, memory, n)
            return
        if n > 1:
            raise FmuError(f"{self._name}: arrays of texts and bytes cannot be set")
        text = (ctypes.c_char_p * 1)(setting.value)
        if kind.name == "Binary":
            length = (ctypes.c_size_t * 1)(len(setting.value))
            self.call("fmi3SetBinary", references, 1, length, text, 1)
        else:
            self.call("fmi3SetString", references, 1, text, 1)

    def get_text(self, kind: Kind, reference: int) -> bytes:
        """What a text or bytes are now."""
        references = references_of((reference,))
        if kind.name == "Binary":
            place, length = (ctypes.c_void_p * 1)(), (ctypes.c_size_t * 1)()
            self.call("fmi3GetBinary", references, 1, length, place, 1)
            return ctypes.string_at(place[0], length[0]) if place[0] else b""
        value = (ctypes.c_char_p * 1)()
        self.call("fmi3GetString", references, 1, value, 1)
        return value[0] or b""

    def resize(self, settings: Sequence[Setting]) -> None:
        """Give structural parameters their values."""
        self.call("fmi3EnterConfigurationMode")
        for setting in settings:
            self.set_value(setting)
        self.call("fmi3ExitConfigurationMode")

    def enter_initialization(
        self, start: float, stop: float | None, tolerance: float | None
    ) -> None:
        """Announce the time span, s, and enter initialisation mode."""
        self.call(
            "fmi3EnterInitializationMode",
            tolerance is not None,
            tolerance or 0.0,
            start,
            stop is not None,
            stop or 0.0,
        )

    def exit_initialization(self) -> None:
        """Leave it."""
        self.call("fmi3ExitInitializationMode")
        if self._events is not None:
            self._events.begin(self.time)

    def terminate(self) -> None:
        """Say that the run is over."""
        self.call("fmi3Terminate")

    # --- values --------------------------------------------------------------------------------

    def passing(self, way: str, passed: Passed, values: Any) -> Call:
        """Bind a call that sets or gets to an array's memory."""
        references = references_of(passed.references)
        call = self.prepare(
            f"fmi3{way}{passed.function}",
            ctypes.byref(references),
            ctypes.c_size_t.from_param(len(passed.references)),
            ctypes.byref(values),
            ctypes.c_size_t.from_param(passed.count),
            kind=By.PASS3,
            places=ctypes.addressof(references),
            count=len(passed.references),
            values=ctypes.addressof(values),
            size=passed.count,
        )
        if way == "Set" and self._events is not None and passed.jumps:
            return self._events.around(call)
        return call

    def input_derivatives(
        self, passed: Passed, u: FloatArray, highest: int
    ) -> Callable[[FloatArray], None]:
        """What gives Real inputs their derivatives for the next step."""
        assert self._interpolation is not None
        give = self._interpolation.bind(passed, u, highest)

        def given(derivatives: FloatArray) -> None:
            give(derivatives)
            self._flags[3] = True  # to be forgotten after the step

        return given

    def get_output_rates(self, references: Sequence[int], rates: FloatArray) -> None:
        """Rates of Real outputs at the end of the last step."""
        refs, n = references_of(tuple(references)), rates.size
        orders = orders_of(len(references), 1)
        self.call("fmi3GetOutputDerivatives", refs, len(references), orders, pointer_to(rates), n)

    def derivative(
        self,
        unknowns: Sequence[int],
        knowns: Sequence[int],
        seed: FloatArray,
        change: FloatArray,
    ) -> None:
        """Change of the unknowns for a change `seed` of the knowns."""
        self._sensitivity("fmi3GetDirectionalDerivative", unknowns, knowns, seed, change)

    def adjoint(
        self,
        unknowns: Sequence[int],
        knowns: Sequence[int],
        seed: FloatArray,
        change: FloatArray,
    ) -> None:
        """Sum of `seed` times the derivatives of the unknowns, by each of the knowns."""
        self._sensitivity("fmi3GetAdjointDerivative", unknowns, knowns, seed, change)

    def _sensitivity(
        self,
        function: str,
        unknowns: Sequence[int],
        knowns: Sequence[int],
        seed: FloatArray,
        change: FloatArray,
    ) -> None:
        of, by = references_of(tuple(unknowns)), references_of(tuple(knowns))
        self.call(
            function, of, len(unknowns), by, len(knowns), pointer_to(seed), seed.size,
            pointer_to(change), change.size,
        )  # fmt: skip

    # --- steps ---------------------------------------------------------------------------------

    def prepare_step(self) -> None:
        """Bind the step to its numbers."""
        event, end, early = (ctypes.byref(self._flags, k) for k in range(3))
        answers = (event, end, early, ctypes.byref(self._last))
        is_final, span = ctypes.c_bool.from_param(self.is_final), self.step.span
        begin, length = self._piece_begin, self._piece_length
        self._piece = self.prepare("fmi3DoStep", begin, length, is_final, *answers)
        self._bind(
            self.step, "fmi3DoStep", span.begin, span.length, is_final, *answers,
            kind=By.STEP3, is_final=self.is_final, span=span.address,
            flags=ctypes.addressof(self._flags), last=ctypes.addressof(self._last),
        )  # fmt: skip
        if self._events is not None:
            self.step.become(self._in_events)

    def after_step(self, status: int) -> None:
        """Go on where an FMU returned early; end the run if it wants that."""
        begin = self.time = self.step.span.begin.value
        if status > WARNING:
            self._refuse_step(status)
        end = begin + self.step.span.length.value
        try:
            if self._interpolation is not None:
                self._interpolation.begin = begin
            now = self._reached(begin, end)
            for _ in range(_PIECES):
                if now >= end or self._flags[1]:
                    break
                now = self.go(now, end)
            else:
                raise ComponentError(
                    f"{self._name}: fmi3DoStep from t = {begin:.9g} s returned early "
                    f"{_PIECES} times, and is at t = {now:.9g} s"
                )
        finally:
            self._flags[3] = False
            if self._interpolation is not None:
                self._interpolation.over()
        if self._flags[1]:
            if now < end:
                self._end_run()
            # What was reached is a result; the next step is the one that will not be made.
            self.step.become(self._end_run)

    def go(self, now: float, goal: float) -> float:
        """Step from `now` towards `goal` (s); where that ended."""
        self._piece_begin.value, self._piece_length.value = now, goal - now
        status = self._piece.function(*self._piece.arguments) or 0
        if status > WARNING:
            self._refuse_step(status)
        return self._reached(now, goal)

    def _reached(self, begin: float, end: float) -> float:
        """Where the last step ended, s."""
        if self._interpolation is not None:
            self._interpolation.check()
        last = self._last.value
        if not self._flags[2] or last >= end - _ROUNDING * (end - begin):
            return end
        if not last >= begin:
            raise ComponentError(
                f"{self._name}: fmi3DoStep from t = {begin:.9g} s returned early, at t = {last} s"
            )
        return last

    def _in_events(self) -> int:
        """A step of an FMU with clocks."""
        assert self._events is not None
        begin = self.step.span.begin.value
        end = begin + self.step.span.length.value
        if self._interpolation is not None:  # inputs go along from here, not from the last event
            self._interpolation.begin = begin
        now = self._events.step(begin, end, _PIECES)
        self._last.value = now
        self._flags[2] = now < end
        return 0

    def _refuse_step(self, status: int) -> NoReturn:
        """Say why a step was not made."""
        failed = any(s in {"error", "fatal"} for s, _ in self.log.messages)
        if status == DISCARD and self._flags[1] and not failed:
            self._end_run()
        self.refuse("fmi3DoStep", status)

    def _end_run(self) -> NoReturn:
        said = self.log.quote() if self.log.messages else ""
        raise RunEnded(f"{self._name} ended the run after t = {self.time:.9g} s.{said}")

    @property
    def event_needed(self) -> bool:
        """Whether the last step ended at an event."""
        return bool(self._flags[0])

    @property
    def is_ending(self) -> bool:
        """Whether the FMU wants to end the run."""
        return bool(self._flags[1])

    def end(self) -> None:
        """Take note that it wants to, in an event."""
        self._flags[1] = True

    def beside_state(self) -> tuple[float, ...]:
        """Time, and when clocks tick."""
        return () if self._events is None else (self.time, *self._events.ticks)

    def take_back(self, beside: tuple[float, ...]) -> None:
        """Be as `beside_state` said."""
        if self._events is not None:
            self.time, *ticks = beside
            self._events.ticks = tuple(ticks)
        self._flags[1] = False
        if self.step in self._prepared:  # if it was at its end, it is no more
            self.prepare_step()

    # --- events and Model Exchange -------------------------------------------------------------

    def update_discrete_states(self) -> Updated:
        """Let one event iteration pass."""
        answers = (ctypes.c_bool * 5)()
        next_time = ctypes.c_double()
        each = [ctypes.byref(answers, k) for k in range(5)]
        self.call("fmi3UpdateDiscreteStates", *each, ctypes.byref(next_time))
        again, ends, _, _, has_next = answers
        return Updated(bool(again), bool(ends), next_time.value if has_next else np.inf)

    def set_states(self, states: FloatArray) -> None:
        """Set the continuous states."""
        self.call("fmi3SetContinuousStates", pointer_to(states), states.size)

    def get_states(self, states: FloatArray, nominals: FloatArray) -> None:
        """Get them, and how large they typically are."""
        self.call("fmi3GetContinuousStates", pointer_to(states), states.size)
        self.call("fmi3GetNominalsOfContinuousStates", pointer_to(nominals), states.size)
