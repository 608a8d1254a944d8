"""The determinant of z minus all that a step does: its zeros are what the step does to motions."""

from __future__ import annotations

import numpy as np
import scipy.linalg

from railcosim.master.component import FloatArray
from railcosim.master.linear.state_space import ComplexArray
from railcosim.master.stability.argument_principle import Turning, solve_triangular, windings

POINTS = 64
"""Of a circle, at once, which stay in the cache. A circle may take 200,000."""
_STARTS = 8
"""Points of a circle from which a zero beyond it is sought."""
_FAR = 100.0
"""Distance to the unit circle at which a search is given up."""
_ARNOLDI = 30
"""Vectors of Arnoldi's method."""
_ITERATIONS = 15
_CLOSE = 1e-5
"""Of its distance to the unit circle: Newton's step that is so short is the last one."""
_LEAST = 1e-9
"""Distance to the unit circle that is told from rounding."""
_NEAR = 1e-4
"""Of the distance to the unit circle, for a derivative by a difference: poles are inside."""


class Determinant:
    """det(z - N) det(z - modes) F(z), with F(z) = det(1 - H(z) L(z)), which is 1 at infinity.

    Parameters
    ----------
    N, R, Q, P : array
        The memory's map and H(z) = Q (z - N)^-1 R + P; see `Amplification`.
    E, G, C : array of complex
        The modes, L(z) = 2 Re C (z - E)^-1 G.
    """

    def __init__(
        self, N: FloatArray, R: FloatArray, Q: FloatArray, P: FloatArray,
        E: ComplexArray, G: ComplexArray, C: ComplexArray,
    ) -> None:  # fmt: skip
        # Forces and motions differ by the stiffness: balanced, slow motions keep their digits.
        balanced, _, _, scale, _ = scipy.linalg.lapack.dgebal(N, scale=1, permute=0)
        self._T, U = scipy.linalg.schur(balanced, output="complex")
        self._R, self._Q, self._P = U.conj().T @ (R / scale[:, None]), (Q * scale) @ U, P
        self._numerators, self._squared = _numerators(E, G, C), E.imag**2
        self._own, self._E, self._G, self._C = np.diag(self._T), E, G, C
        self._is_open = Q.size > 0 and E.size > 0
        self._is_wide = len(Q) >= len(C)
        self._circles: dict[float, Turning] = {}

    def outside(self, radius: float) -> int:
        """Count the zeros outside a circle around 0."""
        own = int((np.abs(self._own) > radius).sum())
        if not self._is_open:
            return own
        # As many more zeros than poles are outside as it turns backwards around the circle.
        free = np.where(self._E.imag != 0.0, 2, 1)[np.abs(self._E) > radius].sum()
        return own + int(free) - self._along(radius).number

    def zero_outside(self, radius: float, *, far: bool = False) -> complex:
        """A zero outside a circle, by Newton's method.

        Parameters
        ----------
        radius : float
            Of the circle.
        far : bool, optional
            Begin only where zeros far outside are thought to be, which takes a tenth of the time.

        Returns
        -------
        complex
            The one found first; 0 if none is.
        """
        if not self._is_open:
            farthest = max(self._own.tolist(), key=abs, default=0.0)
            return farthest if abs(farthest) > radius else 0.0j
        z = self._far()
        if not far:
            z = np.concatenate([z, self._near(radius)])
        z = z[np.abs(z) > radius]
        for _ in range(_ITERATIONS):
            if not z.size:
                break
            with np.errstate(divide="ignore", invalid="ignore"):  # where F is level
                z = z - (step := 1.0 / self._slope(z))
            distance = np.abs(z) - 1.0
            done = (np.abs(step) < _CLOSE * distance) & (np.abs(z) > radius)
            if done.any():
                return complex(max(z[done].tolist(), key=abs))
            # The poles are inside, so it is only outside that F is smooth.
            z = z[(distance > 0.0) & (distance < _FAR)]
        return 0.0j

    def _along(self, radius: float) -> Turning:
        if radius not in self._circles:
            self._circles[radius] = windings(
                lambda phi: self._factor(radius * np.exp(1j * phi)),
                np.concatenate([self._own, self._E]), radius,
            )  # fmt: skip
        return self._circles[radius]

    def _factor(self, z: ComplexArray) -> ComplexArray:
        """Logarithm of F, of so many points at once that what is in between stays small."""
        parts = np.split(z, range(POINTS, len(z), POINTS))
        return np.concatenate([self._factor_of(part) for part in parts])

    def _factor_of(self, z: ComplexArray) -> ComplexArray:
        H, L = self._inner(z) + self._P, self._loop(z)
        around = L @ H if self._is_wide else H @ L
        sign, size = np.linalg.slogdet(np.eye(around.shape[1]) - around)
        return np.asarray(size + 1j * np.angle(sign))

    def _inner(self, z: ComplexArray) -> ComplexArray:
        """Q (z - T)^-1 R, from the side on which there is less."""
        if len(self._Q) >= self._R.shape[1]:
            seen = self._Q @ solve_triangular(self._T, self._R, z)
            shape = len(seen), len(z), self._R.shape[1]
            return np.asarray(seen.reshape(shape).transpose(1, 0, 2))
        # Its transpose, with the unknowns in the opposite order, is upper triangular again.
        x = solve_triangular(self._T.T[::-1, ::-1], self._Q.T[::-1], z)[::-1]
        seen = self._R.T @ x
        return np.asarray(seen.reshape(len(seen), len(z), len(self._Q)).transpose(1, 2, 0))

    def _loop(self, z: ComplexArray) -> ComplexArray:
        """2 Re C (z - E)^-1 G, as if z were real: a pair of modes is a fraction of real numbers.

        (slope z + level) / ((z - Re E)^2 + (Im E)^2); real and imaginary parts of one over the
        denominator are rows of one product of matrices.
        """
        x, y = z.real[:, None], z.imag[:, None]
        off = x - self._E.real
        over = np.stack([off * off + self._squared - y * y, -2.0 * off * y])
        over /= over[0] * over[0] + over[1] * over[1]
        total = over.reshape(2 * len(z), -1) @ self._numerators
        slope, level = np.split(total[: len(z)] + 1j * total[len(z) :], 2, axis=1)
        found: ComplexArray = slope * z[:, None] + level
        return found.reshape(len(z), len(self._C), self._G.shape[1])

    def _slope(self, z: ComplexArray) -> ComplexArray:
        """Derivative of the logarithm of F."""
        step = _NEAR * np.maximum(np.abs(z) - 1.0, _LEAST) * z / np.abs(z)
        value, ahead = np.split(self._factor(np.concatenate([z, z + step])), 2)
        change = ahead - value
        # Near a zero it is F that is linear, not its logarithm.
        return np.asarray(np.expm1(change)) / step

    def _near(self, radius: float) -> ComplexArray:
        """Where Newton's step leads from points of a circle where it is short and outwards."""
        turning = self._along(radius)
        seen = np.abs(turning.slope) > 0.0
        z = radius * np.exp(1j * turning.phi[seen])
        step = 1j * z / turning.slope[seen]
        outwards = np.abs(z - step) > radius
        nearest = np.argsort(np.abs(step[outwards]))[:_STARTS]
        return np.asarray((z - step)[outwards][nearest])

    def _far(self) -> ComplexArray:
        """The largest eigenvalues of the whole map, roughly, by Arnoldi's method."""
        n = len(self._T)
        E, G, C = (np.concatenate([x, x.conj()], axis=axis) for x, axis in zip(
            (self._E, self._G, self._C), (0, 0, 1), strict=True))  # fmt: skip

        def step(x: ComplexArray) -> ComplexArray:
            m, q = x[:n], x[n:]
            f = C @ q
            return np.concatenate(
                [self._T @ m + self._R @ f, E * q + G @ (self._Q @ m + self._P @ f)]
            )

        V = np.zeros((_ARNOLDI + 1, n + len(E)), dtype=complex)
        H = np.zeros((_ARNOLDI + 1, _ARNOLDI), dtype=complex)
        V[0] = np.random.default_rng(0).standard_normal(V.shape[1])
        V[0] /= np.linalg.norm(V[0])
        for j in range(_ARNOLDI):
            new = step(V[j])
            for _ in range(2):  # once leaves what is not orthogonal by rounding
                along = V[: j + 1].conj() @ new
                new = new - along @ V[: j + 1]
                H[: j + 1, j] += along
            H[j + 1, j] = np.linalg.norm(new)
            if not np.abs(H[j + 1, j]) > 0.0:
                break
            V[j + 1] = new / H[j + 1, j]
        found = np.linalg.eigvals(H[:_ARNOLDI])
        return np.asarray(found[np.argsort(-np.abs(found))[:3]])


def _numerators(E: ComplexArray, G: ComplexArray, C: ComplexArray) -> FloatArray:
    """Slopes and beside them levels of each mode, from each input to each output."""
    count = C.shape[0] * G.shape[1]
    found = np.empty((len(E), 2 * count))
    products = 2.0 * (C.T[:, :, None] * G[:, None, :]).reshape(len(E), count)
    found[:, :count] = products.real
    np.negative((products * E.conj()[:, None]).real, out=found[:, count:])
    return found
