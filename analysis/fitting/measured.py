"""Measured curves, and what a track of given parameters would have in their place."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import numpy as np

from railcosim.analysis.response.decay_rate import LINES, lines_of
from railcosim.analysis.response.track_words import direction_of, place_of
from railcosim.master.component import FloatArray
from railcosim.master.linear.realisation import ComplexArray
from railcosim.mechanics.ports import Direction, Y, Z
from railcosim.parameters import ParameterError
from railcosim.track.decay_rate import distances, rate, responses
from railcosim.track.parameters import Track
from railcosim.track.receptance import BOTH, Point, infinite_receptance

from .loading import Loading, loading_of
from .table import COHERENCE, DECAY, Table, frequency_of, read_table, response_of

MOST_FREQUENCIES = 20_000
CERTAIN = 0.9999  # coherence above which no line counts more: else a few would decide all
RATES = {Z: "vertical", Y: "lateral"}
NOMINAL = 0.06  # tenths of a decade by which nominal centres may be off: 31.5 for 31.62 Hz
BANDS = (10.0, 10_000.0)  # Hz

Curve = FloatArray | ComplexArray


@dataclass(frozen=True, kw_only=True)
class Measured:
    """One measured curve.

    Attributes
    ----------
    name, unit : str
        What it is, and of what unit.
    frequency : array, shape (n,)
        Hz, increasing; of decay rates the centres of third octaves.
    values : array, shape (n,)
        Complex if its phase is known.
    weight : array, shape (n,)
        Inversely as the standard deviations of ln |values|, and of the phase in rad.
    direction : Direction
        Of hammer and accelerometer.
    of : callable
        The same curve of a track.
    """

    name: str
    unit: str
    frequency: FloatArray
    values: Curve
    weight: FloatArray
    direction: Direction
    of: Callable[[Track, FloatArray], Curve]

    def residual(self, track: Track) -> FloatArray:
        """Logarithm of the track's curve over the measured one, weighted.

        Of magnitudes and, behind them, of phases where these are known.
        """
        ratio = self.of(track, self.frequency) / self.values
        parts = [np.log(np.abs(ratio))]
        if np.iscomplexobj(self.values):
            parts.append(np.angle(ratio))
        found: FloatArray = np.concatenate([self.weight * part for part in parts])
        return found

    def thinned(self, most: int) -> Measured:
        """With so many of its frequencies, evenly chosen."""
        if self.frequency.size <= most:
            return self
        at = np.unique(np.linspace(0, self.frequency.size - 1, most).astype(int))
        return Measured(
            name=self.name, unit=self.unit, frequency=self.frequency[at], values=self.values[at],
            weight=self.weight[at], direction=self.direction, of=self.of,
        )  # fmt: skip


def read_measured(
    source: Path,
    track: Track,
    *,
    position: str | float | None = None,
    direction: str | None = None,
    both_rails: bool | None = None,
    unit: str | None = None,
) -> Measured:
    """Read a measured receptance (mobility, accelerance), or decay rates in third octaves.

    Parameters
    ----------
    source : Path
        ``.csv``, or ``.nc`` of ours.
    track : Track
        For places.
    position : str or float, optional
        Where hammer and accelerometer are; not asked of decay rates, which say it themselves. If
        not given what a file of ours says, else ``railseat``.
    direction : str, optional
        ``z`` or ``y``, at the head; likewise, else ``z``.
    both_rails : bool, optional
        Whether the same force acts on both rails; likewise, else not. Of decay rates it does not.
    unit : str, optional
        Of a response whose column says none.

    Raises
    ------
    ParameterError
        With the file, what is wrong and what is allowed; also if a file of ours says that it was
        loaded otherwise.
    """
    along = direction_of("direction", direction or Z.name)
    table = read_table(source)
    decay = _decay_of(table, along)
    if decay is not None:
        return _in_order(table, decay, along, f"{RATES[along]} decay rate", DECAY, _rates(along))
    values = response_of(table, unit)
    given = Loading(position=position, direction=direction, both_rails=both_rails)
    hit = loading_of(table, track, given)
    along = direction_of("direction", str(hit.direction))
    of = partial(_driving_point, place_of(track, hit.position or 0.0), along, bool(hit.both_rails))
    what = "receptance, both rails" if hit.both_rails else "receptance"
    return _in_order(table, values, along, f"{what}, {hit.position}", "m/N", of)


def _decay_of(table: Table, direction: Direction) -> FloatArray | None:
    """Decay rates of a direction, if a table has any: the only ones, or those called so."""
    found = [name for name, unit in table.units.items() if unit == DECAY]
    if not found:
        return None
    name = found[0] if len(found) == 1 else RATES.get(direction, "")
    if name not in found:
        raise table.wrong(f"{', '.join(found)}: must be one column in dB/m, or one called {name}")
    return table.columns[name]


def _in_order(
    table: Table,
    values: Curve,
    direction: Direction,
    name: str,
    unit: str,
    of: Callable[[Track, FloatArray], Curve],
) -> Measured:
    """By frequency, without lines of no coherence; what cannot be is refused."""
    frequency = frequency_of(table)
    coherence = _coherence(table)
    order = np.argsort(frequency)
    order = order[coherence[order] > 0]
    frequency, values, coherence = frequency[order], values[order], coherence[order]
    if not 0 < frequency.size <= MOST_FREQUENCIES:
        raise table.wrong(f"{frequency.size} frequencies: must be from 1 to {MOST_FREQUENCIES}")
    if not (frequency[0] > 0 and (np.diff(frequency) > 0).all()):
        twice = frequency[:-1][np.diff(frequency) == 0]
        raise table.wrong(
            f"{twice[0]:g} Hz is there twice" if twice.size else "frequencies must be > 0 Hz"
        )
    if not (np.abs(values) > 0).all():
        raise table.wrong(f"{name}: all magnitudes must be > 0")
    if unit == DECAY:
        _check_bands(table, frequency)
    # Random errors of a response: sqrt((1 - coherence) / (2 n coherence)), Bendat & Piersol.
    weight = np.sqrt(coherence / (1 - np.minimum(coherence, CERTAIN)))
    return Measured(
        name=name, unit=unit, frequency=frequency, values=values,
        weight=weight / np.sqrt(np.mean(weight**2)), direction=direction, of=of,
    )  # fmt: skip


def _check_bands(table: Table, frequency: FloatArray) -> None:
    if not (BANDS[0] <= frequency[0] and frequency[-1] <= BANDS[1]):
        raise table.wrong(f"third octaves must be from {BANDS[0]:g} to {BANDS[1]:g} Hz")
    tenths = 10 * np.log10(frequency)
    off = np.abs(tenths - np.round(tenths)) > NOMINAL
    if off.any():
        raise table.wrong(f"{frequency[off][0]:g} Hz is no centre of a third octave")


def _coherence(table: Table) -> FloatArray:
    """1 where the table has none."""
    name = table.named(COHERENCE)
    if name is None:
        return np.ones(frequency_of(table).size)
    found = table.columns[name]
    if not ((found >= 0) & (found <= 1)).all():
        raise table.wrong(f"{name}: must be from 0 to 1")
    return found


def _driving_point(
    x: float, direction: Direction, both_rails: bool, track: Track, frequency: FloatArray
) -> ComplexArray:
    """Receptance where a rail is hit."""
    hit = Point(x=x, side=BOTH if both_rails else -1, direction=direction)
    here = Point(x=x, direction=direction)
    return infinite_receptance(track, 2 * np.pi * frequency, [hit], [here])[:, 0, 0]


def _rates(direction: Direction) -> Callable[[Track, FloatArray], FloatArray]:
    def of(track: Track, frequency: FloatArray) -> FloatArray:
        omega = 2 * np.pi * lines_of(frequency)
        mobility = omega[:, None] * responses(track, omega, direction)
        squared = (np.abs(mobility) ** 2).reshape(frequency.size, LINES, -1).mean(axis=1)
        return rate(squared, distances(track))

    return of


__all__ = ["Measured", "ParameterError", "read_measured"]
