"""The largest stable communication step of a vehicle and a track, from their linear models."""

from __future__ import annotations

import math
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from typing import Any, Protocol

import numpy as np

from railcosim.analysis.pair.contact import Stiffness
from railcosim.analysis.pair.linear_contact import LinearLaw
from railcosim.analysis.pair.linear_pair import Part
from railcosim.analysis.pair.owner import Owner
from railcosim.master.component import ComponentError, FloatArray
from railcosim.master.progress import Progress, unheard
from railcosim.master.schemes import ConvergenceError, Scheme
from railcosim.master.schemes.interface_jacobian import InterfaceJacobian
from railcosim.master.schemes.iteration import Iterated
from railcosim.master.stability.amplification import Amplification
from railcosim.master.stability.amplifier import Amplifier
from railcosim.master.stability.windows import Probe, unstable_ranges
from railcosim.master.system import System

RATE, FAST = 0.01, 1.0
"""Growth (1/s) that counts, and that is seen in a run of seconds. Slower growth than the first is
not told from none: the damping of a track's least damped mode is no larger."""
SHORTEST, LONGEST = 2e-6, 1e-2
"""Range of steps that is searched, s."""

FAILURES = ComponentError, ArithmeticError, np.linalg.LinAlgError
"""Of a scheme that cannot make a step."""
TOGETHER = 1024
"""Steps whose determinants are found at once, times the wheels squared, as their maps grow: more do
not fit into a cache."""
AT_ONCE = 1_000_000
"""Complex numbers of all modes in these maps, at the most: 16 MB, and seven times that while they
are made. In space a mode has 64 of them a step."""
FINE = 1e-10
"""Tolerance of forces, relative: far below what a step does to them, far above rounding."""


@dataclass(frozen=True, kw_only=True)
class Window:
    """A range of steps at which something grows.

    Attributes
    ----------
    begin, end : float
        Its edges, s; the last window may have no end within the range that is searched: infinite.
    fast : float
        Its first step at which something grows faster than `FAST`, s; infinite if nothing does.
    growth : float
        Rate (1/s) in the middle of a window with an end, or where it was found, if that is more;
        infinite of one without.
    """

    begin: float
    end: float
    fast: float
    growth: float

    def and_then(self, after: Window) -> Window:
        """With one that touches it above."""
        return Window(
            begin=self.begin, end=after.end,
            fast=min(self.fast, after.fast), growth=max(self.growth, after.growth),
        )  # fmt: skip


@dataclass(frozen=True, kw_only=True)
class Limit:
    """How far a coupling is stable.

    Attributes
    ----------
    windows : tuple of Window
        All ranges found at which something grows, in order.
    evaluations : int
        How often each component is stepped in a step, at the most.
    """

    windows: tuple[Window, ...]
    evaluations: int

    @property
    def step(self) -> float:
        """The largest step, s, up to which nothing grows; infinite if nothing does at any."""
        return self.windows[0].begin if self.windows else math.inf

    @property
    def fast(self) -> float:
        """The largest step, s, up to which nothing grows faster than `FAST`, or infinite."""
        return min((window.fast for window in self.windows), default=math.inf)


class SprungPair:
    """A pair with contacts of one law on one side, for all schemes.

    Parameters
    ----------
    parts : sequence of Part
        The pair.
    owner : Owner
        Of the contacts.
    contact : float or array
        Stiffness, N/m, or tangents of the contacts' laws, see `Part.tangents`.

    Attributes
    ----------
    parts : tuple of Part
        As given.
    systems : list of System
        One a part, at rest.
    exact : float
        Rate (1/s) at which something grows if vehicle and track are coupled exactly; zero if both
        are passive.
    rate : float
        What grows slower (1/s) counts as stable: `RATE` beyond that.
    resonant : float
        Step at which the track's fastest mode turns by half, s.
    """

    def __init__(self, parts: Sequence[Part], owner: Owner, contact: Stiffness) -> None:
        laws = [LinearLaw(part, contact) for part in parts]
        self.parts = tuple(parts)
        self.systems = [law.system(owner) for law in laws]
        self.exact = max(0.0, *(law.growth() for law in laws))
        self.rate = RATE + self.exact
        fastest = max(float(part.track.poles.imag.max()) for part in parts)
        self.resonant = math.pi / fastest
        self.rests = [system.save_state() for system in self.systems]
        self.fast, self.shortest = self.exact + FAST, SHORTEST
        self.width = max(len(part.wheels) for part in self.parts)


