"""Linear models that nothing joins, as one."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike
from scipy.linalg import block_diag
from scipy.sparse import block_diag as sparse_block_diag

from railcosim.master.component import FloatArray, Variable
from railcosim.master.linear.linear_form import LinearForm
from railcosim.master.linear.realisation import ComplexArray
from railcosim.master.linear.state_space import StateSpace


@dataclass(frozen=True, kw_only=True)
class SideBySide:
    """Models side by side; none answers to another's inputs. A `LinearForm`.

    Attributes
    ----------
    name : str
        What responds.
    parts : tuple of LinearForm
        The models.
    inputs, outputs : tuple of Variable
        Theirs, one after the other.
    standing : mapping of str to float
        See `LinearForm`.
    """

    name: str
    parts: tuple[LinearForm, ...]
    inputs: tuple[Variable, ...]
    outputs: tuple[Variable, ...]
    standing: Mapping[str, float]

    @classmethod
    def of(
        cls, name: str, parts: Sequence[LinearForm], names: Sequence[Mapping[str, str]]
    ) -> SideBySide:
        """Models under a common name, with the names that the variables of each have there."""
        inputs, outputs = (
            tuple(
                replace(v, name=common[v.name])
                for variables, common in zip(each, names, strict=True)
                for v in variables
            )
            for each in ([p.inputs for p in parts], [p.outputs for p in parts])
        )
        standing = {
            common[own]: value
            for part, common in zip(parts, names, strict=True)
            for own, value in part.standing.items()
        }
        return cls(name=name, parts=tuple(parts), inputs=inputs, outputs=outputs, standing=standing)

    @property
    def rougher(self) -> SideBySide | None:
        """Of those that are known less exactly, the rougher ones; None if all are exact."""
        rougher = [part.rougher for part in self.parts]
        if all(part is None for part in rougher):
            return None
        return replace(self, parts=tuple(r or p for r, p in zip(rougher, self.parts, strict=True)))

    @property
    def matrices(self) -> StateSpace:
        """The same as matrices.

        Raises
        ------
        TypeError
            If a part has none.
        """
        parts = [part for part in self.parts if isinstance(part, StateSpace)]
        if len(parts) < len(self.parts):
            raise TypeError(f"{self.name}: a part of it is known by its responses only")
        return StateSpace(
            name=self.name,
            A=sparse_block_diag([part.A for part in parts], format="csc"),
            B=block_diag(*(part.B for part in parts)),
            C=block_diag(*(part.C for part in parts)),
            D=block_diag(*(part.D for part in parts)),
            inputs=self.inputs,
            outputs=self.outputs,
            standing=self.standing,
        )

    @property
    def error_floor(self) -> FloatArray:
        """See `LinearForm`."""
        floor: FloatArray = block_diag(*(part.error_floor for part in self.parts))
        return floor

    def frequency_response(self, omega: ArrayLike) -> ComplexArray:
        """Response to unit amplitudes, shape (n_omega, n_outputs, n_inputs)."""
        found = [part.frequency_response(omega) for part in self.parts]
        whole = np.zeros((len(found[0]), len(self.outputs), len(self.inputs)), dtype=complex)
        row = column = 0
        for own in found:
            _, rows, columns = own.shape
            whole[:, row : row + rows, column : column + columns] = own
            row, column = row + rows, column + columns
        return whole


def joined(
    name: str, parts: Sequence[StateSpace], names: Sequence[Mapping[str, str]]
) -> StateSpace:
    """The same of matrices, as matrices; see `SideBySide.of`."""
    return SideBySide.of(name, parts, names).matrices
