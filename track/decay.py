"""How waves decay along a track, and by how much a ring of its cells must err therefore.

A ring is an endless track on which every force acts again and again, a length of the ring apart.
What those others add at the force is the ring's error; the decay of the waves gives it for any
number of cells, from one solution of one cell.
"""

from __future__ import annotations

import warnings
from bisect import bisect_left
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np

from railcosim.mechanics.arrays import ComplexArray, FloatArray
from railcosim.parameters import ParameterError

from .cell import EVEN, ODD, Cell, build_cell
from .condensation import condense
from .parameters import MOST_CELLS, Track
from .waves import waves

PROMISED, PROMISED_TO = 0.01, 900.0  # error of the receptance, and Hz up to which it is asked for
NEAREST = 1.5  # m between wheelsets that the reduced track is made for; bogies have 1.8 m or more
LOWEST, MIDDLE = 1.0, 200.0  # Hz: in equal ratios between, then
SPACING = 4.0  # Hz apart; slabs of the default track resound in bands of 3 Hz
PEAKS, ROUNDS = 6, 3  # largest peaks that are looked at closer, and how often, thrice as close


class RingWarning(UserWarning):
    """A ring is too short for what is promised of it."""


@dataclass(frozen=True, kw_only=True)
class Decay:
    """Waves at the end of a cell, midway between two railseats, a rail's most flexible place.

    Loads equal on both rails (first) and opposite (second), as the cells have it.

    Attributes
    ----------
    frequency : array, shape (n,)
        Hz.
    factor : array, shape (2, n, d)
        |lambda|, from cell to cell, of the d waves, two of a rail alone.
    share : array, shape (2, n, d)
        Their parts of the deflection at a unit force, by magnitude, m/N.
    receptance : array, shape (2, n)
        Deflection at the force, m/N.
    cell_length : float
        m.
    """

    frequency: FloatArray
    factor: FloatArray
    share: FloatArray
    receptance: ComplexArray
    cell_length: float

    def ring_error(self, cells: int, span: float = 0.0) -> FloatArray:
        """What a ring adds, relative to the receptance of the endless track at the force.

        No more than this, and as much where waves add up: phases are left out. For a force on each
        rail or on one, whichever is worse.

        Parameters
        ----------
        cells : int
            In the ring.
        span : float
            From the force to where the deflection is seen, m: through the ring it is nearer.

        Returns
        -------
        array, shape (n,)
        """
        m, apart = self.factor, span / self.cell_length
        with np.errstate(divide="ignore"):  # a wave that never decays: infinite
            images = (m ** (cells - apart) + m ** (cells + apart)) / (1 - m**cells)
        added = (self.share * images).sum(axis=2)
        both = added[0] / np.abs(self.receptance[0])
        one = added.sum(axis=0) / np.abs(self.receptance.sum(axis=0))
        worst: FloatArray = np.maximum(both, one)
        return worst

    def worst(self, cells: int, span: float = 0.0) -> tuple[float, float]:
        """Largest error up to `PROMISED_TO`, and its frequency in Hz."""
        error = self.ring_error(cells, span)
        at = int(np.argmax(np.where(self.frequency <= PROMISED_TO, error, 0.0)))
        return float(error[at]), float(self.frequency[at])

    def echo(self, farthest: float) -> float:
        """How far from a place that sends all waves back it is felt by no more than `PROMISED`, m.

        Up to `PROMISED_TO`, to 0.1 m; infinite if farther than asked for. An echo comes twice as
        far; of waves that go on there no more comes back another way round.
        """
        told = self.frequency <= PROMISED_TO

        def error(distance: float) -> float:
            added = (self.share * self.factor ** (2 * distance / self.cell_length)).sum(axis=2)
            both = added[0] / np.abs(self.receptance[0])
            one = added.sum(axis=0) / np.abs(self.receptance.sum(axis=0))
            return float(np.maximum(both, one)[told].max())

        tenths = range(int(10 * farthest) + 1)
        found = bisect_left(tenths, x=True, key=lambda k: error(k / 10) <= PROMISED)
        return found / 10 if found < len(tenths) else np.inf

    def cells_needed(self, span: float = 0.0) -> int | None:
        """Fewest cells that keep `PROMISED`; None if the most a ring may have do not."""
        first = 2 * int(span / self.cell_length / 2) + 2
        for cells in range(max(first, 4), MOST_CELLS + 1, 2):
            if self.worst(cells, span)[0] <= PROMISED:
                return cells
        return None

    def longest_span(self, cells: int) -> float:
        """Farthest apart (m) that wheelsets may be for `PROMISED`, to 0.1 m; 0 if no two may be."""
        tenths = int(10 * (cells * self.cell_length - NEAREST))
        kept = bisect_left(
            range(1, tenths + 1), x=True, key=lambda k: self.worst(cells, k / 10)[0] > PROMISED
        )
        return kept / 10


