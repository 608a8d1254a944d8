"""What the field calls a mode, read from its shape."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from railcosim.mechanics.arrays import ComplexArray, FloatArray

from .bodies import BOGIE, CARBODY, WHEELSET

WORDS = {CARBODY: "car body", BOGIE: "bogie", WHEELSET: "wheelset"}
MOTIONS = {
    "z": "bounce", "pitch": "pitch", "yaw": "yaw", "y": "lateral", "roll": "roll", "spin": "spin",
}  # fmt: skip
STILL = 0.1  # of the greatest amplitude: less is told as no motion
ROLLING = 0.2  # of the squares of lateral and yaw: less slip than that is rolling
FOLLOWED = 0.1  # of the greatest amplitude: a body that moves by itself drags wheelsets by less
LED = 1.5  # frames that yaw by more times what wheelsets do are not led by them


def names_of_modes(
    coordinates: Sequence[str],
    inertia: FloatArray,
    shapes: Sequence[ComplexArray],
    omega: Sequence[float],
    speed: float | None = None,
) -> list[str]:
    """Names of modes, each another.

    Parameters
    ----------
    coordinates : sequence of str
        ``carbody.z``.
    inertia : array, shape (n,)
        Of each.
    shapes : sequence of array, shape (n,)
        Of the modes.
    omega : sequence of float
        Frequencies at which they swing, rad/s.
    speed : float, optional
        Of wheels that creep, m/s: then there is hunting.
    """
    shape_of = _Shapes(coordinates, inertia)
    names = [
        shape_of.hunting(shape, w, speed) or shape_of.name(shape)
        for shape, w in zip(shapes, omega, strict=True)
    ]
    often, seen = Counter(names), Counter[str]()
    for i, name in enumerate(names):
        if often[name] > 1:
            seen[name] += 1
            names[i] = f"{name} ({seen[name]})"
    return names


class _Shapes:
    """Coordinates by kind of body and by direction."""

    def __init__(self, coordinates: Sequence[str], inertia: FloatArray) -> None:
        bodies, self.directions = zip(*(c.rsplit(".", 1) for c in coordinates), strict=True)
        self.kinds = np.array([body.partition("[")[0] for body in bodies])
        self.bodies = np.array(bodies)
        self.inertia = inertia

    def at(self, kind: str, direction: str) -> NDArray[np.intp]:
        """Coordinates of all bodies of a kind, from the front."""
        return np.flatnonzero((self.kinds == kind) & (np.array(self.directions) == direction))

    def name(self, shape: ComplexArray) -> str:
        """The kind of body that has most of the energy, how it moves, and how its like do."""
        energy = np.abs(shape) ** 2 * self.inertia
        kind = max(WORDS, key=lambda k: energy[self.kinds == k].sum())
        way = max(MOTIONS, key=lambda d: energy[self.at(kind, d)].sum())
        return f"{self._what(kind, way, shape)}{self._how(kind, way, shape)}"

    def hunting(self, shape: ComplexArray, omega: float, speed: float | None) -> str:
        """Its name if wheelsets roll along a wave, almost without sliding across; else nothing.

        A wheelset that rolls goes where it points: dy/dt = speed x yaw. It leads the bodies above.
        """
        y, yaw = shape[self.at(WHEELSET, "y")], shape[self.at(WHEELSET, "yaw")]
        if speed is None or omega == 0.0 or not y.size:
            return ""
        slip = 1j * omega * y / speed - yaw
        size = np.sum(np.abs(omega * y / speed) ** 2 + np.abs(yaw) ** 2)
        amplitude = np.abs(shape)
        widest = max(amplitude[self.at(k, d)].max(initial=0.0) for k in WORDS for d in ("y", "z"))
        frames = amplitude[self.at(BOGIE, "yaw")].max(initial=0.0)
        if (
            np.sum(np.abs(slip) ** 2) > ROLLING * size
            or np.abs(y).max() < FOLLOWED * widest
            or frames > LED * np.abs(yaw).max()
        ):
            return ""
        energy = np.abs(shape) ** 2 * self.inertia
        shares = {kind: energy[self.kinds == kind].sum() for kind in WORDS}
        kind = CARBODY if shares[CARBODY] > 0.5 * energy.sum() else BOGIE
        if not self.at(kind, "y").size:
            kind = WHEELSET
        return f"{WORDS[kind]} hunting{self._how(kind, 'y', shape)}"

    def _what(self, kind: str, way: str, shape: ComplexArray) -> str:
        if kind != CARBODY or way not in ("y", "roll"):
            return f"{WORDS[kind]} {MOTIONS[way]}"
        # A car body sways about an axis below its middle if it goes where its roof leans: a point
        # z below moves by y - z roll.
        together = (shape[self.at(kind, "y")] * shape[self.at(kind, "roll")].conj()).real.sum()
        return f"{WORDS[kind]} {'lower' if together > 0 else 'upper'} sway"

    def _how(self, kind: str, way: str, shape: ComplexArray) -> str:
        """How bodies of a kind move to each other: signs from the front where words do not do."""
        at = self.at(kind, way)
        motion = shape[at]
        if at.size == 1:
            return ""
        size = np.abs(motion)
        largest = int(np.argmax(size))
        part = (motion * np.conj(motion[largest])).real / size[largest] ** 2
        signs = np.where(np.abs(part) < STILL, 0, np.sign(part)).astype(int)
        if np.count_nonzero(signs) == 1:
            return f" of {self.bodies[at[largest]]}"
        if np.all(signs == signs[0]):
            return " in phase"
        if at.size == 2:
            return " in opposition"
        first = signs[np.flatnonzero(signs)[0]]
        return " " + "".join("0+-"[sign * first] for sign in signs)
