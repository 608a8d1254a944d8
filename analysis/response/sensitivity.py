"""How much a little more of each parameter moves the resonances: d f / d ln p.

Of free motions D(s) v = 0 the derivative of a pole is ds/dp = -(w' dD/dp v) / (w' dD/ds v), with
the left vector w: v itself of springs and dampers, its conjugate of waves. So a resonance is found
once, and each parameter costs two times the matrices; differences of these, not of poles, need no
telling which mode is which.

References
----------
Adhikari, S. (1999), Rates of change of eigenvalues and eigenvectors in damped dynamic system,
AIAA Journal 37(11), 1452-1457. Where poles are equal: Sun, J.-G. (1990), Linear Algebra Appl. 137,
183-211.
"""

from __future__ import annotations

import warnings
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from itertools import product
from typing import Any, TypeAlias

import numpy as np
import xarray as xr

from railcosim.master.component import FloatArray
from railcosim.master.linear.realisation import ComplexArray
from railcosim.master.progress import Progress, unheard
from railcosim.mechanics.law import tangent_stiffness
from railcosim.mechanics.ports import Direction
from railcosim.parameters import ParameterError, UnusualWarning, changed
from railcosim.parameters.change import numbers_of, value_at
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

from .choices import Subject
from .modes_on_track import Following
from .track_modes import asked_of, called
from .track_words import place_of

STEP = 1e-4  # of a parameter; matrices are products and quotients of few: 1e-8 of curvature
OF_POLE = 1e-6  # of a pole: as in `modes_on_track`
ALIKE = 1e-6  # relative difference of poles whose shapes are any mixture
# What the modes of a plate, and where bays are, depend on: no small change of the same matrices.
LEFT_OUT = (
    "mesh.", "slab.length", "slab.width", "slab.joint", "slab.poisson_ratio", "fastening.spacing",
)  # fmt: skip

Stiffness: TypeAlias = Callable[[ComplexArray], ComplexArray]
"""Dynamic stiffness at complex frequencies s, (m,) to (m, n, n)."""
Stock: TypeAlias = Vehicle | Train


@dataclass(frozen=True, kw_only=True)
class Resonance:
    """A free motion.

    Attributes
    ----------
    name : str
        What swings.
    pole : complex
        rad/s.
    right, left : array, shape (n,)
        Its vectors.
    """

    name: str
    pole: complex
    right: ComplexArray
    left: ComplexArray


def sensitivities(
    subject: Subject | str = Subject.PAIR,
    stock: Stock | None = None,
    track: Track | None = None,
    *,
    progress: Progress = unheard,
) -> xr.Dataset:
    """Derivatives of resonances by the logarithms of all parameters.

    Parameters
    ----------
    subject : Subject or str
        ``vehicle``: in space, its wheels held. ``track``: where its waves begin and between
        railseats, without damping, as `railcosim.track_modes` has them. ``pair``: vertical, on
        Hertz's springs at the static loads on a track without end, the last wheelset at a railseat.
    stock, track : Vehicle or Train, Track, optional
        Parameters; the paper's if not given.
    progress : callable
        Told what is done and the total.

    Returns
    -------
    Dataset
        Over ``name`` (of resonances): ``frequency`` (Hz), ``damping_ratio``; over ``parameter``
        and ``name``: ``frequency_slope``, d f / d ln p (Hz), and ``damping_slope``,
        d zeta / d ln p. Left out are parameters that are 0, whole numbers, and geometry that the
        mesh depends on.

    Raises
    ------
    ArithmeticError
        If the vehicle topples over, or no resonance of the pair is found.
    """
    stock, track = stock or Vehicle(), track or Track()
    parts = {
        Subject.VEHICLE: lambda: _of_vehicle(stock, progress),
        Subject.TRACK: lambda: _of_track(track, progress),
        Subject.PAIR: lambda: _of_pair(stock, track, progress),
    }
    return _dataset(Subject(subject), parts[Subject(subject)]())


Slopes: TypeAlias = list[tuple[list[Resonance], dict[str, ComplexArray]]]
"""Resonances, and of each parameter ds / d ln p."""


def _of_vehicle(stock: Stock, progress: Progress) -> Slopes:
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


def _of_track(track: Track, progress: Progress) -> Slopes:
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


