"""Sums over poles against dense solutions; what is alike is found without being told."""

import numpy as np
import pytest

from railcosim.master.linear import partial_fractions
from railcosim.master.linear.partial_fractions import of_modes
from railcosim.master.linear.partial_fractions import partial_fractions as fractions

RANDOM = np.random.default_rng(3)
OMEGA = np.geomspace(0.1, 30.0, 150)


def dense(A, B, C, s):
    """Block by block, and summed."""
    inverse = np.linalg.inv(s[:, None, None, None] * np.eye(2) - A)
    return (C @ inverse @ B).sum(axis=1)


def near(found, exact):
    """Rounding over 1 % damping; far from each other, or fast, the sums are almost zero."""
    assert np.all(np.abs(found - exact) < 1e-12 * np.abs(exact).max(axis=(1, 2), keepdims=True))


def chain(n, *, loaded):
    """Modes of a ring of equal masses on springs, damped, forces and motions at some masses.

    Waves of both directions have one pole: of n modes some n/2 + 1 poles are left.
    """
    turns = np.arange(n) - (n - 1) // 2  # of a wave around the ring; the last alternates
    omega = np.sqrt(4.0 + 40.0 * np.sin(np.pi * np.abs(turns) / n) ** 2)
    A = np.zeros((n, 2, 2))
    A[:, 0, 1], A[:, 1, 0], A[:, 1, 1] = 1.0, -(omega**2), -0.02 * omega
    wave = np.exp(2j * np.pi / n * (np.outer(turns, loaded) % n))
    alone = (turns == 0) | (2 * turns == n)
    shape = np.where(turns[:, None] < 0, wave.imag, wave.real)
    shape *= np.sqrt(np.where(alone, 1.0, 2.0) / n)[:, None]
    B, C = np.zeros((n, 2, len(loaded))), np.zeros((n, len(loaded), 2))
    B[:, 1], C[:, :, 0] = shape, shape
    return A, B, C


def test_what_is_alike_is_summed_once() -> None:
    """A ring of 24 masses, met at four: all that matters is how far they are apart."""
    A, B, C = chain(24, loaded=[0, 2, 4, 11])
    found = fractions(A, B, C)
    assert len(found.centre) == 13
    # Distances 0, 2, 4, 7, 9, 11; that of mass 4 and mass 11 is 7.
    assert found.slope.shape[1] == 6
    near(found.at(1j * OMEGA), dense(A, B, C, 1j * OMEGA))


def test_left_and_right_beside_each_other() -> None:
    """Two rails that waves reach alike or against each other: 20 sums for 64 responses."""
    places = [0, 1, 5, 7]
    alike, against = chain(40, loaded=places), chain(40, loaded=places)
    against[0][:, 1, 0] *= 1.7
    A = np.concatenate([alike[0], against[0]])
    B = np.concatenate([np.tile(alike[1], 2), np.concatenate([against[1], -against[1]], axis=2)])
    C = np.concatenate([np.tile(alike[2], (1, 2, 1)),
                        np.concatenate([against[2], -against[2]], axis=1)])  # fmt: skip
    # Places apart by 0, 1, 2, 4, 5, 6, 7, on one rail and across.
    assert fractions(A, B, C).slope.shape[1] == 14
    stretched = C * np.array([1.0, 1.1, 1.3, 1.6] * 2)[:, None]
    B = B * np.array([1.0, 1.1, 1.3, 1.6] * 2)
    assert fractions(A, B, stretched).slope.shape[1] == 20  # reciprocity and parity are left
    near(fractions(A, B, stretched).at(1j * OMEGA), dense(A, B, stretched, 1j * OMEGA))


def test_what_differs_a_little_is_kept_apart() -> None:
    """A pole 1e-12 beside another, a force 1e-12 beside another: neither is rounding."""
    A, B, C = chain(24, loaded=[0, 4])
    twice = np.concatenate([A, A * (1.0 + 1e-12)])
    assert len(fractions(twice, np.tile(B, (2, 1, 1)), np.tile(C, (2, 1, 1))).centre) == 26
    moved = np.concatenate([B, B[:, :, :1] * (1.0 + 1e-12)], axis=2)
    assert fractions(A, moved, C).slope.shape[1] == 4
    assert fractions(A, np.concatenate([B, B[:, :, :1]], axis=2), C).slope.shape[1] == 2


@pytest.mark.parametrize("n", [1, 7, 40])
def test_any_blocks(n: int, monkeypatch) -> None:
    """Conjugate poles, real ones, unsymmetrical; in pieces as well as at once."""
    A, B = RANDOM.standard_normal((n, 2, 2)), RANDOM.standard_normal((n, 2, 3))
    C = RANDOM.standard_normal((n, 4, 2))
    s = RANDOM.standard_normal(50) + 1j * RANDOM.standard_normal(50)
    exact = dense(A, B, C, s)
    # Rounding, next to poles that happen to be near.
    np.testing.assert_allclose(fractions(A, B, C).at(s), exact, rtol=1e-9)
    for name, value in {"POLES": 3, "FREQUENCIES": 7, "PRODUCTS": 30}.items():
        monkeypatch.setattr(partial_fractions, name, value)
    np.testing.assert_allclose(fractions(A, B, C).at(s), exact, rtol=1e-9)


def test_two_equal_poles_with_one_eigenvector() -> None:
    """A mass: -1 / (m omega^2), to the last digit."""
    A, B = np.array([[[0.0, 1.0], [0.0, 0.0]]]), np.array([[[0.0], [1 / 840.0]]])
    found = fractions(A, B, np.array([[[1.0, 0.0]]])).at(1j * OMEGA)[:, 0, 0]
    np.testing.assert_allclose(found, -1.0 / (840.0 * OMEGA**2), rtol=1e-15)


def test_modes_one_of_each_pair() -> None:
    """Against both of each pair, and real poles, which count half."""
    poles = np.array([-0.1 + 3.0j, -0.2 + 5.0j, -2.0 + 0.0j])
    B = RANDOM.standard_normal((3, 2)) + 1j * RANDOM.standard_normal((3, 2))
    C = RANDOM.standard_normal((2, 3)) + 1j * RANDOM.standard_normal((2, 3))
    s = RANDOM.standard_normal(20) + 1j * RANDOM.standard_normal(20)

    def half(p, b, c):
        return np.einsum("on,sn,ni->soi", c, 1.0 / (s[:, None] - p), b)

    exact = half(poles, B, C) + half(poles.conj(), B.conj(), C.conj())
    np.testing.assert_allclose(of_modes(poles, B, C).at(s), exact, rtol=1e-12)  # rounding


def test_around_the_unit_circle() -> None:
    """Factors of a short step are all near one; denominators are products of small differences."""
    poles = np.exp(1e-5 * np.array([-0.1 + 3.0j, -0.2 + 5.0j]))
    one = np.ones((2, 1), dtype=complex)
    z = np.exp(1e-5j * np.array([1.0, 4.0, 7.0]))
    away = z[:, None] - poles
    exact = (1.0 / away + 1.0 / (z[:, None] - poles.conj())).sum(axis=1)
    # What is left of sixteen digits where z and poles agree in five.
    np.testing.assert_allclose(of_modes(poles, one, one.T).at(z)[:, 0, 0], exact, rtol=1e-10)


def test_nothing_moves() -> None:
    none = fractions(np.zeros((0, 2, 2)), np.zeros((0, 2, 3)), np.zeros((0, 2, 2)))
    assert not none.at(1j * OMEGA).any()
    assert none.at(1j * OMEGA).shape == (150, 2, 3)
