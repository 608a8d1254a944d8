"""What grows in a pair of FMUs, by running them: driven, left alone, and watched."""

from __future__ import annotations

import math
import sys
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cache
from typing import Any

import numpy as np

from railcosim.analysis.pair.pair import Pair
from railcosim.master.component import ComponentError, FloatArray
from railcosim.master.cosimulation import Divergence, cosimulate
from railcosim.master.linear.state_space import ComplexArray
from railcosim.master.schemes import Scheme
from railcosim.master.schemes.iteration import Iterated
from railcosim.mechanics.ports import FORCE, SIDES, Direction, X
from railcosim.track.travel import Travel

from .exponentials import fastest
from .iteration_limit import BEFORE, contraction, longest_that_converges
from .motion import Motion, fastest_motion
from .stability import LONGEST, Coupling, Window

SIZE = 100.0
"""Of the forces a motion is driven to, N: Hertz's law is linear for some thousandths of a load."""
MOST = 30.0
"""Times that, where a run ends."""
DRIVEN, ALONE = 0.2, 3
"""Time a motion is driven, s, and left alone, in that, ..."""
FEWEST, MANY = 100, 500
"""... but so many steps of driving at least and at the most, to begin with."""
SURE = 0.1
"""Difference between two runs, 1/s or relative, of which one is twice as long, that is enough."""
LONG = 0.5
"""Time of driving, s, after which there is no longer run ..."""
SEEN = 12.0
"""... but of a motion that should grow: as a logarithm what it grows until it must be seen."""
PIECES = 32
"""Parts of a run, of which amplitudes are taken."""
APART = 0.004, 0.01, 0.025, 0.06, 0.1
"""Distances to a limit, of itself, at which growth is measured, until it is on both sides."""
INSIDE = 0.4
"""Of a window, at the most: growth rises to its middle."""
LOOKS = 17
"""Steps across a narrow window, to find where it grows most."""
BELOW = 0.97
"""Step in limits at which nothing may grow that was not foreseen."""
KICK = 1e-8
"""Height of a kick, m: 10 N."""
PATTERN = np.array([1.0, 0.7, -0.5, 0.3, 0.4, -0.6, 0.2, 0.9])
"""Heights under the wheels, in kicks: alike and against each other."""
KICKED, AFTER = 3, 1500
"""Steps that a kick lasts, and that are looked at at the most."""
CERTAIN = 1.0
"""Growth, as a logarithm, in the second half of a run after a kick, that is no beat of others."""
SOFTER = 10
"""Times that driving is made softer before growth counts as without bound."""
FIRST, STILL = 20, 1e-6
"""Steps in which forces change by no more than this part of `SIZE` where all is at rest."""
HARDLY = 1e3
"""Receptance of a motion, N/m, that heights do not drive: 100 N would take a tenth of a metre. Such
are axles that swing against creep; they do once they are let go."""
LET_GO, PARTS = 150, 3
"""Steps in which they are watched, and parts of these: the first is of all that dies away."""
SETTLING = 0.1
"""Time, s, in which axles find their speed, a hundred times that in which they nearly do."""
FAR = LONGEST * np.array([0.1, 0.3, 1.0])
"""Steps at which nothing may grow where nothing is said to, s."""


def level(t: float) -> FloatArray:
    """No heights at all."""
    return np.zeros(1)


class Disturbance:
    """An irregularity that is whatever a `Bench` wants; a profile for `Journey`.

    Attributes
    ----------
    heights : callable
        Heights (m) under all wheels at a time.
    """

    name = "disturbance"

    def __init__(self) -> None:
        self.heights: Callable[[float], FloatArray] = level

    def under(
        self, place: FloatArray, speed: Travel, directions: Sequence[Direction]
    ) -> Callable[[float], FloatArray]:
        """Heights under the wheels at a time."""
        zero = np.zeros(len(SIDES) * len(place) * len(directions))
        return lambda t: zero + self.heights(t)


