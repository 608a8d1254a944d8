"""Contact forces of vehicle, contact and track as one system, converged: what schemes are held to.

Nothing is exchanged and nothing extrapolated. Over an interval the unknown forces are polynomials
that fulfil the contact law, all contacts at once, at Radau's points; what they do to both bodies is
integrated exactly (their models are linear). The intervals are halved until the forces stay.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import scipy.linalg
import scipy.sparse as sp
from numpy.polynomial.legendre import legroots
from numpy.typing import ArrayLike

from railcosim.master.component import FloatArray, Variable
from railcosim.master.linear.model_exchange import linear_model
from railcosim.master.linear.state_space import IndexArray, StateSpace
from railcosim.master.polynomials import lagrange
from railcosim.master.progress import Progress, unheard
from railcosim.mechanics.law import NormalLaw
from railcosim.mechanics.ports import FORCE, RAIL, WHEEL, Layout
from railcosim.mechanics.solve import ContactError, solve_compression

STAGES = 6
"""Points an interval. The forces then are of sixth order in it, at its end of eleventh."""
FIRST = 1e-4
"""First interval, s: the fastest modes of ours, 4e4 rad/s, turn by 4 rad in it."""
HALVINGS = 4
TOLERANCE = 1e-9
"""Change of the forces by the last halving, relative RMS, at which halving ends: a thousandth of
the best coupling at the shortest steps that anybody wants to see."""
Heights = Callable[[float], FloatArray]


@dataclass(frozen=True, kw_only=True)
class ContactForces:
    """Forces over time as polynomials, one an interval.

    Attributes
    ----------
    interval : float
        Length of an interval, s.
    values : ndarray, shape (n_intervals, STAGES, n_contacts)
        Forces at Radau's points, N.
    rest : ndarray, shape (n_contacts,)
        Forces at rest, N.
    error : float
        Estimate: RMS of what the last halving of the interval changed, over that of the forces'
        deviation from rest.
    """

    interval: float
    values: FloatArray
    rest: FloatArray
    error: float = np.nan

    def at(self, times: ArrayLike) -> FloatArray:
        """Forces at some times (s), shape (n_times, n_contacts), N."""
        place = np.asarray(times, dtype=float) / self.interval
        which = np.clip(place.astype(np.intp), 0, len(self.values) - 1)
        weights = lagrange(_NODES, place - which)
        forces: FloatArray = np.einsum("tj,tjc->tc", weights, self.values[which])
        return forces


def compression_model(vehicle: Path, track: Path, positions: FloatArray) -> StateSpace:
    """Both bodies side by side: from changes of the contact forces to changes of the compressions.

    Parameters
    ----------
    vehicle, track : Path
        FMUs for Model Exchange that take the contact forces.
    positions : ndarray, shape (n_wheelsets,)
        Where the wheelsets are held, m.
    """
    layout = Layout(len(positions))
    places = dict(zip(layout.of_axles("position"), positions.tolist(), strict=True))
    forces = layout.names(FORCE)
    wheels = linear_model(vehicle, inputs=forces, outputs=layout.names(WHEEL.motion))
    rails = linear_model(track, inputs=forces, outputs=layout.names(RAIL.motion), at=places)
    return StateSpace(
        name="compressions",
        A=sp.block_diag([wheels.A, rails.A], format="csc"),
        B=np.vstack([wheels.B, rails.B]),
        C=np.hstack([wheels.C, -rails.C]),
        D=wheels.D - rails.D,
        inputs=wheels.inputs,
        outputs=tuple(Variable(name=f"{w}.compression", unit="m") for w in layout.wheels),
    )


def converged_forces(
    model: StateSpace,
    law: NormalLaw,
    rest: FloatArray,
    heights: Heights,
    stop: float,
    progress: Progress = unheard,
) -> ContactForces:
    """Solve for the contact forces from rest, with ever shorter intervals.

    Parameters
    ----------
    model : StateSpace
        From changes of the forces (N) to changes of the compressions (m); without feedthrough.
    law : NormalLaw
        Force of each contact against its compression.
    rest : ndarray, shape (n_contacts,)
        Compressions at rest, m.
    heights : callable
        Time (s) to how far the rail's surface is below its nominal height at each contact (m).
    stop : float
        Until when, s.
    progress : callable, optional
        Told what is done and the total, as if all halvings were needed; may raise to stop it.

    Returns
    -------
    ContactForces
        With an estimate of their own error, above `TOLERANCE` if `HALVINGS` did not do: forces
        that a loss of contact bends are of lower order in the interval.

    Raises
    ------
    ContactError
        If the forces of an interval cannot be found.

    References
    ----------
    .. [1] E. Hairer, G. Wanner, Solving Ordinary Differential Equations II, Springer 1996,
       sec. IV.5: collocation at Radau's points.
    """
    count = int(np.ceil(stop / FIRST - 1e-9))  # rounding in stop is no interval
    most = count * (2 ** (HALVINGS + 1) - 1)
    made = 0

    def tell() -> None:
        nonlocal made
        made += 1
        progress(made, most)

    coarse = _forces(model, law, rest, heights, stop / count, count, tell)
    for _ in range(HALVINGS):
        count *= 2
        fine = _forces(model, law, rest, heights, stop / count, count, tell)
        times = ((np.arange(count)[:, None] + _NODES) * fine.interval).ravel()
        size = np.sqrt(np.mean((fine.at(times) - fine.rest) ** 2))
        change = np.sqrt(np.mean((fine.at(times) - coarse.at(times)) ** 2))
        error = float(change / size) if size > 0 else 0.0
        coarse = ContactForces(
            interval=fine.interval, values=fine.values, rest=fine.rest, error=error
        )
        if error <= TOLERANCE:
            break
    return coarse


def _forces(
    model: StateSpace,
    law: NormalLaw,
    rest: FloatArray,
    heights: Heights,
    interval: float,
    count: int,
    tell: Callable[[], None],
) -> ContactForces:
    """Solve interval by interval."""
    if np.any(model.D):
        raise ValueError(f"{model.name}: forces act on compressions at once; that is not solved")
    n, n_contacts = model.B.shape
    end, seen, gain, push = _interval(model, interval)
    at_rest, level = law.force(rest), heights(0.0)
    x, F = np.zeros(n), np.zeros(STAGES * n_contacts)
    resting, values = np.tile(rest, STAGES), np.empty((count, STAGES, n_contacts))
    at_nodes, usual = _AtNodes(law), np.tile(at_rest, STAGES)
    for k in range(count):
        tell()
        times = interval * (k + _NODES)
        sunk = np.concatenate([heights(t) - level for t in times])
        free = resting + seen @ x - sunk
        # delta = free + gain (force(delta) - at_rest)
        try:
            delta = solve_compression(at_nodes, -gain, free - gain @ usual, guess=free + gain @ F)
        except ContactError as error:
            raise ContactError(
                f"contact forces from {times[0]:g} to {times[-1]:g} s cannot be found: is the "
                f"irregularity there physical ({np.abs(sunk).max():g} m)?"
            ) from error
        F = at_nodes.force(delta) - usual
        x = end @ x + push @ F
        values[k] = F.reshape(STAGES, n_contacts) + at_rest
    return ContactForces(interval=interval, values=values, rest=at_rest)


@dataclass(frozen=True)
class _AtNodes(NormalLaw):
    """A law of all contacts at all nodes, node by node."""

    law: NormalLaw

    def force(self, compression: FloatArray) -> FloatArray:
        """See `NormalLaw`."""
        return self.law.force(compression.reshape(STAGES, -1)).reshape(compression.shape)

    def stiffness(self, compression: FloatArray) -> FloatArray:
        """See `NormalLaw`."""
        return self.law.stiffness(compression.reshape(STAGES, -1)).reshape(compression.shape)


def _interval(
    model: StateSpace, h: float
) -> tuple[sp.csr_array, FloatArray, FloatArray, FloatArray]:
    """What an interval does: to the states (twice, first freely) and to the compressions.

    Returns
    -------
    tuple
        exp(A h), (n, n); C exp(A tau h) at all nodes, (STAGES n_contacts, n); what the forces at
        the nodes do to the compressions there; and to the states at the end.
    """
    n, m = model.B.shape
    of_powers = np.linalg.inv(np.vander(_NODES, increasing=True))  # c[j]: F(s) = sum c[j] (s/h)^j
    phi, seen, gain = _Phi(model), [], []
    for tau in _NODES:
        free, *forced = phi(tau * h)
        powers = [
            math.factorial(j) * tau ** (j + 1) * h * (forced[j] @ model.B) for j in range(STAGES)
        ]
        push = np.einsum("jnm,ji->nim", powers, of_powers).reshape(n, STAGES * m)
        seen.append((free.T @ model.C.T).T)
        gain.append(model.C @ push)
    return free, np.vstack(seen), np.vstack(gain), push  # the last node is the end


class _Phi:
    """phi_0(A t) = exp(A t), phi_j(z) = (phi_{j-1}(z) - 1/(j-1)!)/z, j up to STAGES.

    ``t^(j+1) phi_{j+1}(A t) B`` is what inputs ``s^j / j!`` have done after a time t. They are the
    first row of the exponential of [[A t, 1, 0 ...], [0, 0, 1 ...] ...], of each block of A.
    """

    def __init__(self, model: StateSpace) -> None:
        A = model.A.tocsr()
        self._shape = A.shape
        self._blocks: list[FloatArray] = []
        places: list[tuple[IndexArray, IndexArray]] = []
        for states in model.blocks():
            k = states.shape[1]
            rows, columns = np.repeat(states, k, axis=1).ravel(), np.tile(states, (1, k)).ravel()
            self._blocks.append(np.asarray(A[rows, columns]).reshape(-1, k, k))
            places.append((rows, columns))
        self._where = tuple(np.concatenate(part) for part in zip(*places, strict=True))

    def __call__(self, t: float) -> list[sp.csr_array]:
        """All of them, at a time (s)."""
        values = []
        for blocks in self._blocks:
            k = blocks.shape[1]
            big = np.zeros((len(blocks), (STAGES + 1) * k, (STAGES + 1) * k))
            big[:, :k, :k] = t * blocks
            upper = np.arange(STAGES * k)
            big[:, upper, upper + k] = 1.0
            top = scipy.linalg.expm(big)[:, :k].reshape(-1, k, STAGES + 1, k)
            values.append(np.moveaxis(top, 2, 0).reshape(STAGES + 1, -1))
        return [sp.csr_array((v, self._where), self._shape) for v in np.hstack(values)]


def _radau() -> FloatArray:
    """Radau's points on (0, 1], the end among them."""
    coefficients = np.zeros(STAGES + 1)
    coefficients[-2:] = -1.0, 1.0  # P_n - P_(n-1)
    nodes: FloatArray = (np.sort(legroots(coefficients).real) + 1.0) / 2.0
    nodes[-1] = 1.0
    return nodes


_NODES = _radau()
