"""Every wave of an endless track at a real frequency, and the bands in which none travels.

A wave goes from cell to cell by a factor lambda = exp(-i kappa L). That leaves kappa open by
2 pi / L: the one told is that of the space harmonic which carries most of the rail's kinetic
energy, so that curves are those of a rail, not folded into the first Brillouin zone.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import eigh
from scipy.optimize import linear_sum_assignment

from railcosim.mechanics.arrays import ComplexArray, FloatArray
from railcosim.mechanics.ports import Direction

from .below import with_lines
from .cell import Cell, build_cell, elements_per_bay
from .condensation import CondensedCell, condense
from .parameters import Track
from .receptance import Progress, shortest
from .section import directions_for, section_of
from .waves import TRAVELLING, waves
from .waves_of_cell import bloch

LEAST = 1e-12  # a wave that decays to less from cell to cell is rounding: 240 dB
AHEAD = 1.2  # harmonics of a standing wave are equal: so much is the one that runs ahead preferred
ELEMENTS = 12  # to the shortest wave: its length is right to 1 %, of torsion; of bending to 1e-4
FINEST = 64  # elements a bay
BLOCK = 64  # frequencies at once
PHASES = 9  # from 0 to pi, at which the bands of a track without damping are found
NARROW = 2e-3  # of its frequency: narrower stop bands are left out
TRAVELS = 0.2  # imaginary by real part of a wavenumber below which a wave outlasts its length
HALVINGS = 12  # of a tenth of a gap


@dataclass(frozen=True, kw_only=True)
class Branch:
    """One wave over frequency.

    Attributes
    ----------
    wavenumber : array, shape (n,)
        kappa in exp(i (omega t - kappa x)), rad/m, of a wave that runs to greater x: its imaginary
        part is <= 0. NaN where the wave decays too fast to be told.
    motion : str
        The unknown of the section that has most of its kinetic energy at the highest frequency at
        which it is known: w, v or phi.
    """

    wavenumber: ComplexArray
    motion: str


def fine_enough(track: Track, highest: float, direction: Direction) -> Track:
    """The track with a mesh as fine as its shortest free wave at a frequency (Hz) needs.

    Never coarser than it has. What is between supports costs next to nothing in an endless track.
    """
    directions = directions_for([direction], coupled=track.rails_tilt)
    section = with_lines(section_of(track.rail, directions), track.layers, track.fastening.spacing)
    k = max(member.wavenumber(2 * np.pi * highest) for member in section.members)
    given = track.mesh.elements_per_bay
    finer = elements_per_bay(track, directions) // given
    a_bay = min(ELEMENTS * k * track.fastening.spacing / (2 * np.pi), FINEST)
    needed = 4 * int(np.ceil(a_bay / finer / 4))  # quarters
    return replace(track, mesh=replace(track.mesh, elements_per_bay=max(given, needed)))


def dispersion(
    track: Track,
    omega: FloatArray,
    direction: Direction,
    parity: int,
    progress: Progress | None = None,
) -> list[Branch]:
    """Find the waves.

    Parameters
    ----------
    track : Track
        Parameters; loss factors as they are, hysteretic.
    omega : array, shape (n,)
        rad/s, increasing.
    direction : Direction
        Waves that move in it, with all that are coupled with them.
    parity : int
        Of the two rails, EVEN or ODD.
    progress : callable, optional
        Called with (done, total).

    Returns
    -------
    list of Branch
        Followed over frequency; that which decays least at the highest frequency first.

    References
    ----------
    Mead, D. J. (1996), Wave propagation in continuous periodic structures: research contributions
    from Southampton, 1964-1995, J. Sound Vib. 190(3), 495-524.
    """
    track = shortest(track)
    cell = build_cell(
        track, parity, directions=directions_for([direction], coupled=track.rails_tilt)
    )
    samples = _samples(cell, float(omega.max()))
    rows = _rows(cell, samples)
    kappa, energy = [], []
    for start in range(0, omega.size, BLOCK):
        condensed = condense(
            cell, omega[start : start + BLOCK], np.empty((cell.K.shape[0], 0)), rows
        )
        one, two = _waves(cell, samples, condensed)
        kappa.append(one)
        energy.append(two)
        if progress:
            progress(min(start + BLOCK, omega.size), omega.size)
    return _branches(cell, np.concatenate(kappa), np.concatenate(energy))


def _samples(cell: Cell, omega: float) -> NDArray[np.intp]:
    """Nodes of a cell, its last left out, as near to each other as its shortest wave asks for."""
    n, bays = cell.nodes.size - 1, cell.track.bays
    highest = max(member.wavenumber(omega) for member in cell.section.members)
    per_bay = next(
        m for m in range(1, n // bays + 1)
        if (n // bays) % m == 0
        and (m == n // bays or np.pi * m * bays / cell.track.cell_length > AHEAD * highest)
    )  # fmt: skip
    return np.arange(0, n, n // bays // per_bay)


def _rows(cell: Cell, nodes: NDArray[np.intp]) -> FloatArray:
    """Participation of each member's deflection at nodes, times the root of its inertia, (n, m)."""
    section, rows = cell.section, np.zeros((cell.K.shape[0], nodes.size, len(cell.section.members)))
    for i, member in enumerate(section.members):
        at = section.size * nodes + section.element_unknowns(i)[0]
        rows[at, np.arange(nodes.size), i] = np.sqrt(member.mass)
    return rows.reshape(cell.K.shape[0], -1)