@dataclass(frozen=True, kw_only=True)
class Compared:
    """A largest stable step as it was found by runs.

    Attributes
    ----------
    step : float
        s; infinite if nothing grows, NaN if it is not within ten percent of the predicted one.
    at : float
        Step, s, just above the predicted limit, or where growth was looked for.
    predicted, measured : float
        Rates (1/s) there.
    """

    step: float
    at: float
    predicted: float
    measured: float


class Bench:
    """A pair at rest, to be disturbed again and again.

    Parameters
    ----------
    pair : Pair
        Opened on a journey over `disturbance`.
    disturbance : Disturbance
        The irregularity.
    settling : Scheme, optional
        What the pair runs by until it is steady, before anything is looked at: axles that roll
        begin with V / r0, and find their own speed first. Of a pair that is at rest: none.
    """

    _unsettled: Any = None

    def __init__(
        self, pair: Pair, disturbance: Disturbance, settling: Scheme | None = None
    ) -> None:
        self._system, self._disturbance, self._start = pair.system, disturbance, 0.0
        pair.system.keep_past()
        if settling is not None:
            self._unsettled = pair.system.save_state()
            for point in cosimulate(pair.system, settling, SETTLING / 1000, SETTLING):
                self._start = point.time
        self._rest = pair.system.save_state()
        told = [name.partition(".")[2] for name in pair.system.names]
        pulling = replace(pair.layout, directions=(X,)).names(FORCE)
        self._pulling = [told.index(name) for name in pulling if name in told]
        self._alone: tuple[object, int, FloatArray | None] = None, 0, None
        self._forces = [told.index(name) for name in pair.layout.surface.names(FORCE)]

    def growth(self, scheme: Scheme, h: float, motion: Motion) -> float:
        """Rate (1/s) at which a motion grows; infinite if the scheme fails.

        It is driven with its own frequency and pattern, softly, then left alone. What else is of
        nearly the same frequency is driven, too: the fastest is told that is not weak in the end.

        Parameters
        ----------
        scheme : Scheme
            The scheme.
        h : float
            Communication step, s.
        motion : Motion
            As predicted for that step; only its frequency and heights are used, and its growth
            for the strength of driving and for how long a run must be to see it.
        """
        if self._rolls(motion):
            return self._let_go(scheme, h, motion)
        driven, last = int(np.clip(DRIVEN / h, FEWEST, MANY)), math.nan
        grown = motion.rate.real * ALONE * LONG
        longest = LONG * max(1.0, SEEN / grown) if grown > 1.0 else LONG
        while True:
            forces = self._driven(scheme, h, motion, driven)
            if forces is None:
                return math.inf
            turned = forces * np.exp(-1j * motion.rate.imag * h * np.arange(len(forces)))[:, None]
            found = fastest(_pieces(turned)) / (len(forces) // PIECES * h)
            enough = max(SURE, SURE * abs(found))
            foreseen = found > motion.rate.real - enough  # else another motion may be the stronger
            if (abs(found - last) < enough and (foreseen or grown < 1.0)) or driven * h > longest:
                return found
            driven, last = 2 * driven, found

    def _rolls(self, motion: Motion) -> bool:
        """Whether a motion is one of axles that roll, which heights hardly drive."""
        return self._unsettled is not None and motion.receptance < HARDLY

    def _let_go(self, scheme: Scheme, h: float, motion: Motion) -> float:
        """Rate (1/s) of axles' swing against creep once they roll, by what pulls them along."""
        self._system.restore_state(self._unsettled)
        self._disturbance.heights = level
        run = cosimulate(self._system, scheme, h, LET_GO * h, limit=1e12)
        forces = np.array([point.outputs[self._pulling] for point in run])[:LET_GO]
        turned = forces * np.exp(-1j * motion.rate.imag * h * np.arange(LET_GO))[:, None]
        size = np.linalg.norm(turned.reshape(PARTS, LET_GO // PARTS, -1).mean(axis=1), axis=1)
        if size[-1] < STILL * SIZE:
            return -math.inf
        return float(np.log(size[-1] / size[-2]) / (LET_GO // PARTS * h))

    def _driven(self, scheme: Scheme, h: float, motion: Motion, driven: int) -> FloatArray | None:
        """Forces after a motion was driven for so many steps; None if the scheme fails."""
        omega, stop = motion.rate.imag, driven * h
        n = np.arange(driven)
        gain = (np.sin(np.pi * n / driven) ** 2 * np.exp(motion.rate.real * (stop - n * h))).sum()
        heights = motion.heights * (SIZE / (motion.receptance * 0.5 * gain))

        def drive(t: float) -> FloatArray:
            wave = heights * np.exp(1j * omega * t) * math.sin(math.pi * min(t / stop, 1.0)) ** 2
            return np.asarray(wave.real)

        for _ in range(SOFTER):
            forces = self._run(scheme, h, (1 + ALONE) * driven, drive, driven + 1)
            if forces is None or len(forces) >= 2 * PIECES:
                return forces
            heights = heights * (SIZE / np.abs(forces).max())  # others were driven more
        return None  # what is rounding grows as fast

    def kicked(self, scheme: Scheme, h: float) -> float:
        """Rate (1/s) at which forces grow in the end after a kick; infinite if the scheme fails."""
        n = len(self._forces)
        pattern = KICK * np.resize(PATTERN, n)

        def kick(t: float) -> FloatArray:
            return pattern if 0.0 < t <= (KICKED + 0.5) * h else 0.0 * pattern

        forces = self._run(scheme, h, _kicked_steps(h), kick, 4 * KICKED)
        if forces is None or len(forces) < 2 * PIECES:  # faster than can be fitted
            return math.inf
        late = [np.sqrt((part**2).mean()) + 1e-300 for part in np.array_split(forces, PIECES)]
        half = np.log(late[PIECES // 2 :])
        slope = np.polyfit(np.arange(half.size), half, 1)[0]
        return float(slope * PIECES / (len(forces) * h))

    def limit(self, scheme: Scheme, coupling: Coupling, window: Window | None) -> Compared:
        """Find the largest stable step where it was predicted.

        Growth is measured on both sides of it, of the motion that is predicted to grow fastest
        there; and after a kick, which excites all motions, somewhat below.

        Parameters
        ----------
        scheme : Scheme
            The scheme.
        coupling : Coupling
            Its prediction.
        window : Window or None
            The first of fast growth; None if there is none.
        """
        most = coupling.fast

        @cache
        def compared(h: float) -> Compared:
            motion = fastest_motion(coupling, h)
            if self._rolls(motion) and window is not None and h < window.fast:
                # What nothing holds is slower than all else: that which is to grow is watched.
                above = (1.0 + APART[0]) * window.fast
                motion = fastest_motion(coupling, above)
                motion = replace(motion, rate=complex(0.0, motion.rate.imag * above / h))
            measured = self.growth(scheme, h, motion)
            return Compared(step=h, at=h, predicted=motion.rate.real, measured=measured)

        def unforeseen(h: float) -> bool:
            rate = self.kicked(scheme, h)
            return rate > most and rate * _kicked_steps(h) * h > 2.0 * CERTAIN

        if window is None:
            tried = [compared(float(h)) for h in FAR]
            grows = any(one.measured > most or unforeseen(one.at) for one in tried)
            worst = max(tried, key=lambda one: one.predicted)
            return replace(worst, step=math.nan if grows else math.inf)
        guess = window.fast
        if isinstance(scheme, Iterated) and math.isinf(coupling.growth((1.0 + APART[0]) * guess)):
            return self._iterating(scheme, coupling, guess)
        widest = INSIDE * (window.end / guess - 1.0)
        if widest < APART[0]:  # perhaps no wider than its edges are exact: where it grows most
            steps = np.linspace(guess, window.end, LOOKS)[1:-1].tolist()
            widest = max(steps, key=coupling.growth) / guess - 1.0
        tried = list[Compared]()
        for apart in APART:
            low = compared(guess * (1.0 - apart))
            high = compared(guess * (1.0 + min(apart, widest)))
            tried.append(high)
            if low.measured <= most < high.measured:
                break
        else:
            return replace(tried[0], step=math.nan)
        while high.at > (1.0 + 2.5 * APART[0]) * low.at:
            middle = compared(math.sqrt(low.at * high.at))
            low, high = (low, middle) if middle.measured > most else (middle, high)
        found = math.sqrt(low.at * high.at)
        if math.isfinite(high.measured):
            part = (most - low.measured) / (high.measured - low.measured)
            found = low.at + part * (high.at - low.at)
        return replace(tried[0], step=math.nan if unforeseen(BELOW * found) else found)

    def _iterating(self, scheme: Iterated, coupling: Coupling, guess: float) -> Compared:
        """The limit where iterations begin to take too many evaluations."""
        kick = 10.0 * KICK * np.resize(PATTERN, len(self._forces))

        def measured(h: float) -> float:
            def ready() -> None:
                self._system.restore_state(self._rest)
                self._disturbance.heights = lambda t: kick * (t > (BEFORE + 0.5) * h)

            return contraction(self._system, self._forces, scheme, h, ready, coupling.contraction)

        above = (1.0 + APART[0]) * guess
        return Compared(
            step=longest_that_converges(coupling.contraction, guess, measured),
            at=above,
            predicted=math.log(coupling.contracts(above)),
            measured=math.log(measured(above)),
        )

    def _run(
        self, scheme: Scheme, h: float, steps: int,
        heights: Callable[[float], FloatArray], begin: int,
    ) -> FloatArray | None:  # fmt: skip
        """Deviations of the forces from a run left alone, from a step on; None if it fails."""
        usual = self._left_alone(scheme, h, steps)
        forces = None if usual is None else self._forces_of(scheme, h, steps, heights, begin)
        if usual is None or forces is None:
            return None
        n = len(forces) if len(usual) == 1 else min(len(forces), len(usual))
        deviation: FloatArray = forces[begin:n] - (usual if len(usual) == 1 else usual[begin:n])
        return deviation

    def _left_alone(self, scheme: Scheme, h: float, steps: int) -> FloatArray | None:
        """Forces of a run that nothing disturbs: one row if they stay as they are.

        Axles that roll find their own speed first.
        """
        key, length, known = self._alone
        if key == (scheme, h) and length >= steps:
            return known
        usual = self._forces_of(scheme, h, FIRST, level, FIRST)
        if usual is not None and np.abs(usual - usual[0]).max() > STILL * SIZE:
            usual = self._forces_of(scheme, h, steps, level, 0)
        elif usual is not None:
            usual, steps = usual[:1], sys.maxsize
        self._alone = (scheme, h), steps, usual
        return usual

    def _forces_of(
        self, scheme: Scheme, h: float, steps: int,
        heights: Callable[[float], FloatArray], begin: int,
    ) -> FloatArray | None:  # fmt: skip
        """Forces of a run until they are large; None if the scheme fails."""
        self._system.restore_state(self._rest)
        start = self._start
        self._disturbance.heights = lambda t: heights(t - start)
        forces = np.empty((steps + 1, len(self._forces)))
        n, stop = 0, start + steps * h
        try:
            run = cosimulate(self._system, scheme, h, stop, start, limit=1e12)
            for n, point in enumerate(run):
                forces[n] = point.outputs[self._forces]
                if n > begin and np.abs(forces[n] - forces[0]).max() > MOST * SIZE:
                    break
        except (ComponentError, ArithmeticError, Divergence):
            return None
        return forces[: n + 1]


def _kicked_steps(h: float) -> int:
    """Steps of a run after a kick."""
    return int(np.clip(2.0 / h, AFTER // 5, AFTER))


def _pieces(values: ComplexArray) -> ComplexArray:
    """Mean of each channel over overlapping parts of a run, faded in and out."""
    length = len(values) // PIECES
    window = np.hanning(2 * length + 1)[1:-1]
    window /= window.sum()
    begins = range(0, len(values) - len(window) + 1, length)
    return np.stack([window @ values[b : b + len(window)] for b in begins])
