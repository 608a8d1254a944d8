"""How fast motions grow in a pair of FMUs: driven, left alone, and watched."""

from __future__ import annotations

import math

import numpy as np

from railcosim.master.component import FloatArray
from railcosim.master.linear.state_space import ComplexArray
from railcosim.master.schemes import Scheme

from .disturbed import SIZE, Disturbed
from .exponentials import fastest
from .motion import Motion

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
KICK = 1e-10
"""Height of a kick, m: 0.1 N."""
PATTERN = np.array([1.0, 0.7, -0.5, 0.3, 0.4, -0.6, 0.2, 0.9])
"""Heights under the wheels, in kicks: alike and against each other."""
KICKED, AFTER = 3, 1500
"""Steps that a kick lasts, and that are looked at at the most."""
SOFTER = 10
"""Times that driving is made softer before growth counts as without bound."""
HARDLY = 1e3
"""Receptance of a motion, N/m, that heights do not drive: 1 N would take a millimetre. Such
are angles of axles, which nothing holds."""


class Bench(Disturbed):
    """A pair at rest, of which growth is measured; see `Disturbed`."""

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
        if self.hardly(motion):
            return self.kicked(scheme, h)
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

    def hardly(self, motion: Motion) -> bool:
        """Whether a motion is one of wheels that roll, and heights do not drive it."""
        return self.settled and motion.receptance < HARDLY

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
            forces = self.run(scheme, h, (1 + ALONE) * driven, drive, driven + 1)
            if forces is None or len(forces) >= 2 * PIECES:
                return forces
            heights = heights * (SIZE / np.abs(forces).max())  # others were driven more
        return None  # what is rounding grows as fast

    def kicked(self, scheme: Scheme, h: float) -> float:
        """Rate (1/s) at which forces grow in the end after a kick; infinite if the scheme fails."""
        pattern = KICK * np.resize(PATTERN, self.heights)

        def kick(t: float) -> FloatArray:
            return pattern if 0.0 < t <= (KICKED + 0.5) * h else 0.0 * pattern

        forces = self.run(scheme, h, kicked_steps(h), kick, 4 * KICKED)
        if forces is None or len(forces) < 2 * PIECES:  # faster than can be fitted
            return math.inf
        late = [np.sqrt((part**2).mean()) + 1e-300 for part in np.array_split(forces, PIECES)]
        half = np.log(late[PIECES // 2 :])
        slope = np.polyfit(np.arange(half.size), half, 1)[0]
        return float(slope * PIECES / (len(forces) * h))


def kicked_steps(h: float) -> int:
    """Steps of a run after a kick."""
    return int(np.clip(2.0 / h, AFTER // 5, AFTER))


def _pieces(values: ComplexArray) -> ComplexArray:
    """Mean of each channel over overlapping parts of a run, faded in and out."""
    length = len(values) // PIECES
    window = np.hanning(2 * length + 1)[1:-1]
    window /= window.sum()
    begins = range(0, len(values) - len(window) + 1, length)
    return np.stack([window @ values[b : b + len(window)] for b in begins])
