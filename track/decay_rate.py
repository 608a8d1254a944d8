"""The decay rate of a rail by EN 15461, from receptances and from waves.

EN 15461:2008+A1:2010: an accelerometer sits on the rail midway between two railseats, a hammer hits
the rail there and at distances given in bays, A(x) is the response to a force; the decay rate is
4.343 / sum |A(x_n) / A(x_0)|^2 dx_n in dB/m, with the length dx_n of rail that a place stands for.
For one wave, |A| ~ exp(-beta x), the sum is 1 / (2 beta), the rate 8.686 beta = 20 log10(e) beta.
"""

from __future__ import annotations

import math

import numpy as np

from railcosim.mechanics.arrays import ComplexArray, FloatArray
from railcosim.mechanics.ports import Direction

from .cell import EVEN, ODD, build_cell, railseats
from .condensation import condense
from .dispersion import fine_enough
from .parameters import Track
from .receptance import Point, Progress, infinite_receptance, shortest
from .section import directions_for
from .waves import waves

GRID = np.array([
    *np.arange(0, 2.51, 0.25), 3, 3.5, 4, 5, 6, 7, 8, 10, 12, 16, 20, 24, 30, 36, 42, 48, 54, 66
])  # fmt: skip
"""Distances in bays (clause 6.7, Figure 2)."""
OF_SUM = 4.343
"""dB: 10 log10(e), as the standard prints it."""
NEPER = 20 * math.log10(math.e)
"""dB."""
BLOCK = 128  # frequencies at once


def distances(track: Track) -> FloatArray:
    """Of the grid, m, shape (29,)."""
    places: FloatArray = GRID * track.fastening.spacing
    return places


def lengths(x: FloatArray) -> FloatArray:
    """Length of rail that each place stands for (Annex A.2), m.

    To midway to the places beside it; the first from 0, the last as far ahead as behind.
    """
    middle = (x[1:] + x[:-1]) / 2
    edges = np.concatenate([[0.0], middle, [1.5 * x[-1] - 0.5 * x[-2]]])
    found: FloatArray = np.diff(edges)
    return found


def rate(response: FloatArray, x: FloatArray) -> FloatArray:
    """Decay rate in dB/m of squared responses (..., n) at distances x (n,), m."""
    shares = response / response[..., :1]
    found: FloatArray = OF_SUM / (shares @ lengths(x))
    return found


def responses(
    track: Track, omega: FloatArray, direction: Direction, progress: Progress | None = None
) -> ComplexArray:
    """Receptance at the accelerometer for forces on the grid, on that rail, (n_omega, 29).

    Of an endless track, with elements as fine as the highest frequency asks for.
    """
    track = fine_enough(track, float(omega.max()) / (2 * np.pi), direction)
    middle = float(railseats(track)[track.bays // 2] + track.fastening.spacing / 2)
    hit = [Point(x=middle + float(x), direction=direction) for x in distances(track)]
    # Reciprocity: force at the accelerometer, motions where the hammer hits.
    return infinite_receptance(track, omega, hit[:1], hit, progress)[:, :, 0]


def slowest(track: Track, omega: FloatArray, direction: Direction) -> FloatArray:
    """Decay rate of the wave that decays least, of all that move in a direction, dB/m, (n_omega,).

    In phase on both rails or opposite.
    """
    track = shortest(fine_enough(track, float(omega.max()) / (2 * np.pi), direction))
    directions = directions_for([direction], coupled=track.rails_tilt)
    cells = [build_cell(track, parity, directions=directions) for parity in (EVEN, ODD)]
    least = np.empty(omega.size)
    for start in range(0, omega.size, BLOCK):
        part = slice(start, start + BLOCK)
        slow = []
        for cell in cells:
            nothing = np.empty((len(cell.K), 0))
            found = waves(condense(cell, omega[part], nothing, nothing))
            slow.append(np.abs(found.decay[:, 0]))
        least[part] = -NEPER * np.log(np.max(slow, axis=0)) / track.cell_length
    return least
