"""Modes of a ring that is different at single railseats, from those of the equal ring.

Springs, dampers and masses added at places, D(s) = dk + dc s + dm s^2, act on the ring's stretches
(or motions) there only; D is symmetric, and diagonal where each place has its own. With all complex
modes of the equal ring, s_j' = p_j s_j + U_j f and w = Re sum U_j s_j, and their stretches c_j, the
changed ring has its poles where

    det(1 + D(s) H(s)) = 0,   H(s) = sum over j and conjugates of c_j c_j' / (2 (s - p_j)),

and the shapes of the new modes are sums of the old ones, sum U_j (c_j' z) / (s - p_j), z the forces
of the springs: (1 + D H) z = 0. Nothing is left out, as nothing is of the modes that are given;
only poles below a frequency are looked for. All are found at once (Ehrlich and Aberth), each
beside the old pole it comes from, and told by how far it is from there: of one that hardly moves no
digit is lost. Of modes of one pole no more move than there are springs.

References
----------
Golub, G. H. (1973), Some modified matrix eigenvalue problems, SIAM Rev. 15(2), 318-334.
Bini, D. A. & Robol, L. (2014), Solving secular and polynomial equations, J. Comput. Appl. Math.
272, 276-292.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from railcosim.mechanics.arrays import ComplexArray, FloatArray
from railcosim.parameters import ParameterError

MARGIN = 1.2  # poles followed beyond the highest looked for: some come down over it
HEAVY = 0.5  # |Im p| / |p| below which a pole and its conjugate may meet and be two real ones
FOUND, OF_ITS_WAY = 1e-11, 1e-6  # last steps, of a pole and of its way; what is left is the square
LOST = 1e-18  # of a pole: a way of which rounding leaves nothing
MOST_STEPS = 200
PATIENCE = 40  # steps after which a pole and its mirror image are taken for two real ones
AT_FIRST = 0.4  # of the way to the next pole: the farthest first guess
PART = 128  # poles at once: 128 rows of the sums stay near the processor
ONE = 1e-10  # relative distance of poles found that are one


@dataclass(frozen=True, kw_only=True)
class Equal:
    """The equal ring as the springs feel it: its different poles, m and conjugates behind.

    Attributes
    ----------
    poles : array, shape (n,)
        rad/s.
    residues : array, shape (n, k, k)
        Of the stretches.
    moving : array of int, shape (n,)
        How many modes of that pole the springs move.
    mirror : array of int, shape (n,)
        The conjugate, or itself where real.
    """

    poles: ComplexArray
    residues: ComplexArray
    moving: NDArray[np.intp]
    mirror: NDArray[np.intp]


@dataclass(frozen=True, kw_only=True)
class Springs:
    """Stiffnesses, dampings and masses added between k places, (k, k), N/m, N s/m and kg.

    Negative ones take away.
    """

    dk: FloatArray
    dc: FloatArray
    dm: FloatArray

    def at(self, s: ComplexArray) -> ComplexArray:
        """Dynamic stiffness, shape (..., k, k)."""
        s = s[..., None, None]
        return self.dk + (self.dc + self.dm * s) * s

    def slope(self, s: ComplexArray) -> ComplexArray:
        """Its derivative."""
        return self.dc + 2 * self.dm * s[..., None, None]


@dataclass(frozen=True, kw_only=True)
class Poles:
    """Poles found, as ways from old ones.

    Attributes
    ----------
    beside : array of int, shape (m,)
        Old poles.
    way : array, shape (m,)
        From there, rad/s.
    """

    beside: NDArray[np.intp]
    way: ComplexArray

    def of(self, ring: Equal) -> ComplexArray:
        """The poles themselves, rad/s."""
        return ring.poles[self.beside] + self.way

    def some(self, part: NDArray[np.intp] | NDArray[np.bool_] | slice) -> Poles:
        """Of them, some."""
        return Poles(beside=self.beside[part], way=self.way[part])

    def pull(self, ring: Equal) -> ComplexArray:
        """1 / (s - p) of every one and every old one."""
        apart = ring.poles[self.beside][:, None] - ring.poles
        apart += self.way[:, None]
        pull: ComplexArray = np.reciprocal(apart, out=apart)
        return pull


def poles_below(
    ring: Equal, springs: Springs, top: float, progress: Callable[[str], None]
) -> Poles:
    """Poles of the changed ring that came from moving ones below a frequency, and a bit beyond.

    Parameters
    ----------
    ring : Equal
        With ALL modes of a ring: without some of them, what a removed spring sets free would be
        missing.
    springs : Springs
        What is added.
    top : float
        rad/s.
    progress : callable
        Told how many are found.

    Returns
    -------
    Poles
        One of each conjugate pair; real ones with no imaginary part.

    Raises
    ------
    ParameterError
        If poles are not found or not told apart.
    """
    near = np.where(np.abs(ring.poles) < MARGIN * top, ring.moving, 0)
    heavy = np.abs(ring.poles.imag) < HEAVY * np.abs(ring.poles)
    # Of most pairs one is followed and the other is its mirror image. Two that may become real are
    # followed by themselves, first guesses being no mirror images.
    single = ~heavy & (ring.poles.imag > 0)
    s = _guesses(ring, springs, np.where(single | heavy, near, 0))
    twice = single[s.beside]
    s.way[~twice] *= np.exp(0.3j)
    waiting = np.arange(s.way.size)
    for count in range(MOST_STEPS):
        if count == PATIENCE:
            s, twice, waiting = _parted(ring, s, twice, waiting)
        progress(f"{s.way.size - waiting.size} of {s.way.size} modes")
        left = []
        for k in range(0, waiting.size, PART):
            part = waiting[k : k + PART]
            left.append(part[~_step(ring, springs, near, s, twice, part)])
        waiting = np.concatenate(left)
        if not waiting.size:
            return _one_of_each(ring, s, twice)
    raise ParameterError(
        f"{waiting.size} of {s.way.size} modes of the changed ring are not found; "
        "change fewer places, or by less"
    )


def forces(
    ring: Equal, springs: Springs, s: Poles
) -> Iterator[tuple[ComplexArray, ComplexArray, ComplexArray]]:
    """What springs do in new modes: z of unit modes (m, k), their stretches, and the pull."""
    for k in range(0, s.way.size, PART):
        part = slice(k, k + PART)
        pull = s.some(part).pull(ring)
        H, slope = _felt(ring, pull)
        pole = s.some(part).of(ring)
        within = np.eye(H.shape[1]) + springs.at(pole) @ H
        z = np.linalg.svd(within)[2][:, -1].conj()
        # The residue of -(D^-1 + H)^-1: modes receive forces by their own shapes.
        norm = np.einsum("mi,mij,mj->m", z, slope, z)
        stretch = np.einsum("mij,mj->mi", H, z)
        norm -= np.einsum("mi,mij,mj->m", stretch, springs.slope(pole), stretch)
        count = np.where(pole.imag == 0, 1.0, 2.0)
        z *= np.sqrt(-count / norm)[:, None]
        yield z, np.einsum("mij,mj->mi", H, z), pull


def _parted(
    ring: Equal, s: Poles, twice: NDArray[np.bool_], waiting: NDArray[np.intp]
) -> tuple[Poles, NDArray[np.bool_], NDArray[np.intp]]:
    """Follow those that wait and their mirror images by themselves, no longer mirrored."""
    own = waiting[twice[waiting]]
    twice = np.append(twice, np.zeros(own.size, bool))
    twice[own] = False
    waiting = np.append(waiting, s.way.size + np.arange(own.size))
    mirrored = s.way[own].conj() * np.exp(0.3j)
    s = Poles(
        beside=np.append(s.beside, ring.mirror[s.beside[own]]), way=np.append(s.way, mirrored)
    )
    return s, twice, waiting


def _felt(ring: Equal, pull: ComplexArray) -> tuple[ComplexArray, ComplexArray]:
    """H and its derivative, (m, k, k)."""
    n, k, _ = ring.residues.shape
    R = ring.residues.reshape(n, k * k)
    return (pull @ R).reshape(-1, k, k), -((pull * pull) @ R).reshape(-1, k, k)


def _guesses(ring: Equal, springs: Springs, count: NDArray[np.intp]) -> Poles:
    """So many beside every old pole, as if that were the only one that is near."""
    beside, way = [], []
    old = np.flatnonzero(count)
    for k in range(0, old.size, PART):
        part = old[k : k + PART]
        apart = ring.poles[part][:, None] - ring.poles
        apart[np.arange(part.size), part] = np.inf
        H, _ = _felt(ring, 1 / apart)
        D = springs.at(ring.poles[part])
        own = np.linalg.eigvals(
            -np.linalg.solve(np.eye(H.shape[1]) + D @ H, D @ ring.residues[part])
        )
        size = np.abs(own)
        rank = np.argsort(np.argsort(-size, axis=1), axis=1)
        most = AT_FIRST * np.abs(apart).min(axis=1, keepdims=True) / (1 + rank)
        least = 1e-20 * np.abs(ring.poles[part])[:, None] * (1 + rank)
        own = np.where(size > least, own * np.minimum(1, most / np.maximum(size, least)), least)
        row, column = np.nonzero(rank < count[part][:, None])
        beside.append(part[row])
        way.append(own[row, column].astype(complex))
    return Poles(beside=np.concatenate(beside), way=np.concatenate(way))


def _step(
    ring: Equal,
    springs: Springs,
    near: NDArray[np.intp],
    s: Poles,
    twice: NDArray[np.bool_],
    part: NDArray[np.intp],
) -> NDArray[np.bool_]:
    """Move some of the poles by Newton's step of what all others leave; whether they are there."""
    own = s.some(part)
    pull, pole = own.pull(ring), own.of(ring)
    H, slope = _felt(ring, pull)
    D = springs.at(pole)
    within = np.eye(H.shape[1]) + D @ H
    change = D @ slope + springs.slope(pole) @ H
    hit = np.linalg.det(within) == 0
    within[hit] = np.eye(H.shape[1])
    newton = np.trace(np.linalg.solve(within, change), axis1=1, axis2=2)
    newton += pull @ near.astype(complex)
    # Relative to one old pole all ways are exact where two are near each other.
    mirror = ring.mirror[s.beside[twice]]
    for beside, way, itself in ((s.beside, s.way, True), (mirror, s.way[twice].conj(), False)):
        apart = ring.poles[own.beside][:, None] - ring.poles[beside]
        apart += own.way[:, None] - way
        if itself:
            apart[np.arange(part.size), part] = np.inf
        newton -= np.sum(1 / apart, axis=1)
    step = np.where(hit, 0, 1 / newton)
    nearest = np.argmin(np.abs(ring.poles - (pole - step)[:, None]), axis=1)
    s.way[part] = (ring.poles[own.beside] - ring.poles[nearest]) + (own.way - step)
    s.beside[part] = nearest
    enough = np.minimum(FOUND * np.abs(pole), OF_ITS_WAY * np.abs(s.way[part]))
    there: NDArray[np.bool_] = np.abs(step) < np.maximum(enough, LOST * np.abs(pole))
    return there


