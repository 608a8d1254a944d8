"""The determinant of z minus all that a step does: its zeros are what the step does to motions."""

from __future__ import annotations

import numpy as np
import scipy.linalg

from railcosim.master.component import FloatArray
from railcosim.master.linear.partial_fractions import PartialFractions
from railcosim.master.linear.state_space import ComplexArray
from railcosim.master.stability.argument_principle import Turning, solve_triangular, windings

_STARTS = 8
"""Points of a circle from which a zero beyond it is sought, and as many of a wider one."""
_AROUND, _FAR = 1.5, 100.0
"""Radius of that, in those of the circle, and distance at which a search is given up."""
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
        self._L = _fractions(E, G, C)
        self._own, self._E = np.diag(self._T), E
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

    def zero_outside(self, radius: float, start: ComplexArray | None = None) -> complex:
        """A zero outside a circle, by Newton's method.

        Parameters
        ----------
        radius : float
            Of the circle.
        start : array of complex, optional
            Where to begin; without it, at points of the circle that are near to zeros.

        Returns
        -------
        complex
            The one found first; 0 if none is.
        """
        if not self._is_open:
            farthest = max(self._own.tolist(), key=abs, default=0.0)
            return farthest if abs(farthest) > radius else 0.0j
        z = self._starts(radius) if start is None else start
        for _ in range(_ITERATIONS):
            with np.errstate(divide="ignore", invalid="ignore"):  # where F is level
                z = z - (step := 1.0 / self._slope(z))
            distance = np.abs(z) - 1.0
            done = (np.abs(step) < _CLOSE * distance) & (np.abs(z) > radius)
            if done.any():
                return complex(max(z[done].tolist(), key=abs))
            # The poles are inside, so it is only outside that F is smooth.
            z = z[(distance > 0.0) & (distance < _FAR)]
            if not z.size:
                break
        return 0.0j

    def _along(self, radius: float) -> Turning:
        if radius not in self._circles:
            self._circles[radius] = windings(
                lambda phi: self._factor(radius * np.exp(1j * phi)),
                np.concatenate([self._own, self._E]), radius,
            )  # fmt: skip
        return self._circles[radius]

    def _factor(self, z: ComplexArray) -> ComplexArray:
        """Logarithm of F."""
        H = solve_triangular(self._T, self._R, z)
        H = self._Q @ H + self._P
        L = self._L.at(z)
        around = L @ H if self._is_wide else H @ L
        sign, size = np.linalg.slogdet(np.eye(around.shape[1]) - around)
        return np.asarray(size + 1j * np.angle(sign))

    def _slope(self, z: ComplexArray) -> ComplexArray:
        """Derivative of the logarithm of F."""
        step = _NEAR * np.maximum(np.abs(z) - 1.0, _LEAST) * z / np.abs(z)
        value, ahead = np.split(self._factor(np.concatenate([z, z + step])), 2)
        change = ahead - value
        # Near a zero it is F that is linear, not its logarithm.
        return np.asarray(np.expm1(change)) / step

    def _starts(self, radius: float) -> ComplexArray:
        """Those points of a circle from which Newton's step outwards is short."""
        turning = self._along(radius)
        seen = np.abs(turning.slope) > 0.0
        z = radius * np.exp(1j * turning.phi[seen])
        step = 1j * z / turning.slope[seen]
        outwards = np.abs(z - step) > radius
        nearest = np.argsort(np.abs(step[outwards]))[:_STARTS]
        around = radius * _AROUND * np.exp(1j * np.linspace(0.0, np.pi, _STARTS))
        return np.concatenate([z[outwards][nearest] - step[outwards][nearest], around])


def _fractions(E: ComplexArray, G: ComplexArray, C: ComplexArray) -> PartialFractions:
    """Of modes; over a step hardly two are alike, and looking for them would take longer."""
    products = (C.T[:, :, None] * G[:, None, :]).reshape(len(E), -1)
    return PartialFractions(
        centre=E.real,
        square=E.imag**2,
        slope=2.0 * products.real,
        level=-2.0 * (products * E.conj()[:, None]).real,
        column=np.arange(len(C) * G.shape[1]).reshape(len(C), G.shape[1]),
    )
