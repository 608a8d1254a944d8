"""Frequency response of state-space models against dense solutions and closed forms."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.sparse import block_diag, csc_array

from railcosim.master.component import Variable
from railcosim.master.linear.linear_form import error_estimate
from railcosim.master.linear.state_space import StateSpace


def model(A, B, C, D=None, **more) -> StateSpace:
    B, C = np.atleast_2d(B), np.atleast_2d(C)
    D = np.zeros((C.shape[0], B.shape[1])) if D is None else np.atleast_2d(D)
    return StateSpace(
        name="m",
        A=csc_array(A),
        B=B,
        C=C,
        D=D,
        inputs=tuple(Variable(name=f"u{j}") for j in range(B.shape[1])),
        outputs=tuple(Variable(name=f"y{i}") for i in range(C.shape[0])),
        **more,
    )


def dense(m: StateSpace, omega):
    one = np.eye(m.A.shape[0])
    A = m.A.toarray()
    return np.array([m.C @ np.linalg.solve(1j * w * one - A, m.B) + m.D for w in omega])


def test_blocks_of_all_sizes_in_any_order() -> None:
    """Five blocks of 1, 2, 2, 3 and 7 states, shuffled; two inputs, three outputs, feedthrough."""
    random = np.random.default_rng(1)
    sizes = (2, 7, 1, 3, 2)
    A = block_diag([random.standard_normal((k, k)) for k in sizes]).toarray()
    order = random.permutation(len(A))
    A = A[np.ix_(order, order)]
    m = model(
        A,
        random.standard_normal((15, 2)),
        random.standard_normal((3, 15)),
        random.standard_normal((3, 2)),
    )
    assert [block.shape for block in m.blocks()] == [(1, 1), (2, 2), (1, 3), (1, 7)]
    omega = np.geomspace(1e-2, 1e2, 40)
    # Rounding of solutions of this size.
    np.testing.assert_allclose(m.frequency_response(omega), dense(m, omega), rtol=1e-11)


def test_zeros_that_are_stored() -> None:
    """An FMU that declares no dependencies gives a full matrix of zeros around its blocks."""
    A = np.diag([-1.0, -2.0, -3.0])
    full = csc_array(np.ones((3, 3)))
    full.data[:] = A.T.ravel()
    m = model(full, np.eye(3), np.eye(3))
    assert m.A.nnz == 9
    np.testing.assert_allclose(m.frequency_response([2.0]), dense(m, [2.0]), rtol=1e-14)


def test_more_than_one_chunk(monkeypatch) -> None:
    random = np.random.default_rng(2)
    m = model(random.standard_normal((4, 4)), np.ones((4, 1)), np.ones((1, 4)))
    omega = np.linspace(0.1, 5.0, 23)
    whole = m.frequency_response(omega)
    monkeypatch.setattr("railcosim.master.linear.state_space.CHUNK", 9)
    np.testing.assert_allclose(m.frequency_response(omega), whole, rtol=1e-13)


def test_rigid_body() -> None:
    """A double pole at zero has one eigenvector; the receptance is -1 / (m omega^2)."""
    m = model([[0.0, 1.0], [0.0, 0.0]], [[0.0], [1 / 840.0]], [[1.0, 0.0]])
    omega = 2 * np.pi * np.geomspace(0.1, 2000.0, 30)
    exact = -1.0 / (840.0 * omega**2)
    np.testing.assert_allclose(m.frequency_response(omega)[:, 0, 0], exact, rtol=1e-14)


def test_stiff_and_soft_in_one_block() -> None:
    """A mass on 1e9 N/m that carries one on 10 N/m: the slow pole keeps its digits."""
    M, K = np.diag([2.0, 50.0]), np.array([[1e9 + 10.0, -10.0], [-10.0, 10.0]])
    A = np.block([[np.zeros((2, 2)), np.eye(2)], [-np.linalg.inv(M) @ K, -1e-3 * np.eye(2)]])
    m = model(A, [[0.0], [0.0], [0.0], [1 / 50.0]], [[0.0, 1.0, 0.0, 0.0]])
    omega = np.geomspace(0.01, 10.0, 50)
    Z = -(omega**2)[:, None, None] * M + 1e-3j * omega[:, None, None] * M + K
    exact = np.linalg.inv(Z)[:, 1, 1]
    # Measured 3e-13, with eight digits between the stiffnesses.
    np.testing.assert_allclose(m.frequency_response(omega)[:, 0, 0], exact, rtol=1e-11)


def test_no_states() -> None:
    m = model(np.zeros((0, 0)), np.zeros((0, 2)), np.zeros((1, 0)), [[2.0, 3.0]])
    np.testing.assert_array_equal(m.frequency_response([1.0, 2.0]), [[[2.0, 3.0]]] * 2)


def test_shapes_are_checked() -> None:
    with pytest.raises(ValueError, match="shapes are"):
        model(np.eye(2), np.ones((3, 1)), np.ones((1, 2)))


def test_error_estimate() -> None:
    """From a rougher model, relative to the largest output of the same unit."""
    A = [[-1.0]]
    rough = model(A, [[1.001]], [[1.0], [10.0]])
    m = model(A, [[1.0]], [[1.0], [10.0]], rougher=rough)
    # Outputs without a unit have no like.
    np.testing.assert_allclose(error_estimate(m, [1.0, 2.0]), [[1e-3], [1e-3]], rtol=1e-9)
    assert not error_estimate(rough, [1.0]).any()