def _one_of_each(ring: Equal, s: Poles, twice: NDArray[np.bool_]) -> Poles:
    """Without mirror images, if all poles are different."""
    below = twice & (s.of(ring).imag < 0)  # of a pair the other one was met
    s.beside[below], s.way[below] = ring.mirror[s.beside[below]], s.way[below].conj()
    pole = s.of(ring)
    flat = ~twice & (np.abs(pole.imag) < FOUND * np.abs(pole))
    s.way[flat] -= 1j * s.of(ring)[flat].imag
    chosen = s.some(flat | (pole.imag > 0))
    pole = chosen.of(ring)
    alone = pole.size + np.sum(pole.imag > 0) == s.way.size + twice.sum()
    for k in range(0, pole.size, PART):
        part = chosen.some(slice(k, k + PART))
        apart = ring.poles[part.beside][:, None] - ring.poles[chosen.beside]
        apart += part.way[:, None] - chosen.way
        apart[np.arange(part.way.size), k + np.arange(part.way.size)] = np.inf
        size = np.minimum(np.abs(part.way), ONE * np.abs(pole[k : k + PART]))
        alone = alone and bool((np.abs(apart).min(axis=1) > 1e-3 * size).all())
    if not alone:
        raise ParameterError(
            "modes of the changed ring are not told apart; move one place by a railseat"
        )
    return chosen
