"""Sums over poles at many frequencies: real arithmetic, and each number that is asked for once."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from railcosim.master.component import FloatArray
from railcosim.master.linear.realisation import ComplexArray

SAME = 16 * np.finfo(float).eps
"""Relative difference of numbers that are one number, rounded in different ways."""
_Poles: TypeAlias = NDArray[np.intp]
FREQUENCIES, POLES = 64, 512
"""At once: the three numbers of each pole at each frequency stay in the cache."""
PRODUCTS = 500_000
"""Products of poles and pairs of ports that are looked at at once: 20 MB."""


@dataclass(frozen=True, kw_only=True)
class PartialFractions:
    """Sum of (slope s + level) / ((s - centre)^2 + square), a fraction for each pair of poles.

    A slab track has thousands of poles and few different columns: waves to the left and to the
    right have the same pole, what a force here does there is what one there does here, and on a
    symmetrical body left does to left what right does to right. None of that has to be told.

    Attributes
    ----------
    centre, square : array, shape (n,)
        Mean of a pair of poles (1/s), and minus the square of half their distance (1/s^2): for
        conjugate poles their real part and the square of their imaginary part.
    slope, level : array, shape (n, n_columns)
        Numerators.
    column : array of int, shape (n_outputs, n_inputs)
        Which column is the response of an output to an input.
    """

    centre: FloatArray
    square: FloatArray
    slope: FloatArray
    level: FloatArray
    column: NDArray[np.intp]

    def at(self, s: ComplexArray) -> ComplexArray:
        """The sum at complex frequencies (n_s,) in 1/s, shape (n_s, n_outputs, n_inputs)."""
        found = np.empty((len(s), *self.column.shape), dtype=complex)
        for begin in range(0, len(s), FREQUENCIES):
            here = s[begin : begin + FREQUENCIES]
            total = self._total(here).reshape(2, len(here), 2, self.slope.shape[1])
            (level, slope), (turned, turning) = total.swapaxes(1, 2)
            x, y = here.real[:, None], here.imag[:, None]
            each = np.empty(level.shape, dtype=complex)
            np.subtract(level, y * turning, out=each.real)
            np.add(turned, y * slope, out=each.imag)
            if x.any():
                each.real += x * slope
                each.imag += x * turning
            np.take(each, self.column, axis=1, out=found[begin : begin + len(here)], mode="clip")
        return found

    def _total(self, s: ComplexArray) -> FloatArray:
        """Levels and slopes over denominators, real parts and below them imaginary ones."""
        if len(self._groups) == 1:
            ((poles, _, numerators),) = self._groups
            return self._sum(s, poles, numerators)
        total = np.zeros((2 * len(s), 2 * self.slope.shape[1]))
        for poles, columns, numerators in self._groups:
            total[:, columns] += self._sum(s, poles, numerators)
        return total

    def _sum(self, s: ComplexArray, poles: _Poles, numerators: FloatArray) -> FloatArray:
        """Real parts of numerators over denominators, and imaginary parts below them."""
        total = np.zeros((2 * len(s), numerators.shape[1]))
        for first in range(0, len(numerators), POLES):
            part = slice(first, first + POLES)
            total += self._inverse(s, poles[part]) @ numerators[part]
        return total

    @cached_property
    def _groups(self) -> list[tuple[_Poles, _Poles, FloatArray]]:
        """Poles by what they are seen in: those of lateral waves are not in vertical motion.

        Of each group its poles, levels and slopes that are not all zero, and these. A group of
        fewer poles than are summed at once belongs to the largest.
        """
        numerators = np.hstack([self.level, self.slope])
        seen = (self.level != 0.0) | (self.slope != 0.0)
        bits = np.packbits(seen, axis=1)  # to be sorted in an eighth of the time
        patterns, which = np.unique(bits, axis=0, return_inverse=True)
        count = np.bincount(which.ravel(), minlength=len(patterns))
        largest = int(count.argmax()) if count.size else 0
        group = np.where(count[which.ravel()] < POLES, largest, which.ravel())
        found, groups = [], np.unique(group).tolist()
        for k in groups:
            poles = np.flatnonzero(group == k)
            columns = np.flatnonzero(seen[poles].any(axis=0) | (len(groups) == 1))
            both = np.concatenate([columns, columns + self.slope.shape[1]])
            found.append((poles, both, np.ascontiguousarray(numerators[np.ix_(poles, both)])))
        return found

    def _inverse(self, s: ComplexArray, part: _Poles) -> FloatArray:
        """One over the denominators: real parts (n_s, n), and imaginary parts below them."""
        x, y = s.real[:, None], s.imag[:, None]
        if (x == x[0]).all():
            x = x[:1]  # on the imaginary axis what follows is one row
        off = x - self.centre[part]
        both = np.empty((2, len(s), off.shape[1]))
        np.subtract(off * off + self.square[part], y * y, out=both[0])
        np.multiply(-2.0 * off, y, out=both[1])
        size = both[0] * both[0]
        size += both[1] * both[1]
        both /= size
        return both.reshape(2 * len(s), -1)


def partial_fractions(A: FloatArray, B: FloatArray, C: FloatArray) -> PartialFractions:
    """Fractions of C (s - A)^-1 B, where A falls apart into blocks of two; what is alike, once.

    Parameters
    ----------
    A : array, shape (n, 2, 2)
        Blocks, real. A state by itself has a second one beside it that does nothing.
    B : array, shape (n, 2, n_inputs)
        What inputs do to states.
    C : array, shape (n, n_outputs, 2)
        What states do to outputs.

    Notes
    -----
    (s - A)^-1 = (s + A - trace A) / ((s - centre)^2 + square) for a block of two states, whether or
    not it has two eigenvectors, so a rigid body loses nothing.
    """
    half = (A[:, 0, 0] - A[:, 1, 1]) / 2.0
    centre = (A[:, 0, 0] + A[:, 1, 1]) / 2.0
    square = -(half * half + A[:, 0, 1] * A[:, 1, 0])
    order, starts = _same_poles(centre, square)
    blocks = _Blocks(A[order], B[order], C[order], centre[order], starts)
    shape = C.shape[1], B.shape[2]
    chosen, column = _different(blocks, shape[0] * shape[1])
    slope, level = np.empty((2, len(starts), len(chosen)))
    for rows, numerators, _ in blocks:
        slope[rows], level[rows] = numerators[:, :, chosen]
    first = order[starts]
    return PartialFractions(
        centre=centre[first], square=square[first], slope=slope, level=level,
        column=column.reshape(shape),
    )  # fmt: skip


def of_modes(poles: ComplexArray, B: ComplexArray, C: ComplexArray) -> PartialFractions:
    """Fractions of modes, one of each pair of conjugates, all of them and all columns.

    Parameters
    ----------
    poles, B, C : array of complex, shapes (n,), (n, n_inputs), (n_outputs, n)
        Poles, and the factors b and c of c b / (s - pole); those of the conjugate pole are
        conjugate, too. A real pole counts half in `C`.
    """
    products = (C.T[:, :, None] * B[:, None, :]).reshape(len(poles), -1)
    return PartialFractions(
        centre=poles.real,
        square=poles.imag**2,
        slope=2.0 * products.real,
        level=-2.0 * (products * poles.conj()[:, None]).real,
        column=np.arange(products.shape[1]).reshape(len(C), B.shape[1]),
    )


@dataclass(frozen=True)
class _Blocks:
    """Blocks in the order of their poles; those of one pole follow each other from `starts`."""

    A: FloatArray
    B: FloatArray
    C: FloatArray
    centre: FloatArray
    starts: NDArray[np.intp]

    def __iter__(self) -> Iterator[tuple[slice, FloatArray, FloatArray]]:
        """Poles, their slopes and levels, and the size of what these are rounded from.

        The last two have shape (2, n_poles, n_outputs * n_inputs).
        """
        n = max(1, PRODUCTS // (self.C.shape[1] * self.B.shape[2]))
        for begin in range(0, len(self.starts), n):
            starts = self.starts[begin : begin + n]
            end = self.starts[begin + n] if begin + n < len(self.starts) else len(self.A)
            part = slice(starts[0], end)
            numerators, sizes = self._numerators(part, starts - starts[0])
            shape = 2, len(starts), -1
            yield slice(begin, begin + len(starts)), numerators.reshape(shape), sizes.reshape(shape)

    def _numerators(self, part: slice, starts: NDArray[np.intp]) -> tuple[FloatArray, FloatArray]:
        A, B, C, trace = self.A[part], self.B[part], self.C[part], 2.0 * self.centre[part]
        terms = np.stack([C @ B, C @ (A @ B - trace[:, None, None] * B)])
        numerators = np.add.reduceat(terms, starts, axis=1)
        # Velocities over this rate are like displacements. Then all modes of a pole are rounded
        # alike, in whatever phase each of them is given.
        up, down = np.abs(A[:, 0, 1]), np.abs(A[:, 1, 0])
        there = (up > 0.0) & (down > 0.0)
        rate = np.sqrt(np.divide(down, up, out=np.ones_like(up), where=there))
        scale = np.stack([np.ones_like(rate), rate], axis=1)
        pole = np.abs(A * scale[:, None, :] / scale[:, :, None]).max(axis=(1, 2))
        c = np.add.reduceat(((C * scale[:, None, :]) ** 2).sum(axis=2), starts)
        b = np.add.reduceat(((B / scale[:, :, None]) ** 2).sum(axis=1), starts)
        size = np.sqrt(c[:, :, None] * b[:, None, :])
        return numerators, np.stack([size, size * pole[starts, None, None]])


def _same_poles(
    centre: FloatArray, square: FloatArray
) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """An order in which equal pairs of poles follow each other, and where another one begins."""
    order = np.lexsort((centre, square))
    c, q = centre[order], square[order]
    size = c * c + np.abs(q)
    is_new = (np.abs(np.diff(q)) > SAME * size[1:]) | (
        np.abs(np.diff(c)) > SAME * np.sqrt(size[1:])
    )
    return order, np.flatnonzero(np.r_[np.ones(min(len(c), 1), bool), is_new])


def _different(blocks: _Blocks, pairs: int) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Columns that differ, and which of them each column is, but for rounding."""
    random = np.random.default_rng(0)
    mark = np.zeros(pairs)
    for _, numerators, sizes in blocks:
        size = sizes.max(axis=2, initial=0.0)
        weight = random.standard_normal(size.shape) / np.where(size > 0.0, size, 1.0)
        mark += np.einsum("kp,kpc->c", weight, numerators)
    order = np.argsort(mark)
    is_new = np.ones(pairs, dtype=bool)
    is_new[1:] = False
    for _, numerators, sizes in blocks:
        step, size = np.abs(np.diff(numerators[:, :, order])), sizes[:, :, order]
        is_new[1:] |= (step > SAME * (size[:, :, 1:] + size[:, :, :-1])).any(axis=(0, 1))
    column = np.empty(pairs, dtype=np.intp)
    column[order] = np.cumsum(is_new) - 1
    return order[is_new], column
