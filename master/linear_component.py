"""A linear system as a component, stepped exactly for inputs that are polynomials in time."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import scipy.linalg
import scipy.sparse as sp
from numpy.typing import ArrayLike, NDArray

from railcosim.master.component import Component, FloatArray, Variable

_DEGREE = 2
"""Of the polynomials: as of the FMUs that this stands for."""
_FACTORIAL = np.array([1.0, 1.0, 2.0])
_KEPT = 8
"""Step lengths whose matrices are kept: a scheme may use a few, one that adapts any number."""


class LinearComponent(Component):
    """x' = A x + B u, y = C x + D u.

    Parameters
    ----------
    name : str
        Name, unique in a system.
    A : array_like or sparse array, shape (n_states, n_states)
        It may fall apart into many small blocks, as modes do; they are exponentiated one by one.
    B, C, D : array_like, shapes (n_states, n_inputs), (n_outputs, n_states), (n_outputs, n_inputs)
        The other matrices.
    inputs, outputs : sequence of Variable
        The interface.
    x0 : array_like, optional
        State at the beginning, shape (n_states,); zero if not given.

    Attributes
    ----------
    x : array, shape (n_states,)
        The state.
    """

    can_rollback = True
    max_input_derivative = _DEGREE

    def __init__(
        self,
        name: str,
        *,
        A: Any,
        B: ArrayLike,
        C: ArrayLike,
        D: ArrayLike,
        inputs: Sequence[Variable],
        outputs: Sequence[Variable],
        x0: ArrayLike | None = None,
    ) -> None:
        super().__init__(name, inputs, outputs)
        self.A = sp.csr_array(np.atleast_2d(A) if not sp.issparse(A) else A)
        n, m, p = self.A.shape[0], len(self.inputs), len(self.outputs)
        self.B = np.asarray(B, dtype=float).reshape(n, m)
        self.C = np.asarray(C, dtype=float).reshape(p, n)
        self.D = np.asarray(D, dtype=float).reshape(p, m)
        self.x: FloatArray = np.zeros(n) if x0 is None else np.array(x0, dtype=float).reshape(n)
        self._inputs = self.u.copy()
        self._derivatives: FloatArray = np.zeros((0, m))
        self._matrices: dict[float, tuple[Any, FloatArray]] = {}
        self._last = 0.0
        self._end = self._inputs, np.zeros(m)  # inputs at the end of the last step, and their rates

    @property
    def feedthrough(self) -> NDArray[np.bool_]:
        """Whether an output depends at once on an input, shape (n_outputs, n_inputs)."""
        depends: NDArray[np.bool_] = self.D != 0.0
        return depends

    def write_inputs(self) -> None:
        """Make `u` the inputs at the present time."""
        self._inputs = self.u.copy()

    def read_outputs(self) -> None:
        """Put the outputs into `y`."""
        self.y[:] = self.C @ self.x + self.D @ self._inputs

    def set_input_derivatives(self, derivatives: FloatArray) -> None:
        """Give derivatives of the inputs for the next step; see `Component`."""
        if len(derivatives) > _DEGREE:
            raise ValueError(f"{self.name}: takes {_DEGREE} derivatives, got {len(derivatives)}")
        self._derivatives = derivatives.copy()

    def do_step(self, t: float, h: float) -> None:
        """Go from time `t` to `t + h` (s), exactly."""
        E, G = self._exponentials(h)
        m = self._inputs.size
        taylor = np.concatenate([self._inputs, self._derivatives.ravel()])
        self.x = E @ self.x + G[:, : taylor.size] @ taylor
        self._end = self._inputs, np.zeros(m)
        if len(self._derivatives):
            path = np.vstack([self._inputs, self._derivatives])
            powers = h ** np.arange(len(path)) / _FACTORIAL[: len(path)]
            self._end = powers @ path, powers[:-1] @ path[1:]
        self._derivatives, self._last = np.zeros((0, m)), h

    def step_derivative(self) -> FloatArray:
        """Change of the outputs per change of an input held over the last step."""
        G = self._exponentials(self._last)[1]
        matrix: FloatArray = self.C @ G[:, : len(self.inputs)] + self.D
        return matrix

    def output_rates(self) -> FloatArray:
        """Rates of the outputs at the end of the last step; see `Component`."""
        u, rate = self._end
        rates: FloatArray = self.C @ (self.A @ self.x + self.B @ u) + self.D @ rate
        return rates

    def save_state(self) -> Any:
        """Snapshot; its arrays are never written to."""
        return self.x, self._inputs, self._derivatives, self._end

    def restore_state(self, state: Any) -> None:
        """Go back to a snapshot."""
        self.x, self._inputs, self._derivatives, self._end = state

    def _exponentials(self, h: float) -> tuple[Any, FloatArray]:
        """exp(A h), and what the inputs and their derivatives add, over a step `h`."""
        if h not in self._matrices:
            if len(self._matrices) >= _KEPT:
                del self._matrices[next(iter(self._matrices))]
            phi = _exponentials(self.A, h)
            G = np.hstack([h ** (j + 1) * (phi[j + 1] @ self.B) for j in range(_DEGREE + 1)])
            self._matrices[h] = phi[0], G
        return self._matrices[h]


def _exponentials(A: Any, h: float) -> list[Any]:
    """phi_0 = exp(A h), phi_j(z) = (phi_{j-1}(z) - 1/(j-1)!)/z at z = A h, sparse, j up to 3.

    From the exponential of [[A h, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1], [0, 0, 0, 0]], whose first
    row they are; block by block of A, blocks of one size together.
    """
    n_blocks, label = sp.csgraph.connected_components(A, directed=False)
    order = np.argsort(label, kind="stable")
    sizes = np.bincount(label, minlength=n_blocks)
    first = np.concatenate([[0], np.cumsum(sizes)[:-1]])
    dense = A.tocsr()
    rows, columns, values = [], [], []
    count = _DEGREE + 2
    for k in np.unique(sizes):
        states = order[first[sizes == k][:, None] + np.arange(k)]  # (n_blocks of this size, k)
        big = np.zeros((len(states), count * k, count * k))
        big[:, :k, :k] = h * _blocks(dense, states)
        upper = np.arange((count - 1) * k)
        big[:, upper, upper + k] = 1.0
        top = scipy.linalg.expm(big)[:, :k].reshape(len(states), k, count, k)
        rows.append(np.broadcast_to(states[:, :, None], (len(states), k, k)).ravel())
        columns.append(np.broadcast_to(states[:, None, :], (len(states), k, k)).ravel())
        values.append(np.moveaxis(top, 2, 0).reshape(count, -1))
    where = np.concatenate(rows), np.concatenate(columns)
    return [sp.csr_array((v, where), shape=A.shape) for v in np.concatenate(values, axis=1)]


def _blocks(A: Any, states: NDArray[np.intp]) -> FloatArray:
    """Dense diagonal blocks, shape (n_blocks, k, k), of rows and columns `states` (n_blocks, k)."""
    k = states.shape[1]
    rows = np.repeat(states, k, axis=1).ravel()
    columns = np.tile(states, (1, k)).ravel()
    blocks: FloatArray = np.asarray(A[rows, columns]).reshape(-1, k, k)
    return blocks