class Observed(Protocol):
    """What `Coupling` asks: `SprungPair`, or `black_boxes.Boxes`."""

    @property
    def parts(self) -> tuple[Part, ...]:
        """Of a pair; of other systems none."""

    @property
    def systems(self) -> list[System]:
        """Of linear components left open, at rest."""

    @property
    def rests(self) -> list[Any]:
        """Their states."""

    @property
    def exact(self) -> float:
        """Rate (1/s) at which something grows if all is coupled exactly."""

    @property
    def rate(self) -> float:
        """What grows slower (1/s) counts as stable."""

    @property
    def fast(self) -> float:
        """And as slow."""

    @property
    def shortest(self) -> float:
        """Where the search begins, s."""

    @property
    def resonant(self) -> float:
        """Step at which the fastest mode turns by half, s."""

    @property
    def width(self) -> int:
        """How many contacts there are."""


class Coupling:
    """A scheme at a contact, ready to be asked.

    Parameters
    ----------
    pair : SprungPair or Boxes
        Vehicle, track and the springs between them, or other components.
    scheme : Scheme
        The scheme.

    Raises
    ------
    ValueError
        If the scheme does not suit the owner.

    Attributes
    ----------
    parts : tuple of Part
        The pair; of other systems none.
    rate, fast : float
        What grows slower (1/s) counts as stable, and as slow.
    contraction : float
        What an evaluation may leave of an error if the scheme iterates, else 1.
    """

    def __init__(self, pair: Observed, scheme: Scheme) -> None:
        scheme = _observed(scheme)
        self.parts, self._width = pair.parts, pair.width
        self.rate, self.fast = pair.rate, pair.fast
        self._shortest, self._resonant = pair.shortest, pair.resonant
        self.amplifiers = []
        for system, rest in zip(pair.systems, pair.rests, strict=True):
            system.restore_state(rest)
            self.amplifiers.append(Amplifier(system, scheme))
        scheme.start(self.amplifiers[0].system)
        self.contraction = 1.0
        if isinstance(scheme, Iterated):  # as many evaluations as it allows make any guess good
            until = scheme.until
            self.contraction = until.relative ** (1.0 / max(until.max_evaluations - 1, 1))
        self._last: tuple[float, list[Amplification]] = 0.0, []
        self._grades = dict[float, int]()
        self._was_fast = False

    @property
    def evaluations(self) -> int:
        """How often each component was stepped in a step, at the most, so far."""
        return max(a.evaluations for a in self.amplifiers)

    def is_stable(self, h: float) -> bool:
        """Whether nothing grows with steps of `h` (s); a scheme that fails is not stable."""
        return self._within(self.rate, h)

    def _within(self, rate: float, h: float) -> bool:
        try:
            return all(a.growing(rate) == 0 for a in self._at(h))
        except FAILURES:
            return False

    def _at(self, h: float) -> list[Amplification]:
        """What the step does, of each part; the last length asked for is kept.

        Raises
        ------
        ConvergenceError
            If the scheme iterates, and is not sure to come to an end.
        """
        if self._last[0] != h:
            self._last = h, [a.at(h) for a in self.amplifiers]
        if self.contraction < 1.0 and self.contracts(h) > self.contraction:
            raise ConvergenceError(f"steps of {h:g} s may take too many evaluations")
        return self._last[1]

    def contracts(self, h: float) -> float:
        """What an evaluation leaves of an error in a step of `h` (s), if the scheme iterates."""
        if self._last[0] != h:
            self._last = h, [a.at(h) for a in self.amplifiers]
        return max(a.contraction for a in self._last[1])

    def growth(self, h: float) -> float:
        """Rate (1/s) of the fastest-growing motion with steps of `h` (s); infinite if it fails.

        Negative if all motions die away: then of the one that does so most slowly.
        """
        try:
            return max(a.growth() for a in self._at(h))
        except FAILURES:
            return math.inf

    def limit(self, longest: float = LONGEST, progress: Progress = unheard) -> Limit:
        """Find where something grows, see `unstable_ranges`; edges are known to 0.05 %.

        Parameters
        ----------
        longest : float, optional
            Where the search ends, s.
        progress : callable, optional
            Told how far the search is, of 1; may raise to stop it.
        """
        scale, far = math.log(longest / self._shortest), 0.0

        def look(h: float) -> int:
            nonlocal far
            far = max(far, math.log(h / self._shortest) / scale)
            progress(far, 1.0)  # all steps are looked at once, then some in between
            return self._grade(h)

        probe = Probe(grade=look, ends=self._ends)
        found = unstable_ranges(probe, self._shortest, self._resonant, longest)
        windows = list[Window]()
        for begin, end, grade, h in found:
            fast = begin if grade > 1 else math.inf
            # The middle was not always looked at, and at its edges a window does not grow.
            growth = max(self._growth_inside(at, end) for at in (h, 0.5 * (begin + end)))
            window = Window(begin=begin, end=end, fast=fast, growth=growth)
            if windows and windows[-1].end == begin:  # slower or faster growth goes on
                window = windows.pop().and_then(window)
            windows.append(window)
        return Limit(windows=tuple(windows), evaluations=self.evaluations)

    def _grade(self, h: float) -> int:
        """0 if nothing grows, 1 if something does, 2 if fast; found once for each step."""
        if h not in self._grades:
            self._grades[h] = self._new_grade(h)
        return self._grades[h]

    def _new_grade(self, h: float) -> int:
        fast = self.fast
        try:
            radius, step = math.exp(fast * h), self._at(h)
            # What grows fast at one step mostly does so by far at the next.
            if self._was_fast and any(a.determinant.zero_outside(radius, far=True) for a in step):
                return 2
            grade = 0 if self._within(self.rate, h) else 1 if self._within(fast, h) else 2
        except FAILURES:
            grade = 2
        self._was_fast = grade == 2
        return grade

    def _growth_inside(self, h: float, end: float) -> float:
        """Rate (1/s) in a window at one of its steps `h`."""
        if math.isinf(end):
            return math.inf
        try:
            return max(a.growth_above(self.rate) for a in self._at(h))
        except FAILURES:
            return math.inf

    def _ends(self, steps: FloatArray) -> FloatArray:
        """See `Probe`; NaN if the scheme fails."""
        found = np.full((len(steps), 2 * len(self.amplifiers)), np.nan)
        together = max(1, TOGETHER // self._width**2)
        with suppress(*FAILURES):
            numbers = max(a.C.size + a.G.size for a in (b.at(steps[0]) for b in self.amplifiers))
            together = min(together, max(1, AT_ONCE // max(numbers, 1)))
        for i in range(0, len(steps), together):
            some = slice(i, i + together)
            with suppress(*FAILURES):
                found[some] = np.hstack([a.at(steps[some]).real_ends() for a in self.amplifiers])
        return found


def _observed(scheme: Scheme) -> Scheme:
    """The scheme with a tolerance so fine that a step is a linear map.

    Else a step whose forces were foreseen well enough is taken as it is, and another is not.
    """
    if isinstance(scheme, InterfaceJacobian):
        return replace(scheme, tolerance=FINE)
    return scheme
