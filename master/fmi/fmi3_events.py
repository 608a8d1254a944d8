"""Event mode of an FMI 3.0 FMU with clocks: they tick within its steps, at their times."""

from __future__ import annotations

import ctypes
import math
from collections.abc import Callable
from typing import TYPE_CHECKING

from railcosim.master.batch.call import Call
from railcosim.master.component import ComponentError
from railcosim.master.fmi.archive import FmuError
from railcosim.master.fmi.calls import EVENT_ITERATIONS, WARNING
from railcosim.master.fmi.prepared import references_of

if TYPE_CHECKING:
    from railcosim.master.fmi.description import FmuDescription
    from railcosim.master.fmi.fmi3 import Fmi3Calls
    from railcosim.master.fmi.from_raw import Clock

_ROUNDING = 1e-9
"""Part of a communication step by which a tick may miss its end and be at it."""
_CHANGED = 2  # of what FMI 3 says of an interval
_PERIODIC = {"constant", "fixed", "tunable"}
_ASKED = {"changing", "countdown"}


class Events:
    """The events of one FMU.

    A clock that ticks at a communication point does so at the end of the step that leads there.

    Parameters
    ----------
    calls : Fmi3Calls
        Of the FMU.
    description : FmuDescription
        Its clocks.

    Attributes
    ----------
    ticks : tuple of float
        Next event that the FMU wants (s); then of each clock a time (s), how many intervals after
        it the next tick is, and the interval (s).

    Raises
    ------
    FmuError
        For a clock that somebody else has to trigger.
    """

    def __init__(self, calls: Fmi3Calls, description: FmuDescription) -> None:
        self._calls = calls
        self._clocks = description.clocks
        self._path = description.path
        self._takes_any_step = description.takes_any_step
        self._in_event_mode = False
        self._is_initialised = False
        for clock in self._clocks:
            if clock.variability not in _PERIODIC | _ASKED:
                raise FmuError(
                    f"{self._path}: its clock {clock.name} is {clock.variability or 'of no kind'}: "
                    "somebody else has to trigger it, which this master does not"
                )
        self.ticks: tuple[float, ...] = (math.inf, *(0.0,) * (3 * len(self._clocks)))

    def begin(self, t: float) -> None:
        """From initialisation mode, through the events at `t` (s), into step mode."""
        ticks = [math.inf]
        for clock in self._clocks:
            interval = clock.interval
            if clock.variability in _PERIODIC and interval is None:
                interval = self._interval(clock)
                if interval is None:
                    raise FmuError(f"{self._path}: its clock {clock.name} has no interval")
            never = clock.variability == "countdown"
            first = math.inf if never else t + clock.shift
            ticks += [first, 0.0, interval or 0.0]
        self.ticks = tuple(ticks)
        self._in_event_mode = self._is_initialised = True
        self._event(t)

    def step(self, begin: float, end: float, pieces: int) -> float:
        """Go from `begin` to `end` (s), through all events between; where it ended.

        In no more than so many pieces that end where they began.
        """
        now, slack, left = begin, _ROUNDING * (end - begin), pieces
        while now < end and not self._calls.is_ending:
            if not left:
                raise ComponentError(
                    f"{self._calls._name}: fmi3DoStep from t = {now:.9g} s returned early, at "
                    f"once, {pieces} times"
                )
            goal = min(end, self._next())
            goal = end if goal > end - slack else goal
            if goal < end and not self._takes_any_step:
                raise ComponentError(
                    f"{self._calls._name}: has an event at t = {goal:.9g} s, within a step, and "
                    "takes steps of one length only; take a step that its intervals are whole "
                    "numbers of"
                )
            if goal > now:
                last, now = now, self._calls.go(now, goal)
                left = pieces if now > last + slack else left - 1
            if self._calls.event_needed or self._next() <= now + slack:
                self._event(now + slack)
        return now

    def around(self, call: Call) -> Call:
        """A call that sets what may change at events only, in event mode."""

        def in_event_mode() -> int:
            if not self._is_initialised:
                return call.function(*call.arguments) or 0
            self._enter()
            status = call.function(*call.arguments) or 0
            if status <= WARNING:
                self._iterate(self._calls.time)
            return status

        return Call(in_event_mode, (), call.name, call.see_to)

    def let(self, action: Callable[[], None]) -> None:
        """Do in event mode what is allowed at events only; before the steps as it is."""
        if not self._is_initialised:
            action()
            return
        self._enter()
        action()
        self._iterate(self._calls.time)

    def _next(self) -> float:
        """When something is to happen next, s."""
        wanted, *clocks = self.ticks
        times = (
            base + (count * interval if count else 0.0)
            for base, count, interval in zip(clocks[::3], clocks[1::3], clocks[2::3], strict=True)
        )
        return min([wanted, *times])

    def _event(self, until: float) -> None:
        """Let all clocks tick that are to tick up to `until` (s), and see what follows."""
        for _ in range(EVENT_ITERATIONS):
            self._enter()
            wanted, *rest = self.ticks
            ticks, ticking = [math.inf if wanted <= until else wanted], []
            for k, clock in enumerate(self._clocks):
                base, count, interval = rest[3 * k : 3 * k + 3]
                at = base + (count * interval if count else 0.0)
                if at <= until:
                    ticking.append(clock.reference)
                    base, count = (
                        (math.inf, 0.0)
                        if clock.variability == "countdown"
                        else ((base, count + 1.0) if clock.variability in _PERIODIC else (at, 1.0))
                    )
                ticks += [base, count, interval]
            self.ticks = tuple(ticks)
            if ticking:
                on = (ctypes.c_bool * len(ticking))(*[True] * len(ticking))
                self._calls.call("fmi3SetClock", references_of(tuple(ticking)), len(ticking), on)
            self._iterate(until)
            if self._calls.is_ending or self._next() > until:
                return
        raise ComponentError(
            f"{self._calls._name}: its clocks at t = {until:.9g} s tick without end"
        )

    def _enter(self) -> None:
        if not self._in_event_mode:
            self._calls.call("fmi3EnterEventMode")
            self._in_event_mode = True

    def _iterate(self, now: float) -> None:
        """Let discrete states settle, and go on to step mode."""
        for _ in range(EVENT_ITERATIONS):
            updated = self._calls.update_discrete_states()
            self.ticks = (updated.next_time, *self.ticks[1:])
            self._ask(now)
            if updated.ends:
                self._calls.end()
            if updated.ends or not updated.again:
                self._calls.call("fmi3EnterStepMode")
                self._in_event_mode = False
                return
        raise ComponentError(
            f"{self._calls._name}: its events at t = {now:.9g} s do not end "
            f"({EVENT_ITERATIONS} iterations)"
        )

    def _ask(self, now: float) -> None:
        """Ask for the intervals that may have changed."""
        ticks = list(self.ticks)
        for k, clock in enumerate(self._clocks):
            if clock.variability in _ASKED:
                interval = self._interval(clock)
                if interval is None:
                    continue
                where = 1 + 3 * k
                if clock.variability == "countdown":
                    ticks[where : where + 3] = [now, 1.0, interval]
                else:
                    ticks[where + 2] = interval
        self.ticks = tuple(ticks)

    def _interval(self, clock: Clock) -> float | None:
        """The interval of a clock, s, if it is new."""
        value, what = ctypes.c_double(), ctypes.c_int()
        references = references_of((clock.reference,))
        self._calls.call(
            "fmi3GetIntervalDecimal", references, 1, ctypes.byref(value), ctypes.byref(what)
        )
        if what.value != _CHANGED:
            return None
        least = 0.0 if clock.variability == "countdown" else math.ulp(0.0)
        if not least <= value.value < math.inf:
            raise ComponentError(
                f"{self._calls._name}: the interval of its clock {clock.name} is {value.value} s"
            )
        return value.value
