"""Iterated coupling by interface quasi-Newton with an inverse Jacobian from least squares.

For what it keeps within one step this is Anderson's acceleration.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from railcosim.master.component import FloatArray
from railcosim.master.schemes.family import Family
from railcosim.master.schemes.iteration import Iterated, Until

_INDEPENDENT = 1e-8
"""Singular values below this, of the largest, are taken for rounding: a residual's digits are lost
where residuals subtract, which leaves about half of them."""
_SAME = 1e-9
"""Relative difference of steps that is rounding: what was learnt stays."""

Columns = tuple[FloatArray, FloatArray]
"""Differences of residuals, and of what the step gave, shape (n, m) each."""


@dataclass(frozen=True)
class IqnIls:
    """The method; see `iqn_ils`."""

    relaxation: float
    reuse: int

    def __post_init__(self) -> None:
        if not (math.isfinite(self.relaxation) and self.relaxation > 0.0):
            raise ValueError(f"relaxation must be positive, got {self.relaxation!r}")
        if self.reuse < 0:
            raise ValueError(f"reuse must not be negative, got {self.reuse!r}")

    def start(self) -> IqnIlsAcceleration:
        """Go to work; see `Method`."""
        return IqnIlsAcceleration(self)

    def describe(self) -> str:
        """Name with settings."""
        return f"IQN-ILS reusing {self.reuse} steps" if self.reuse else "IQN-ILS"


class IqnIlsAcceleration:
    """See `Acceleration`; it remembers the last step's length and what was learnt in the last ones.

    The memory is ``(h, steps)``, `steps` being `Columns` of one step each, the latest first.
    """

    def __init__(self, settings: IqnIls) -> None:
        self.memory: tuple[float, tuple[Columns, ...]] = (0.0, ())
        self._settings = settings
        self._h = 0.0
        self._points: list[tuple[FloatArray, FloatArray]] = []

    def begin(self, h: float) -> None:
        """Forget what was learnt from steps of another length; see `Acceleration`."""
        if abs(h - self.memory[0]) > _SAME * h:
            self.memory = (h, ())
        self._points = []

    def improve(self, x: FloatArray, residual: FloatArray, weight: FloatArray) -> FloatArray:
        """Go where the least-squares model has no residual; see `Acceleration`."""
        self._points.append((residual, x + residual))
        steps = [self._columns(), *self.memory[1]]
        V, W = (np.hstack([columns[i] for columns in steps]) for i in (0, 1))
        if not V.shape[1]:
            return x + self._settings.relaxation * residual
        # One size for all columns: those of an almost finished iteration count as well.
        scaled = V / weight[:, None]
        size = np.linalg.norm(scaled, axis=0)
        size[size == 0.0] = 1.0
        c = np.linalg.lstsq(scaled / size, -residual / weight, rcond=_INDEPENDENT)[0] / size
        # What the model does not explain is left to the fixed-point iteration.
        answer: FloatArray = x + residual + W @ c
        return answer

    def end(self, x: FloatArray, residual: FloatArray) -> None:
        """Keep what the step taught; see `Acceleration`."""
        self._points.append((residual, x + residual))
        h, steps = self.memory
        if len(self._points) > 1:
            self.memory = (h, (self._columns(), *steps)[: self._settings.reuse])

    def _columns(self) -> Columns:
        """Differences between the points of this step, the latest first."""
        residuals, answers = (np.array(values) for values in zip(*self._points[::-1], strict=True))
        return -np.diff(residuals, axis=0).T, -np.diff(answers, axis=0).T


_DEFAULT = Until()


def iqn_ils(
    *, degree: int = 1, relaxation: float = 0.1, reuse: int = 0, until: Until = _DEFAULT
) -> Iterated:
    """Iterate by a quasi-Newton method that learns how the step answers to its inputs.

    Parameters
    ----------
    degree : int, optional
        Of the polynomial by which inputs go to their values at the end of a step: 0 constant, at
        that value, 1 linear, 2 quadratic. The order of the error is one more.
    relaxation : float, optional
        The part of the residual that is gone while nothing has been learnt.
    reuse : int, optional
        From how many steps before, of the same length, what was learnt is used. It saves
        evaluations as long as components are about linear.
    until : Until, optional
        Tolerances, and what happens if they are not met.

    Returns
    -------
    Iterated
        The scheme. It needs components that can go back to a saved state.

    Raises
    ------
    ValueError
        For another degree, or settings that make no sense.

    References
    ----------
    .. [1] J. Degroote, K.-J. Bathe, J. Vierendeels, Performance of a new partitioned procedure
       versus a monolithic procedure in fluid-structure interaction, Computers & Structures 87
       (2009) 793-801.
    .. [2] D. G. Anderson, Iterative procedures for nonlinear integral equations, Journal of the
       ACM 12 (1965) 547-560.
    """
    return Iterated(IqnIls(relaxation, reuse), degree, until)


FAMILIES = (
    Family(name="iqn-ils", make=lambda degree, first: iqn_ils(degree=degree), linear=False),
)
