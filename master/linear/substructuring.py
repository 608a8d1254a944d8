"""Two components, each known by its frequency response, joined by springs."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from railcosim.master.component import FloatArray
from railcosim.master.linear.realisation import ComplexArray
from railcosim.master.linear.receptance import FrequencyResponse, Response

FREQUENCIES = 64
"""Solved for at once: what is between the components and the results stays in the cache."""


@dataclass(frozen=True, kw_only=True)
class Joint:
    """A spring between two components, or between one and the ground.

    Its force ``stiffness * (first_output - second_output - gap)`` is the same number at the inputs
    of both components; their own signs make it a push on one and a counter-push on the other.

    Attributes
    ----------
    name : str
        The coupled response calls the force ``name.force`` and the irregularity ``name.gap``.
    first_input, first_output : str
        Force and displacement of the first component.
    second_input, second_output : str
        Of the second component; unused if there is none.
    stiffness : float
        In N/m, positive; infinite for a rigid joint.
    """

    name: str
    first_input: str
    first_output: str
    second_input: str = ""
    second_output: str = ""
    stiffness: float

    def __post_init__(self) -> None:
        if not self.stiffness > 0.0:
            raise ValueError(f"joint {self.name}: stiffness is {self.stiffness}, must be positive")


def couple(
    first: FrequencyResponse, second: FrequencyResponse | None, joints: Sequence[Joint]
) -> Coupled:
    """Join two free components by springs, frequency by frequency.

    Parameters
    ----------
    first : FrequencyResponse
        A free component, for instance a vehicle without contact.
    second : FrequencyResponse or None
        The other one, at the same frequencies; None for the ground (a rigid track).
    joints : sequence of Joint
        At most one at an input. Without any the components stay apart.

    Returns
    -------
    Coupled
        Outputs and inputs are those of both components, as ``component.variable``, the outputs
        ``joint.force`` (N) and the inputs ``joint.gap`` (m).

    Raises
    ------
    ValueError
        If a name is unknown or comes twice, or the frequencies differ.
    """
    sides = [_side(first, 1.0, [(j.first_input, j.first_output) for j in joints])]
    if second is not None:
        sides.append(_side(second, -1.0, [(j.second_input, j.second_output) for j in joints]))
        if not np.array_equal(first.omega, second.omega):
            raise ValueError(f"{first.name} and {second.name} are given at different frequencies")
    name = f"{first.name}+{'ground' if second is None else second.name}"
    names = [joint.name for joint in joints]
    free = [first] if second is None else [first, second]
    outputs = [label for f in free for label in _labels(f.name, f.outputs)]
    inputs = [label for f in free for label in _labels(f.name, f.inputs)]
    joined: list[Sequence[object]] = [side.joined for side in sides]
    for labels in (*joined, names, outputs, inputs):
        if len(set(labels)) < len(labels):
            raise ValueError(f"{name}: not all different: {labels}")
    return Coupled(
        name=name,
        omega=first.omega,
        outputs=(*outputs, *_labels("force", names, after=True)),
        inputs=(*inputs, *_labels("gap", names, after=True)),
        sides=tuple(sides),
        flexibility=np.diag([1.0 / joint.stiffness for joint in joints]),
    )


@dataclass(frozen=True)
class _Side:
    """A component at its joints.

    Attributes
    ----------
    values : array of complex, shape (n_omega, n_outputs, n_inputs)
        Its responses without joints.
    joined : list of int, length n_joints
        The inputs that joints push on.
    compressing : array of complex, shape (n_omega, n_joints, n_inputs)
        What its inputs add to the compression of the joints.
    """

    values: ComplexArray
    joined: list[int]
    compressing: ComplexArray

    def at(self, part: slice) -> _Side:
        """At some frequencies."""
        return _Side(self.values[part], self.joined, self.compressing[part])


def _side(free: FrequencyResponse, sign: float, ends: Sequence[tuple[str, str]]) -> _Side:
    motion = free.values[:, free.rows(output for _, output in ends)]
    return _Side(free.values, free.columns(input_ for input_, _ in ends), sign * motion)


@dataclass(frozen=True, kw_only=True)
class Coupled(Response):
    """Components joined by springs; what is solved for is what is asked for.

    Attributes
    ----------
    sides : tuple
        The components.
    flexibility : ndarray, shape (n_joints, n_joints)
        Of the joints, m/N.

    Notes
    -----
    With the receptances `H1` and `H2` between the joints, as the components have their signs
    (a vehicle lifted by a positive contact force has a negative one), the forces follow from

        (1/k - H1 + H2) f = z1 - z2 - gap

    with the motions of the free components. Flexibilities are added, not stiffnesses, so stiff
    joints do no harm. A force at a joint's own input is not superposed on the joint's force, from
    which it may differ in the fifth digit where the component is free to move: their sum is
    solved for instead. See [1]_ for the method.

    References
    ----------
    .. [1] D. de Klerk, D. J. Rixen, S. N. Voormeeren, General framework for dynamic substructuring,
       AIAA Journal 46 (2008) 1169-1181. https://doi.org/10.2514/1.33274
    """

    sides: tuple[_Side, ...]
    flexibility: FloatArray

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
            both[:, side.joined] = total
            first, row = row, row + side.values.shape[1]
            np.matmul(side.values, both, out=out[:, first:row])
        out[:, row:] = force

    def _forces(
        self, sides: Sequence[_Side], own: Sequence[ComplexArray], gap: ComplexArray
    ) -> tuple[ComplexArray, list[ComplexArray]]:
        """In the joints; and on each side with what else acts on the inputs they push on."""
        at_joints = [side.compressing[:, :, side.joined] for side in sides]
        beside = [load[:, side.joined] for side, load in zip(sides, own, strict=True)]
        free: ComplexArray = -gap
        for side, load in zip(sides, own, strict=True):
            elsewhere = load.copy()
            elsewhere[:, side.joined] = 0.0
            if elsewhere.any():
                moved: ComplexArray = side.compressing @ elsewhere
                free = free + moved
        right, wanted = [_plus(free, at_joints, beside)], []
        for k, load in enumerate(beside):
            # What this side leans on: the rest of the system, without the difference of the two.
            rest = at_joints.copy()
            others = at_joints[:k] + at_joints[k + 1 :]
            rest[k] = np.asarray(self.flexibility - sum(others), dtype=np.complex128)
            wanted.append(load.any(axis=(0, 1)))
            right.append(_plus(free, rest, beside)[:, :, wanted[-1]])
        stacked = np.concatenate(
            [np.broadcast_to(r, (len(sides[0].values), *r.shape[1:])) for r in right], axis=2
        )
        solved = np.linalg.solve(self.flexibility - sum(at_joints), stacked)
        ends = np.cumsum([r.shape[2] for r in right])[:-1]
        force, *with_load = np.split(solved, ends, axis=2)
        sums = []
        for which, found in zip(wanted, with_load, strict=True):
            total = force.copy()
            total[:, :, which] = found
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


def _labels(word: str, names: Iterable[str], after: bool = False) -> list[str]:
    """``word.name`` for each name, or ``name.word``."""
    return [f"{name}.{word}" if after else f"{word}.{name}" for name in names]
