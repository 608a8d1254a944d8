"""What is seen of a body at fixed places: rows on its modes, whatever the quantity.

Needs numpy only: a copy of this file travels in every FMU of a track.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from .arrays import ComplexArray, FloatArray


@dataclass(frozen=True, kw_only=True)
class Observation:
    """Rows that show what modes do at fixed places, and outputs that are multiples of them.

    A row is y = Re(shown s) + sum of size Re(q). The first is what modes of the ring show;
    oscillators of the row's own, dq/dt = pole q + into f, add what they leave out near the place,
    so it depends on where the wheels are. An output is a sum of its row's y, dy/dt and d2y/dt2.

    Attributes
    ----------
    shown : array, shape (n_rows, n)
        By even and odd modes.
    poles : array, shape (n_own,)
        Of the rows' own oscillators, rad/s: as many of each row, one row's behind the other's.
    size : array, shape (n_own,)
        In which they count.
    into : array, shape (n_own, n_places, sides, directions)
        How forces on the rails drive them, at places along the ring; beyond these, not at all.
    begin : array, shape (n_own,)
        First of the places, m.
    spacing, length : float
        Between places, and of the ring, m.
    row : array of int, shape (n_outputs,)
        Of which row an output is.
    weights : array, shape (n_outputs, 3)
        Of y and its first and second derivative.
    """

    shown: ComplexArray
    poles: ComplexArray
    size: FloatArray
    into: ComplexArray
    begin: FloatArray
    spacing: float
    length: float
    row: NDArray[np.intp]
    weights: FloatArray

    def driven(self, position: FloatArray) -> ComplexArray:
        """How forces at the ports of wheelsets at positions (m) drive the oscillators.

        Returns
        -------
        array, shape (n_own, ports)
            Ports in the order of a `Layout`.
        """
        places = self.into.shape[1]
        along = ((position - self.begin[:, None]) % self.length) / self.spacing
        near = along < places - 1
        first = np.where(near, along, 0.0).astype(int)
        part = np.where(near, along - first, 0.0)[:, :, None, None]
        own = np.arange(len(self.into))[:, None]
        at = (1 - part) * self.into[own, first] + part * self.into[own, first + 1]
        at *= near[:, :, None, None]
        driven: ComplexArray = at.swapaxes(1, 2).reshape(
            len(self.into), -1
        )  # sides, then wheelsets
        return driven

    def outputs(
        self, s: ComplexArray, own: ComplexArray, rate: ComplexArray, own_rate: ComplexArray,
        poles: ComplexArray,
    ) -> FloatArray:  # fmt: skip
        """All outputs.

        Parameters
        ----------
        s, rate, poles : array, shape (n,)
            Even and odd modes, their rates and poles.
        own, own_rate : array, shape (n_own,)
            The rows' oscillators and their rates.
        """

        def added(of_own: ComplexArray) -> FloatArray:
            summed: FloatArray = (self.size * of_own.real).reshape(len(self.shown), -1).sum(axis=1)
            return summed

        # A force moves nothing at once at a place: what modes jump by, the oscillators take back.
        # So d2y/dt2 is that of each by the rate it has, whatever the force changes by.
        y = [
            (self.shown @ of_modes).real + added(of_own)
            for of_modes, of_own in (
                (s, own), (rate, own_rate), (poles * rate, self.poles * own_rate)
            )
        ]  # fmt: skip
        seen: FloatArray = np.einsum("ok,ko->o", self.weights, np.stack(y)[:, self.row])
        return seen

    def of_sides(self, sides: int) -> Observation:
        """Of tracks of which only the first so many rails are loaded."""
        return replace(self, into=np.ascontiguousarray(self.into[:, :, :sides]))
