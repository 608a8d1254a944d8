"""Poles with springs added, from those without: against the eigenvalues of the matrices changed."""

import numpy as np
import pytest

from railcosim.parameters import ParameterError
from railcosim.track.changed_ring import Equal, Springs, poles_below

N, TOP = 12, 1e3


def eigen(K, C):
    """Poles and shapes of unit masses."""
    zero, one = np.zeros((N, N)), np.eye(N)
    poles, states = np.linalg.eig(np.block([[zero, one], [-K, -C]]))
    return poles, states[:N]


def system(damping):
    rng = np.random.default_rng(4)
    root = rng.normal(size=(N, N))
    return root @ root.T * 100 + 50 * np.eye(N), damping * np.diag(rng.random(N))


def found(K, C, B, springs):
    poles, shapes = eigen(K, C)
    poles, shapes = poles[poles.imag > 0], shapes[:, poles.imag > 0]
    assert poles.size == N
    a = np.einsum("im,ij,jm->m", shapes, C, shapes) + 2 * poles * np.sum(shapes**2, axis=0)
    c = B.T @ shapes
    R = np.moveaxis(c[:, None] * c / a, 2, 0)
    both, index = np.concatenate([poles, poles.conj()]), np.arange(2 * N)
    ring = Equal(
        poles=both, residues=np.concatenate([R, R.conj()]),
        moving=np.ones(2 * N, int), mirror=(index + N) % (2 * N),
    )  # fmt: skip
    s = poles_below(ring, springs, TOP, lambda text: None)
    return s.of(ring)


@pytest.mark.parametrize("places", [1, 2, 4])
@pytest.mark.parametrize("damping", [0.0, 2.0, 12.0])
def test_poles(places, damping):
    K, C = system(damping)
    B = np.eye(N)[:, :places]
    springs = Springs(
        dk=np.array([-30.0, 900.0, -20.0, 300.0])[:places],
        dc=np.array([5.0, 0.0, 9.0, 3.0])[:places],
        dm=np.array([0.0, 0.4, 2.0, 0.0])[:places],
    )
    M, *of_rest = (np.eye(N) + (B * springs.dm) @ B.T, K + (B * springs.dk) @ B.T,
                   C + (B * springs.dc) @ B.T)  # fmt: skip
    poles, _ = eigen(*(np.linalg.solve(M, A) for A in of_rest))
    exact = np.sort_complex(poles[poles.imag >= 0])
    nearest = np.abs(found(K, C, B, springs)[:, None] - exact)
    assert nearest.shape == (exact.size, exact.size)
    # Of the dense eigenvalues, 1e-13 of the largest.
    assert nearest.min(axis=0).max() < 1e-10
    assert nearest.min(axis=1).max() < 1e-10


def test_never_a_wrong_pole():
    """A damper that stops two modes' swinging: found as they are, or refused."""
    K, C = system(0.5)
    B, springs = np.eye(N)[:, :1], Springs(dk=np.zeros(1), dc=np.array([3e3]), dm=np.zeros(1))
    with pytest.raises(ParameterError, match="of the changed ring are not found"):
        found(K, C, B, springs)