@lru_cache(maxsize=8)
def decay_along(track: Track) -> Decay:
    """Find the decay along a track, as it is in the time domain: loss factors made viscous.

    Costs some 0.3 s the first time.
    """
    cells = [build_cell(track, parity).made_viscous() for parity in (EVEN, ODD)]
    low = np.geomspace(LOWEST, MIDDLE, 80)
    found = _at(cells, np.append(low, np.arange(MIDDLE + SPACING, PROMISED_TO + 1, SPACING)))
    for _ in range(ROUNDS):
        f, error = found.frequency, found.ring_error(track.mesh.cells)
        peaks = 1 + np.flatnonzero((error[1:-1] >= error[:-2]) & (error[1:-1] >= error[2:]))
        peaks = peaks[np.argsort(-error[peaks])][:PEAKS]
        if not peaks.size:
            break
        beside = np.stack([f[peaks - 1], f[peaks + 1]])
        closer = [f[peaks] + part * (beside - f[peaks]) for part in (1 / 3, 2 / 3)]
        found = _merged(found, _at(cells, np.unique(closer)))
    return found


def _at(cells: list[Cell], frequency: FloatArray) -> Decay:
    factor, share, receptance = [], [], []
    for cell in cells:
        nothing = np.empty((cell.K.shape[0], 0))
        found = waves(condense(cell, 2 * np.pi * frequency, nothing, nothing))
        decay, vectors = np.linalg.eig(found.forward)
        parts = vectors[:, 0] * np.linalg.solve(vectors, found.at_load[:, :, :1])[:, :, 0]
        factor.append(np.abs(decay))
        share.append(np.abs(parts))
        receptance.append(found.at_load[:, 0, 0])
    return Decay(
        frequency=frequency,
        factor=np.stack(factor),
        share=np.stack(share),
        receptance=np.stack(receptance),
        cell_length=cells[0].track.cell_length,
    )


def _merged(one: Decay, other: Decay) -> Decay:
    """Both, by frequency."""
    frequency = np.concatenate([one.frequency, other.frequency])
    order = np.argsort(frequency)
    return Decay(
        frequency=frequency[order],
        factor=np.concatenate([one.factor, other.factor], axis=1)[:, order],
        share=np.concatenate([one.share, other.share], axis=1)[:, order],
        receptance=np.concatenate([one.receptance, other.receptance], axis=1)[:, order],
        cell_length=one.cell_length,
    )


def long_enough(track: Track, span: float) -> Track:
    """With as many cells as wheelsets so far apart (m) need, and no fewer than it has.

    A ring that no number of cells makes long enough stays as it is: `check_ring` says so.
    """
    needed = decay_along(track).cells_needed(span)
    if needed is None or needed <= track.mesh.cells:
        return track
    return replace(track, mesh=replace(track.mesh, cells=needed))


def check_ring(track: Track, span: float) -> None:
    """Check that a ring is long enough for its track and for the vehicle on it.

    Parameters
    ----------
    track : Track
        Parameters.
    span : float
        From the first wheelset to the last, m.

    Raises
    ------
    ParameterError
        If the first wheelset meets the last one through the ring.

    Warns
    -----
    RingWarning
        If the expected error is above `PROMISED` somewhere below `PROMISED_TO`.
    """
    ring = f"a ring of {track.length:g} m ([mesh] cells = {track.mesh.cells})"
    decay = decay_along(track)
    needed = decay.cells_needed(span)
    cure = (
        f"[mesh] cells = {needed} ({needed * track.cell_length:g} m) keeps that"
        if needed
        else f"no ring of up to {MOST_CELLS} cells keeps that: hardly anything damps the waves, "
        "see damping and loss_factor of [fastening], [foundation], [rail]"
    )
    if track.length - span < NEAREST:
        raise ParameterError(
            f"the vehicle is {span:g} m long from its first wheelset to its last: on {ring} these "
            f"are less than {NEAREST:g} m apart the other way round. The rail's receptance is to "
            f"be right within {PROMISED:.0%} to {PROMISED_TO:g} Hz; {cure}"
        )
    error, at = decay.worst(track.mesh.cells, span)
    if error > PROMISED:
        size = f"{100 * error:.3g} %" if np.isfinite(error) else "any amount"
        warnings.warn(
            f"{ring} is short for this track and wheelsets {span:g} m apart: expect the rail's "
            f"receptance to be wrong by {size} at {at:.4g} Hz ({PROMISED:.0%} is promised to "
            f"{PROMISED_TO:g} Hz); {cure}",
            RingWarning,
            stacklevel=2,
        )
