"""Free motions of a vehicle, a track and a pair, and how parameters move them."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import product
from typing import Any, TypeAlias

import numpy as np

from railcosim.master.component import FloatArray
from railcosim.master.linear.realisation import ComplexArray
from railcosim.master.progress import Progress
from railcosim.mechanics.law import tangent_stiffness
from railcosim.mechanics.ports import Direction
from railcosim.track.cell import EVEN, ODD, Cell, build_cell, independent
from railcosim.track.named_modes import NamedMode, named_modes
from railcosim.track.parameters import Track
from railcosim.track.receptance import BOTH, Point, infinite_receptance, periodic, shortest
from railcosim.track.waves import waves
from railcosim.vehicle.eigenmodes import Oscillation, swings
from railcosim.vehicle.mode_names import names_of_modes
from railcosim.vehicle.multibody import SPATIAL, Multibody, build_multibody
from railcosim.vehicle.parameters import Vehicle
from railcosim.vehicle.train import Train

from .modes_on_track import Following
from .slopes import Resonance, Stiffness, slopes
from .track_modes import asked_of, called
from .track_words import place_of

Stock: TypeAlias = Vehicle | Train
Slopes: TypeAlias = list[tuple[list[Resonance], dict[str, ComplexArray]]]
"""Resonances, and of each parameter ds / d ln p."""


def of_vehicle(stock: Stock, progress: Progress) -> Slopes:
    """Of springs and dampers, wheels held."""

    def of(one: Stock) -> Stiffness:
        body = build_multibody(one, SPATIAL)
        above = body.above
        M, C, K = (A[above, above] for A in (body.M, body.C, body.K))
        return lambda s: s[:, None, None] ** 2 * M + s[:, None, None] * C + K

    body = build_multibody(stock, SPATIAL)
    above = body.above
    modes = swings(*(A[above, above] for A in (body.M, body.C, body.K))).modes
    found = _resonances(body, [mode for mode in modes if mode.damped > 0])
    return [(found, slopes(of, stock, "", found, progress))]


def _resonances(body: Multibody, modes: Sequence[Oscillation]) -> list[Resonance]:
    count = modes[0].shape.size if modes else 0
    names = names_of_modes(
        body.coordinates[:count], np.diag(body.M)[:count], [m.shape for m in modes],
        [m.damped for m in modes],
    )  # fmt: skip
    return [
        Resonance(name=name, pole=mode.pole, right=mode.shape, left=mode.shape)
        for name, mode in zip(names, modes, strict=True)
    ]


def of_track(track: Track, progress: Progress) -> Slopes:
    """Of waves without phase, and opposite from bay to bay."""
    groups = list(product(independent(track, asked_of(track)), (EVEN, ODD)))
    every: dict[tuple[int, int], list[NamedMode]] = {
        (k, parity): named_modes(track, directions, parity)
        for k, (directions, parity) in enumerate(groups)
    }
    found: Slopes = []
    seen: set[str] = set()
    for k, (directions, parity) in enumerate(groups):
        other = next(j for j, g in enumerate(groups) if g == (directions, -parity))
        names = called(every[k, parity], every[other, -parity], parity)
        modes = [
            Resonance(name=name, pole=2j * np.pi * m.frequency, right=m.shape, left=m.shape.conj())
            for name, m in names.items()
            if name not in seen  # of opposite rails the same
        ]
        seen |= set(names)

        here = build_cell(shortest(track), parity, directions=directions)

        def of(
            one: Track, here: Cell = here, directions: Sequence[Direction] = directions
        ) -> Stiffness:
            cell = build_cell(shortest(one), here.parity, directions=directions)
            B = _same_plate(here, cell)
            M, K = (B.T @ A @ B for A in (cell.M, cell.K))
            return lambda s: K + s[:, None, None] ** 2 * M

        def share(done: float, total: float, k: int = k) -> None:
            progress(k + done / total, len(groups))

        found.append((modes, slopes(of, track, "", modes, share)))
    return found


def _same_plate(here: Cell, there: Cell) -> FloatArray:
    """Unknowns of another cell by those of one, for the same motions.

    Modes of a plate have any sign, and its rigid ones are any mixture.
    """
    if here.slab is None or there.slab is None:
        return np.eye(len(here.K))
    old, new = (cell.slab.plate.coefficients for cell in (here, there) if cell.slab)
    n, m = len(old), len(new)
    if n == 0:  # what moves aside alone
        return np.eye(len(here.K))
    first = len(here.K) - here.slab.size
    B = np.zeros((len(there.K), len(here.K)))
    B[:first, :first] = np.eye(first)
    B[first : first + m, first : first + n] = np.linalg.lstsq(
        new.reshape(m, -1).T, old.reshape(n, -1).T, rcond=None
    )[0]
    aside = here.slab.size - n
    B[len(B) - aside :, B.shape[1] - aside :] = np.eye(aside)
    return B


class Endless(Following):
    """A vertical vehicle on contact springs on a track without end.

    Parameters
    ----------
    stock, track
        Parameters.
    contact_stiffness : array, optional
        N/m, of one contact of each wheelset; Hertz's at the static loads if not given.
    """

    def __init__(
        self, stock: Stock, track: Track, contact_stiffness: FloatArray | None = None
    ) -> None:
        self.body = body = build_multibody(stock)
        k = contact_stiffness
        if k is None:
            k = np.asarray(tangent_stiffness(body.hertz_coefficient, body.wheel_load))
        self.flexibility = np.diag(1 / k)
        x = body.wheelset_x - body.wheelset_x[-1] + place_of(track, "railseat")
        self.track = shortest(track)
        self.loads = [Point(x=float(one), side=BOTH) for one in x]
        self.seen = [Point(x=float(one)) for one in x]
        self.at_rest = infinite_receptance(track, np.zeros(1), self.loads, self.seen)[0]

    def at(self, s: ComplexArray, dynamic: float = 1.0) -> ComplexArray:
        """Dynamic stiffness at complex frequencies, (m, n, n); see `Following`."""
        omega: Any = -1j * s
        rails = periodic(
            self.track, omega, self.loads, self.seen, waves, None, viscous=False
        )  # fmt: skip
        between = self.flexibility + self.at_rest + dynamic * (rails - self.at_rest)
        body, at = self.body, self.body.wheelsets
        D: ComplexArray = s[:, None, None] ** 2 * body.M + s[:, None, None] * body.C + body.K
        D[:, at[:, None], at] += 2 * np.linalg.inv(between)  # both wheels of each wheelset
        return D

    def stiffness(self, s: complex, dynamic: float) -> ComplexArray:
        """See `Following`."""
        return np.asarray(self.at(np.array([s], dtype=complex), dynamic)[0], complex)


def of_pair(stock: Stock, track: Track, progress: Progress) -> Slopes:
    """Of both, followed from the poles on rails that give way as at rest."""
    pair = Endless(stock, track)
    body = pair.body
    static = pair.stiffness(1e-9 + 0j, 0.0).real
    first = [mode for mode in swings(body.M, body.C, static).modes if mode.damped > 0]
    modes = []
    for k, mode in enumerate(first):
        progress(k, len(first) + 2)
        followed = pair.followed(mode)
        if followed is not None and followed.damped > 0:
            modes.append(followed)
    found = _resonances(body, sorted(modes, key=lambda mode: mode.undamped))
    by_vehicle = slopes(
        lambda one: Endless(one, track).at, stock, "vehicle.", found,
        lambda done, total: progress(len(first) + done / total, len(first) + 2),
    )  # fmt: skip
    by_track = slopes(
        lambda one: Endless(stock, one).at, track, "track.", found,
        lambda done, total: progress(len(first) + 1 + done / total, len(first) + 2),
    )  # fmt: skip
    return [(found, by_vehicle | by_track)]
