"""Modes of a ring that is different at single railseats, from those of the equal ring.

A spring and damper added at a place, dk + dc s, act on one motion of the ring only: its stretch
there. With all complex modes, s_j' = p_j s_j + U_j f and w = Re sum U_j s_j, the changed ring has
its poles where

    1 + (dk + dc s) H(s) = 0,   H(s) = sum over j and conjugates of c_j^2 / (2 (s - p_j)),

c_j the stretch in the shape U_j, and the shapes of the new modes are sums of the old ones,
sum c_j U_j / (s - p_j). Nothing is left out, as nothing is of the modes that are given. Modes of
one pole are turned until only one of them has a stretch; the others stay as they are.

References
----------
Golub, G. H. (1973), Some modified matrix eigenvalue problems, SIAM Rev. 15(2), 318-334.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from railcosim.mechanics.arrays import ComplexArray

STILL = 1e-12  # of the largest: a stretch that does not count
ALIKE = 1e-9  # relative difference of poles that are one
POLISHED = 3  # steps of Newton: eigenvalues are known to 1e-12 of the largest of them


@dataclass(frozen=True, kw_only=True)
class Modes:
    """Complex modes whose own shapes receive forces, one of each conjugate pair.

    Attributes
    ----------
    poles : array, shape (n,)
        rad/s; a real one is its own conjugate.
    real : array of bool, shape (n,)
        Which are real.
    shapes : array, shape (places, n)
        Motions at all places that matter.
    """

    poles: ComplexArray
    real: NDArray[np.bool_]
    shapes: ComplexArray


def changed(modes: Modes, stretch: int, dk: float, dc: float) -> Modes:
    """The modes with a spring and a damper added.

    Parameters
    ----------
    modes : Modes
        All of a ring: without some of them, what a removed spring sets free would be missing.
    stretch : int
        Which of the places is the spring's stretch.
    dk, dc : float
        N/m and N s/m; negative ones take away.
    """
    modes = _turned(modes, stretch)
    c = modes.shapes[stretch]
    moves = np.abs(c) > STILL * np.abs(c).max()
    old = replace(
        modes, poles=modes.poles[moves], real=modes.real[moves], shapes=modes.shapes[:, moves]
    )
    p, residue = _spread(old.poles, old.real, c[moves] ** 2)
    found = _roots(p, residue, dk, dc)
    poles = found[found.imag > 0]
    real = np.abs(found.imag) == 0
    poles = np.concatenate([poles, found[real]])
    is_real = np.arange(poles.size) >= poles.size - real.sum()
    # w = sum over all of a motion u of the state: of q, its conjugate and real ones.
    by = old.shapes * c[moves]
    u = np.concatenate(
        [by[:, ~old.real], by[:, ~old.real].conj(), 2 * by[:, old.real].real], axis=1
    )
    shapes = np.empty((by.shape[0], poles.size), dtype=complex)
    h = dk + dc * p
    for k in range(0, poles.size, 64):
        part = slice(k, k + 64)
        x = 1 / (poles[part] - p[:, None])
        norm = (h * residue) @ (x**2)
        size = np.where(is_real[part], 1.0, 2.0) * (dk + dc * poles[part]) / norm
        shapes[:, part] = 0.5 * (u @ x) * np.sqrt(size.astype(complex))
    return Modes(
        poles=np.concatenate([modes.poles[~moves], poles]),
        real=np.concatenate([modes.real[~moves], is_real]),
        shapes=np.concatenate([modes.shapes[:, ~moves], shapes], axis=1),
    )


def _spread(
    poles: ComplexArray, real: NDArray[np.bool_], c2: ComplexArray
) -> tuple[ComplexArray, ComplexArray]:
    """Poles with their conjugates, real ones once, and residues of H there."""
    own, other = poles[~real], c2[~real] / 2
    p = np.concatenate([own, own.conj(), poles[real].real + 0j])
    return p, np.concatenate([other, other.conj(), c2[real].real + 0j])


def _roots(p: ComplexArray, residue: ComplexArray, dk: float, dc: float) -> ComplexArray:
    """Zeros of 1 + (dk + dc s) sum residue / (s - p), real ones with no imaginary part."""
    n = (p.imag > 0).sum()
    real = p[2 * n :].real
    # The same in real numbers: of a pair, its real and imaginary part.
    size = p.size
    A = np.zeros((size, size))
    even, odd = np.arange(n), n + np.arange(n)
    A[even, even] = A[odd, odd] = p[:n].real
    A[even, odd], A[odd, even] = -p[:n].imag, p[:n].imag
    A[np.arange(2 * n, size), np.arange(2 * n, size)] = real
    into = np.concatenate([2 * residue[:n].real, 2 * residue[:n].imag, residue[2 * n :].real])
    h = dk + dc * p
    # F = -Re sum (dk + dc p) q, q of half the conjugate pair each.
    felt = np.concatenate([h[:n].real, -h[:n].imag, h[2 * n :].real])
    A -= np.outer(into, felt)
    roots = np.linalg.eigvals(A).astype(complex)
    upper = roots[roots.imag > 0]
    flat = roots[roots.imag == 0]
    return np.concatenate([_polished(x, p, residue, dk, dc) for x in (upper, flat)])


def _polished(
    s: ComplexArray, p: ComplexArray, residue: ComplexArray, dk: float, dc: float
) -> ComplexArray:
    for _ in range(POLISHED):
        for k in range(0, s.size, 256):
            part = slice(k, k + 256)
            x = 1 / (s[part, None] - p)
            H, slope = x @ residue, -(x**2) @ residue
            f = 1 + (dk + dc * s[part]) * H
            step = f / ((dk + dc * s[part]) * slope + dc * H)
            good = np.abs(step) < 1e-6 * np.abs(s[part])
            s[part] -= np.where(good, step, 0.0)
    return s


def _turned(modes: Modes, stretch: int) -> Modes:
    """Modes of one pole turned until one of them alone has a stretch."""
    shapes = modes.shapes.copy()
    order = np.lexsort((modes.poles.real, modes.poles.imag))
    p = modes.poles[order]
    same = np.abs(np.diff(p)) <= ALIKE * np.abs(p[1:])
    for i in np.flatnonzero(same):
        a, b = order[i], order[i + 1]
        ca, cb = shapes[stretch, a], shapes[stretch, b]
        norm = np.sqrt(ca**2 + cb**2)
        if np.abs(norm) <= STILL * max(np.abs(ca), np.abs(cb), 1e-300):
            continue
        A, B = shapes[:, a].copy(), shapes[:, b].copy()
        # The later one takes all, so that a third of the same pole meets it.
        shapes[:, b] = (ca * A + cb * B) / norm
        shapes[:, a] = (cb * A - ca * B) / norm
        shapes[stretch, a] = 0.0
    return replace(modes, shapes=shapes)
