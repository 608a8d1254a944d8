"""Two components, each known by its frequency response, joined by springs."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike
from scipy.linalg import block_diag

from railcosim.master.component import FloatArray
from railcosim.master.linear.joint import End, Joint
from railcosim.master.linear.realisation import ComplexArray
from railcosim.master.linear.receptance import FrequencyResponse, Response

FREQUENCIES = 64
"""Solved for at once: what is between the components and the results stays in the cache."""


def couple(
    first: FrequencyResponse, second: FrequencyResponse | None, joints: Sequence[Joint]
) -> Coupled:
    """Join two free components, frequency by frequency.

    Parameters
    ----------
    first : FrequencyResponse
        A free component, for instance a vehicle without contact.
    second : FrequencyResponse or None
        The other one, at the same frequencies; None for the ground (a rigid track).
    joints : sequence of Joint
        All of one shape; at most one at an input. Without any the components stay apart.

    Returns
    -------
    Coupled
        Outputs and inputs are those of both components, as ``component.variable``, then the joints'
        forces and gaps.

    Raises
    ------
    ValueError
        If a name is unknown or comes twice, or the frequencies differ.
    """
    sides = [_side(first, [j.first for j in joints], joints)]
    if second is not None:
        sides.append(_side(second, [j.second for j in joints], joints))
        if not np.array_equal(first.omega, second.omega):
            raise ValueError(f"{first.name} and {second.name} are given at different frequencies")
    name = f"{first.name}+{'ground' if second is None else second.name}"
    forces = [name for joint in joints for name in joint.forces]
    gaps = [name for joint in joints for name in joint.gaps]
    free = [first] if second is None else [first, second]
    outputs = [label for f in free for label in _labels(f.name, f.outputs)]
    inputs = [label for f in free for label in _labels(f.name, f.inputs)]
    joined: list[Sequence[object]] = [side.joined for side in sides]
    for labels in (*joined, forces, gaps, outputs, inputs):
        if len(set(labels)) < len(labels):
            raise ValueError(f"{name}: not all different: {labels}")
    return Coupled(
        name=name,
        omega=first.omega,
        outputs=(*outputs, *forces),
        inputs=(*inputs, *gaps),
        sides=tuple(sides),
        flexibility=_diagonal([joint.flexibility for joint in joints]),
        by_gap=_diagonal([joint.by_gap for joint in joints]),
    )


@dataclass(frozen=True)
class _Side:
    """A component at its joints.

    Attributes
    ----------
    values : array of complex, shape (n_omega, n_outputs, n_inputs)
        Its responses without joints.
    omega : array, shape (n_omega,)
        rad/s.
    joined, takes : list of int, length n_joined
        The inputs that joints push on, and with which of all forces.
    motions : list of int, length n_motions
        The outputs that joints feel.
    stiffness, damping, beside : array, shape (n_joints, n_forces, n_motions), of one joint
        See `End`.
    """

    values: ComplexArray
    omega: FloatArray
    joined: list[int]
    takes: list[int]
    motions: list[int]
    stiffness: FloatArray
    damping: FloatArray
    beside: FloatArray

    def at(self, part: slice) -> _Side:
        """At some frequencies."""
        return replace(self, values=self.values[part], omega=self.omega[part])

    @cached_property
    def _forcing(self) -> ComplexArray:
        """`forcing`, and a last column of zeros, to be taken for inputs that there are not."""
        return self._law(self.stiffness, self.damping + self.beside, self.values, more=1)

    @property
    def forcing(self) -> ComplexArray:
        """What its inputs, by its motions, do to all forces, (n_omega, n_all_forces, n_inputs)."""
        return self._forcing[:, :, :-1]

    def untold(self, outputs: ComplexArray) -> ComplexArray:
        """What acts beside the forces that are told, by all outputs (n_omega, n_outputs, n)."""
        return self._law(np.zeros_like(self.beside), self.beside, outputs)

    def _law(
        self, stiffness: FloatArray, damping: FloatArray, outputs: ComplexArray, more: int = 0
    ) -> ComplexArray:
        """Forces by outputs, and so many columns of zeros."""
        motion: ComplexArray = outputs[:, self.motions]
        law: FloatArray | ComplexArray = stiffness
        if damping.any():
            law = stiffness + 1j * self.omega[:, None, None, None] * damping
        count, forces, motions = stiffness.shape
        n, columns = len(motion), motion.shape[2]
        found = np.empty((n, count, forces, columns + more), dtype=complex)
        found[..., columns:] = 0.0
        if law.shape[-2:] == (1, 1):
            np.multiply(law[..., 0], motion, out=found[:, :, 0, :columns])
        else:
            each = motion.reshape(n, count, motions, columns)
            np.matmul(law, each, out=found[..., :columns])
        return found.reshape(n, count * forces, columns + more)

    def to_forces(self, at_inputs: ComplexArray, forces: int) -> ComplexArray:
        """Loads on the joined inputs as if they were forces of the joints, all of these."""
        if self.takes == list(range(forces)):
            return at_inputs
        found = np.zeros((len(at_inputs), forces, at_inputs.shape[2]), dtype=at_inputs.dtype)
        found[:, self.takes] = at_inputs
        return found

    def by_forces(self, forces: int) -> ComplexArray:
        """What the forces of the joints do to each other through it, (n_omega, n, n_forces)."""
        columns = np.full(forces, self.values.shape[2])
        columns[self.takes] = self.joined
        return self._forcing.take(columns, axis=2)


def _side(free: FrequencyResponse, ends: Sequence[End], joints: Sequence[Joint]) -> _Side:
    first = np.cumsum([0, *(len(joint.forces) for joint in joints)]).tolist()
    laws = [
        np.array([_or_none(law, end) for end, law in zip(ends, each, strict=True)])
        for each in zip(*((e.stiffness, e.damping, e.beside) for e in ends), strict=True)
    ]
    return _Side(
        free.values,
        free.omega,
        free.columns(input_ for end in ends for input_ in end.inputs),
        [first[k] + t for k, end in enumerate(ends) for t in end.takes],
        free.rows(output for end in ends for output in end.outputs),
        *(laws or [np.zeros((0, 1, 1))] * 3),
    )


def _or_none(matrix: FloatArray | None, end: End) -> FloatArray:
    return np.zeros_like(end.stiffness) if matrix is None else matrix


@dataclass(frozen=True, kw_only=True)
class Coupled(Response):
    """Components that are joined; what is solved for is what is asked for.

    Attributes
    ----------
    sides : tuple
        The components.
    flexibility : ndarray, shape (n_forces, n_forces)
        Of the joints.
    by_gap : ndarray, shape (n_forces, n_gaps)
        What gaps do to forces.

    Notes
    -----
    With the receptances `H1` and `H2` between the joints' inputs and motions, as the components
    have their signs (a vehicle lifted by a positive contact force has a negative one), and the laws
    `A1` and `A2` of the joints, the forces follow from

        (D - A1 H1 P1 - A2 H2 P2) f = A1 y1 + A2 y2 + G gap

    with the motions y of the free components; P tells which of the forces act at which inputs. Of
    springs A is 1 and -1 and D the flexibility 1/k. Then flexibilities are added, not stiffnesses,
    so stiff joints do no harm. A force at a joint's own input is not superposed on the joint's
    force, from which it may differ in the fifth digit where the component is free to move: their
    sum is solved for instead. See [1]_ for the method.

    References
    ----------
    .. [1] D. de Klerk, D. J. Rixen, S. N. Voormeeren, General framework for dynamic substructuring,
       AIAA Journal 46 (2008) 1169-1181. https://doi.org/10.2514/1.33274
    """

    sides: tuple[_Side, ...]
    flexibility: FloatArray
    by_gap: FloatArray

    @property
    def values(self) -> ComplexArray:
        """Responses to unit amplitudes of all inputs, shape (n_omega, n_outputs, n_inputs)."""
        return self.to(self.inputs, np.eye(len(self.inputs))[None])

    def to(self, inputs: Sequence[str], loads: ArrayLike) -> ComplexArray:
        """Responses to loads; see `Response.to`."""
        given = np.asarray(loads)
        acting = np.zeros((len(given), len(self.inputs), given.shape[2]), dtype=given.dtype)
        acting[:, self.columns(inputs)] = given
        found = np.empty((len(self.omega), len(self.outputs), given.shape[2]), dtype=complex)
        for begin in range(0, len(found), FREQUENCIES):
            part = slice(begin, begin + FREQUENCIES)
            here = acting[part] if len(acting) > 1 else acting
            self._solve([side.at(part) for side in self.sides], here, found[part])
        return found

    def _solve(self, sides: Sequence[_Side], loads: ComplexArray, out: ComplexArray) -> None:
        """Responses at the frequencies that the sides are given at."""
        ends = np.cumsum([side.values.shape[2] for side in sides])
        *own, gap = np.split(loads, ends, axis=1)
        force, sums = self._forces(sides, own, gap)
        row = 0
        for side, load, total in zip(sides, own, sums, strict=True):
            both = np.empty((len(out), *load.shape[1:]), dtype=complex)
            both[:] = load
            both[:, side.joined] = total[:, side.takes]
            first, row = row, row + side.values.shape[1]
            np.matmul(side.values, both, out=out[:, first:row])
            if side.beside.any():
                force = force - side.untold(out[:, first:row])
        out[:, row:] = force

    def _forces(
        self, sides: Sequence[_Side], own: Sequence[ComplexArray], gap: ComplexArray
    ) -> tuple[ComplexArray, list[ComplexArray]]:
        """In the joints; and on each side with what else acts on the inputs they push on."""
        count = len(self.flexibility)
        at_joints = [side.by_forces(count) for side in sides]
        beside = [
            side.to_forces(load[:, side.joined], count)
            for side, load in zip(sides, own, strict=True)
        ]
        free: ComplexArray = self.by_gap @ gap
        for side, load in zip(sides, own, strict=True):
            elsewhere = load.copy()
            elsewhere[:, side.joined] = 0.0
            if elsewhere.any():
                moved: ComplexArray = side.forcing @ elsewhere
                free = free + moved
        right, wanted = [_plus(free, at_joints, beside)], []
        for k, load in enumerate(beside):
            wanted.append(load.any(axis=(0, 1)))
            if not wanted[-1].any():
                continue
            # What this side leans on: the rest of the system, without the difference of the two.
            rest = at_joints.copy()
            others = at_joints[:k] + at_joints[k + 1 :]
            rest[k] = np.asarray(self.flexibility - sum(others), dtype=np.complex128)
            right.append(_plus(free, rest, beside)[:, :, wanted[-1]])
        stacked = np.concatenate(
            [np.broadcast_to(r, (len(sides[0].values), *r.shape[1:])) for r in right], axis=2
        )
        solved = np.linalg.solve(self.flexibility - sum(at_joints), stacked)
        end = free.shape[2]
        force = solved[:, :, :end].astype(np.complex128, copy=False)
        sums = []
        for which in wanted:
            begin, end = end, end + int(which.sum())
            total = force.copy()
            total[:, :, which] = solved[:, :, begin:end]
            sums.append(total)
        return force, sums


def _plus(
    start: ComplexArray, factors: Sequence[ComplexArray], loads: Sequence[ComplexArray]
) -> ComplexArray:
    """A sum of products, of which many are zero."""
    for factor, load in zip(factors, loads, strict=True):
        if load.any():
            start = start + factor @ load
    return start


def _diagonal(blocks: Sequence[FloatArray]) -> FloatArray:
    """Blocks along the diagonal; none of no size without any."""
    found: FloatArray = block_diag(*blocks) if blocks else np.zeros((0, 0))
    return found


def _labels(word: str, names: Iterable[str]) -> list[str]:
    """``word.name`` for each name."""
    return [f"{word}.{name}" for name in names]
