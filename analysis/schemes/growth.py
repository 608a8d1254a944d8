"""The largest stable step of a pair of FMUs by running them: kicked, and watched."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from railcosim.analysis.pair.pair import Pair
from railcosim.master.component import ComponentError, FloatArray
from railcosim.master.cosimulation import Divergence, cosimulate
from railcosim.master.schemes import Scheme
from railcosim.mechanics.ports import FORCE, SIDES

from .stability import FAST, LONGEST

PATTERN = np.array([1.0, 0.7, -0.5, 0.3, 0.4, -0.6, 0.2, 0.9])
"""Heights under the wheels, in parts of the kick, again and again where there are more: both wheels
alike and against each other."""
KICKED = 3
"""Steps that the kick lasts."""
SHORT, LONG = 1500, 12_000
"""Steps of a run: if the growth is not clear after few, there are more."""
CLEAR = 3.0
"""Growth, as a logarithm, in the second half of a run that is clear beside the decay of others."""
WINDOWS = 20
"""Parts of a run, of which amplitudes are taken."""
ABOVE = (0.012, 0.03)
"""How far above the limit, of itself, growth is measured: little is left to extrapolate."""
INSIDE = 0.4
"""Of a window, at the most: growth rises to its middle."""
BELOW = 0.97
"""Steps in limits at which nothing must grow."""


class Kick:
    """An irregularity that is flat but for the beginning; a profile for `Journey`.

    Attributes
    ----------
    height : float
        m.
    duration : float
        s.
    """

    name = "kick"

    def __init__(self, height: float) -> None:
        self.height, self.duration = height, 0.0

    def under(self, place: FloatArray, speed: float) -> Callable[[float], FloatArray]:
        """Heights under the wheels at a time."""
        pattern = np.resize(PATTERN, len(SIDES) * len(place))
        return lambda t: pattern * (self.height if 0.0 < t <= self.duration else 0.0)


class Bench:
    """A pair at rest, to be kicked again and again.

    Parameters
    ----------
    pair : Pair
        Opened on a journey over `kick`.
    kick : Kick
        The irregularity.
    most : float
        Deviation of a contact force, in those of the kick, at which a run ends: with Hertz's law
        it must stay small.
    exact : float, optional
        What grows (1/s) if both are coupled exactly; see `SprungPair`. Growth counts if it is
        faster by `FAST`: slower is not told from none in runs of so many steps.
    """

    def __init__(self, pair: Pair, kick: Kick, most: float, exact: float = 0.0) -> None:
        self._rate = exact + FAST
        self._system, self._kick, self._most = pair.system, kick, most
        self._rest = pair.system.save_state()
        told = [name.partition(".") for name in pair.system.names]
        forces = set(pair.layout.names(FORCE))
        owner = next(who for who, _, name in told if name in forces)
        self._forces = [
            i for i, (who, _, name) in enumerate(told) if who == owner and name in forces
        ]

    def growth(self, scheme: Scheme, h: float, most: int = LONG) -> float:
        """Rate (1/s) at which forces grow in the end; infinite if the scheme fails.

        Parameters
        ----------
        scheme : Scheme
            The scheme.
        h : float
            Communication step, s.
        most : int, optional
            Steps after which a growth that is still not clear is taken as it is.
        """
        steps = SHORT
        while True:
            amplitude, n = self._run(scheme, h, steps)
            if amplitude is None:
                return math.inf
            late = np.log(amplitude[WINDOWS // 2 :])
            slope = np.polyfit(np.arange(late.size), late, 1)[0] * WINDOWS
            if abs(slope) / 2 > CLEAR or n < steps or steps >= most:
                return float(slope / (n * h))
            steps *= 2

    def limit(self, scheme: Scheme, guess: float, end: float = math.inf) -> float:
        """Find the largest stable step (s) near a guess.

        Growth is measured at two steps beyond the guess and extrapolated to none. Where that leads
        far, or the scheme fails rather than grows, intervals are halved instead.

        Parameters
        ----------
        scheme : Scheme
            The scheme.
        guess : float
            s.
        end : float, optional
            End of the window that begins there, s.

        Returns
        -------
        float
            NaN if something grows at the guess less ten percent, or nothing at ten percent more.
        """
        if math.isinf(guess):
            rates = [self.growth(scheme, h, SHORT) for h in (LONGEST / 10, LONGEST / 3, LONGEST)]
            return math.inf if not self._grows(max(rates)) else math.nan
        reach = min(1.0, INSIDE * (end / guess - 1.0) / ABOVE[-1])
        near, far = (guess * (1.0 + reach * above) for above in ABOVE)
        slow, fast = self.growth(scheme, near), self.growth(scheme, far)
        if self._grows(slow) and slow < fast < math.inf:
            found = near - (slow - self._rate) * (far - near) / (fast - slow)
            # Not farther than what was measured: another motion may take over on the way.
            below = BELOW * found
            if near - found <= far - near and not self._grows(
                self.growth(scheme, below, 2 * SHORT)
            ):
                return found
        return self._halved(scheme, guess)

    def _halved(self, scheme: Scheme, guess: float) -> float:
        """The limit within ten percent of a guess, to half a percent."""
        low, high = 0.9 * guess, 1.1 * guess
        if self._grows(self.growth(scheme, low)) or not self._grows(self.growth(scheme, high)):
            return math.nan
        while high > 1.005 * low:
            middle = math.sqrt(low * high)
            if self._grows(self.growth(scheme, middle)):
                high = middle
            else:
                low = middle
        return math.sqrt(low * high)

    def _grows(self, rate: float) -> bool:
        return rate > self._rate

    def _run(self, scheme: Scheme, h: float, steps: int) -> tuple[FloatArray | None, int]:
        """Amplitude of the forces in each part of a run, and how many steps it took."""
        self._system.restore_state(self._rest)
        self._kick.duration = (KICKED + 0.5) * h
        forces = np.empty((steps + 1, len(self._forces)))
        top, n = math.inf, 0
        try:
            for n, point in enumerate(cosimulate(self._system, scheme, h, steps * h, limit=1e12)):
                forces[n] = point.outputs[self._forces]
                size = float(np.abs(forces[n] - forces[0]).max())
                if n == 4 * KICKED:
                    top = self._most * float(np.abs(forces[: n + 1] - forces[0]).max())
                if size > top:
                    break
        except (ComponentError, ArithmeticError, Divergence):
            return None, n
        deviation = np.abs(forces[4 * KICKED : n + 1] - forces[0])
        parts = np.array_split(deviation, WINDOWS)
        return np.array([np.sqrt((part**2).mean()) + 1e-300 for part in parts]), n