def _waves(
    cell: Cell, nodes: NDArray[np.intp], condensed: CondensedCell
) -> tuple[ComplexArray, FloatArray]:
    """Wavenumbers (n_omega, d) and energies of the members in each wave, (n_omega, d, members)."""
    L, members = cell.track.cell_length, len(cell.section.members)
    factor, shape = np.linalg.eig(waves(condensed).forward)
    known = np.abs(factor) > LEAST
    factor = np.where(known, factor, LEAST)
    ends = np.concatenate([shape, shape * factor[:, None, :]], axis=1)
    x, first = cell.nodes[nodes], 1j * np.log(factor) / L
    seen = (condensed.motions @ ends).reshape(len(factor), nodes.size, members, -1)
    periodic = seen * np.exp(1j * first[:, None, None, :] * x[:, None, None])
    energy = np.abs(np.fft.fft(periodic, axis=1)) ** 2
    # exp(-i kappa x) times exp(2 pi i m x / L): of wavenumber kappa - 2 pi m / L.
    turns = 2 * np.pi / L * np.fft.fftfreq(nodes.size, 1 / nodes.size)
    k = first[:, None, :] - turns[:, None]
    carried = energy.sum(axis=2) * np.where(k.real >= 0, AHEAD, 1.0)
    most = np.argmax(carried, axis=1)[:, None]
    wavenumber = np.take_along_axis(k, most, axis=1)[:, 0]
    return np.where(known, wavenumber, np.nan), np.moveaxis(energy.sum(axis=1), 1, 2)


def _branches(cell: Cell, kappa: ComplexArray, energy: FloatArray) -> list[Branch]:
    """Waves followed down from the highest frequency, where they are most unlike."""
    n, d = kappa.shape
    order = np.argsort(np.where(np.isnan(kappa[-1]), np.inf, -kappa[-1].imag))
    last = kappa[-1][order]
    picked = np.empty((n, d), dtype=int)
    for i in range(n - 1, -1, -1):
        apart = np.abs(last[:, None] - kappa[i])
        picked[i] = linear_sum_assignment(np.where(np.isnan(apart), 1e6, apart))[1]
        now = kappa[i][picked[i]]
        last = np.where(np.isnan(now), last, now)
    followed = np.take_along_axis(kappa, picked, axis=1)
    shared = np.take_along_axis(energy, picked[:, :, None], axis=1)
    branches = []
    for j in range(d):
        known = np.flatnonzero(~np.isnan(followed[:, j]))
        top = int(known[-1]) if known.size else n - 1
        member = cell.section.members[int(np.argmax(shared[top, j]))]
        branches.append(Branch(wavenumber=followed[:, j], motion=member.unknowns[0]))
    return branches


def bands(cell: Cell, phases: int = PHASES) -> FloatArray:
    """Natural frequencies of a track of equal cells without damping, by Bloch's theorem.

    Parameters
    ----------
    cell : Cell
        One of them.
    phases : int
        From cell to cell, evenly from 0 to pi.

    Returns
    -------
    array, shape (phases, n)
        Hz, increasing along n.
    """
    found = []
    for phase in np.linspace(0, np.pi, phases):
        T = bloch(cell, phase)
        squared = eigh(T.conj().T @ cell.K @ T, T.conj().T @ cell.M @ T, eigvals_only=True)
        found.append(np.sqrt(np.maximum(squared, 0)) / (2 * np.pi))
    return np.stack(found)


def stop_bands(
    track: Track, highest: float, direction: Direction, parity: int
) -> list[tuple[float, float]]:
    """Where no wave travels if nothing damps the track: (from, to) in Hz, below a highest (Hz).

    Waves of some phases leave more open than there is; in that, frequencies are asked whether all
    their waves decay, and edges halved. Bands narrower than `NARROW` of their frequency are left
    out. Direction and parity as of `dispersion`.
    """
    directions = directions_for([direction], coupled=track.rails_tilt)
    cell = _undamped(build_cell(shortest(track), parity, directions=directions))
    frequency, gaps, top = bands(cell), [], 0.0
    for low, high in zip(frequency.min(axis=0), frequency.max(axis=0), strict=True):
        gaps.append((top, min(float(low), highest)))
        top = max(top, float(high))
        if top > highest:
            break
    wide = [(low, high) for low, high in gaps if high - low > NARROW * high]
    found = [_narrowed(cell, low, high) for low, high in wide]
    return [edges for edges in found if edges and edges[1] - edges[0] > NARROW * edges[1]]


def _undamped(cell: Cell) -> Cell:
    supports = tuple(replace(s, damping=0.0, loss=0.0) for s in cell.supports)
    none = np.zeros_like(cell.K)
    return replace(cell, C=none, K_loss=none, supports=supports)


def _narrowed(cell: Cell, low: float, high: float) -> tuple[float, float] | None:
    """The part of a range of frequencies (Hz) in which all waves decay."""
    nothing = np.empty((cell.K.shape[0], 0))

    def stops(frequency: FloatArray) -> NDArray[np.bool_]:
        slow = waves(condense(cell, 2 * np.pi * frequency, nothing, nothing)).decay[:, 0]
        decays: NDArray[np.bool_] = np.abs(slow) < 1 - TRAVELLING
        return decays

    grid = np.linspace(low, high, 11)[1:-1]
    inside = np.flatnonzero(stops(grid))
    if not inside.size:
        return None
    ends = np.array([grid[inside[0]], grid[inside[-1]]])
    beyond = np.array([([low, *grid])[inside[0]], ([*grid, high])[inside[-1] + 1]])
    for _ in range(HALVINGS):
        middle = (ends + beyond) / 2
        stop = stops(middle)
        ends, beyond = np.where(stop, middle, ends), np.where(stop, beyond, middle)
    first, last = (float(f) for f in beyond)
    return first, last