def _of_pair(stock: Stock, track: Track, progress: Progress) -> Slopes:
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
    of_vehicle = slopes(
        lambda one: Endless(one, track).at, stock, "vehicle.", found,
        lambda done, total: progress(len(first) + done / total, len(first) + 2),
    )  # fmt: skip
    of_track = slopes(
        lambda one: Endless(stock, one).at, track, "track.", found,
        lambda done, total: progress(len(first) + 1 + done / total, len(first) + 2),
    )  # fmt: skip
    return [(found, of_vehicle | of_track)]


def slopes(
    of: Callable[[Any], Stiffness],
    parameters: Any,
    before: str,
    resonances: Sequence[Resonance],
    progress: Progress = unheard,
) -> dict[str, ComplexArray]:
    """Derivatives ds / d ln p of poles, each (resonances,), by key with something before it.

    Parameters
    ----------
    of : callable
        Makes the dynamic stiffness of parameters.
    parameters : Vehicle, Train or Track
        Where they are taken.
    before : str
        Put before each key.
    resonances : sequence of Resonance
        Free motions of it.
    progress : callable
        Told what is done and the total.
    """
    if not resonances:
        return {}
    s: ComplexArray = np.array([one.pole for one in resonances], dtype=complex)
    here = of(parameters)
    ahead, behind = (here(np.asarray(s * f, complex)) for f in (1 + OF_POLE, 1 - OF_POLE))
    by_s = (ahead - behind) / (2 * OF_POLE * s[:, None, None])
    groups = list(_alike(s))
    keys = [key for key in numbers_of(parameters) if not key.startswith(LEFT_OUT)]
    found = {}
    for k, key in enumerate(keys):
        try:
            up, down = (of(_scaled(parameters, key, f))(s) for f in (1 + STEP, 1 - STEP))
        except ParameterError:  # at the end of its range, or something must fit
            continue
        by_p = (up - down) / (2 * STEP)
        row = np.zeros(s.size, dtype=complex)
        for group in groups:
            left = np.stack([resonances[i].left for i in group])
            right = np.stack([resonances[i].right for i in group], axis=1)
            i = group[0]
            row[group] = np.linalg.eigvals(
                -np.linalg.solve(left @ by_s[i] @ right, left @ by_p[i] @ right)
            )
        found[f"{before}{key}"] = row
        progress(k + 1, len(keys))
    return found


def _scaled(parameters: Any, key: str, factor: float) -> Any:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", UnusualWarning)
        value = np.asarray(value_at(parameters, key), float)
        return changed(parameters, {key: float(value * factor)})


def _alike(s: ComplexArray) -> Iterator[list[int]]:
    """Numbers of poles that are equal, together."""
    left = list(range(s.size))
    while left:
        first = left[0]
        group = [i for i in left if abs(s[i] - s[first]) <= ALIKE * abs(s[first])]
        yield group
        left = [i for i in left if i not in group]


def _dataset(subject: Subject, parts: Slopes) -> xr.Dataset:
    resonances = [one for some, _ in parts for one in some]
    s = np.array([one.pole for one in resonances])
    keys = list(dict.fromkeys(key for _, by in parts for key in by))
    rows = np.concatenate(
        [np.array([by.get(key, np.zeros(len(some))) for key in keys]).reshape(len(keys), -1)
         for some, by in parts], axis=1,
    )  # fmt: skip
    order = np.argsort(np.abs(s))
    s, rows = s[order], rows[:, order]
    size = np.abs(s)
    by_size = (s.conj() * rows).real / size
    # zeta = -Re s / |s|.
    damping = -rows.real / size + s.real / size**2 * by_size
    over = ("parameter", "name")
    felt = np.abs(rows).max(axis=1, initial=0.0) > 0
    return xr.Dataset(
        {
            "frequency": ("name", s.imag / (2 * np.pi), {"units": "Hz"}),
            "damping_ratio": ("name", -s.real / size, {"units": "1"}),
            "frequency_slope": (
                over, rows[felt].imag / (2 * np.pi),
                {"units": "Hz", "long_name": "d f / d ln p"},
            ),
            "damping_slope": (
                over, damping[felt], {"units": "1", "long_name": "d zeta / d ln p"}
            ),
        },
        {
            "name": ("name", np.array([resonances[i].name for i in order])),
            "parameter": ("parameter", np.array(keys)[felt]),
        },
        {"title": f"sensitivities of the resonances of the {subject.value}"},
    )  # fmt: skip


__all__ = ["Endless", "Subject", "sensitivities"]
