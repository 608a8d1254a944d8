"""Growth of components coupled exactly, by counting, against all eigenvalues."""

import numpy as np
import pytest

from railcosim.master.stability.continuous import LEAST, Continuous

MODES, STATES, FED, SEEN = 60, 6, 3, 4


def coupled(seed: int, size: float) -> Continuous:
    """Modes up to 5 kHz, hardly damped, and a few states that hold them the harder."""
    rng = np.random.default_rng(seed)
    turn = 2 * np.pi * 10 ** rng.uniform(0, 3.7, MODES)
    N = rng.standard_normal((STATES, STATES)) * 50.0
    return Continuous(
        N=N - (1.0 + np.linalg.eigvals(N).real.max()) * np.eye(STATES),
        R=rng.standard_normal((STATES, SEEN)),
        Q=size * rng.standard_normal((FED, STATES)),
        P=size * rng.standard_normal((FED, SEEN)),
        poles=turn * (1j - 10 ** rng.uniform(-3, -1, MODES)),
        B=rng.standard_normal((MODES, FED)) + 0j,
        C=rng.standard_normal((SEEN, MODES)) + 1j * rng.standard_normal((SEEN, MODES)),
    )


def fastest(one: Continuous) -> float:
    """Largest real part of an eigenvalue of it all, modes and their conjugates written out."""
    poles, B = (np.concatenate([x, x.conj()]) for x in (one.poles, one.B))
    C = np.hstack([one.C, one.C.conj()])
    A = np.block([[one.N, one.R @ C], [B @ one.Q, np.diag(poles) + B @ one.P @ C]])
    return float(np.linalg.eigvals(A).real.max())


@pytest.mark.parametrize("seed", range(4))
def test_growth_is_that_of_the_fastest_eigenvalue(seed: int) -> None:
    """Of couplings from weak to strong; the same to where Newton's steps end, 1e-5."""
    found, exact = (
        np.array([of(coupled(seed, size)) for size in (1e-3, 0.1, 1.0, 10.0, 100.0)])
        for of in (Continuous.growth, fastest)
    )
    grows = exact > LEAST
    assert 0 < grows.sum() < grows.size
    assert not found[~grows].any()
    np.testing.assert_allclose(found[grows], exact[grows], rtol=1e-4)
