"""A pair at rest that is disturbed again and again: runs, and forces in them."""

from __future__ import annotations

import sys
from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from railcosim.analysis.pair.pair import Pair
from railcosim.master.component import ComponentError, FloatArray
from railcosim.master.cosimulation import Divergence, cosimulate
from railcosim.master.schemes import Scheme
from railcosim.mechanics.ports import FORCE, SIDES, Direction, Layout, X, Y, Z
from railcosim.track.travel import Travel

SIZE = 1.0
"""Of the forces a motion is driven to, N. What the curvature of a law makes of a motion can have
its frequency and grow three times as fast: at 3000 N that was 3 to 9 per cent of it under Hertz's
law, and more under creep. It falls with the square of the forces."""
MOST = 30.0
"""Times that, where a run ends."""
FIRST, STILL = 20, 1e-4
"""Steps in which forces change by no more than this part of `SIZE` where all is at rest."""
SETTLING = 0.1
"""Time, s, in which axles find their speed, a hundred times that in which they nearly do."""


def pushed(layout: Layout, told: Sequence[str]) -> list[int]:
    """Places of the contact forces, N, among the last parts of names.

    Of rolling wheels also along the track: creep may grow while wheels are hardly pressed.
    """
    names = replace(layout, directions=(Z, Y, X)).names(FORCE)
    return [told.index(name) for name in names if name in told]


def level(t: float) -> FloatArray:
    """No heights at all."""
    return np.zeros(1)


class Disturbance:
    """An irregularity that is whatever a `Disturbed` pair needs; a profile for `Journey`.

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
        """Heights under the wheels at a time, or at several, a row each."""
        zero = np.zeros(len(SIDES) * len(place) * len(directions))

        def heights(t: FloatArray | float) -> FloatArray:
            each = [zero + self.heights(one) for one in np.atleast_1d(t).tolist()]
            return np.reshape(each, (*np.shape(t), zero.size))

        return heights


class Disturbed:
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

    settled = False
    """Whether its axles had to find their speed first."""

    def __init__(
        self, pair: Pair, disturbance: Disturbance, settling: Scheme | None = None
    ) -> None:
        self.system, self.disturbance, self._start = pair.system, disturbance, 0.0
        pair.system.keep_past()
        self.settled = settling is not None
        if settling is not None:
            for point in cosimulate(pair.system, settling, SETTLING / 1000, SETTLING):
                self._start = point.time
        self.rest = pair.system.save_state()
        told = [name.partition(".")[2] for name in pair.system.names]
        self._alone: tuple[object, int, FloatArray | None] = None, 0, None
        self.forces = pushed(pair.layout, told)
        self.heights = len(pair.layout.surface.ports)

    def run(
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
        self.system.restore_state(self.rest)
        start = self._start
        self.disturbance.heights = lambda t: heights(t - start)
        forces = np.empty((steps + 1, len(self.forces)))
        n, stop = 0, start + steps * h
        try:
            run = cosimulate(self.system, scheme, h, stop, start, limit=1e12)
            for n, point in enumerate(run):
                forces[n] = point.outputs[self.forces]
                if n > begin and np.abs(forces[n] - forces[0]).max() > MOST * SIZE:
                    break
        except (ComponentError, ArithmeticError, Divergence):
            return None
        return forces[: n + 1]
