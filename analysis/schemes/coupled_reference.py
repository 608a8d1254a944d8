"""Contact forces of vehicle, contact and track as one system, converged: what schemes are held to.

Nothing is exchanged and nothing extrapolated. Over an interval the unknown forces are polynomials
that fulfil the contact law, all contacts at once, at Radau's points; what they do to both bodies is
integrated exactly (their models are linear). The intervals are halved until the forces stay.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import scipy.linalg
import scipy.sparse as sp
from numpy.polynomial.legendre import legroots
from numpy.typing import ArrayLike

from railcosim.analysis.pair.contact import contact_law
from railcosim.analysis.pair.wiring import force_of
from railcosim.master.component import FloatArray, Variable
from railcosim.master.law import ForceLaw, Law
from railcosim.master.linear.model_exchange import linear_model
from railcosim.master.linear.state_space import IndexArray, StateSpace
from railcosim.master.polynomials import lagrange
from railcosim.master.progress import Progress, unheard
from railcosim.mechanics.law import LinearContact
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
    values : ndarray, shape (n_intervals, STAGES, n_forces)
        Forces at Radau's points, N.
    rest : ndarray, shape (n_forces,)
        Forces at rest, N.
    error : float
        Estimate: RMS of what the last halving of the interval changed, over that of the forces'
        deviation from rest.
    """

    interval: float
    values: FloatArray
    rest: FloatArray
    error: float = np.nan

    def of(self, some: Sequence[int]) -> ContactForces:
        """Some of the forces."""
        return replace(self, values=self.values[:, :, some], rest=self.rest[some])

    def at(self, times: ArrayLike) -> FloatArray:
        """Forces at some times (s), shape (n_times, n_forces), N."""
        place = np.asarray(times, dtype=float) / self.interval
        which = np.clip(place.astype(np.intp), 0, len(self.values) - 1)
        weights = lagrange(_NODES, place - which)
        forces: FloatArray = np.einsum("tj,tjc->tc", weights, self.values[which])
        return forces


def motion_model(
    vehicle: Path, track: Path, positions: FloatArray, law: Law, layout: Layout
) -> StateSpace:
    """Both bodies side by side: from changes of the contact forces to changes of the law's motions.

    Parameters
    ----------
    vehicle, track : Path
        FMUs for Model Exchange that take the contact forces.
    positions : ndarray, shape (n_wheelsets,)
        Where the wheelsets are held, m.
    law : Law
        In the master.
    layout : Layout
        Of the wheels.
    """
    places = dict(zip(layout.of_axles("position"), positions.tolist(), strict=True))
    asked, given = [v.name for v in law.inputs], [v.name for v in law.outputs]
    bodies, pushed = [], []
    for file, face, own, at in (
        (vehicle, WHEEL, layout, {}), (track, RAIL, layout.rails, places),
    ):  # fmt: skip
        told = [n for q in (face.motion, face.rate) for n in own.names(q) if n in asked]
        model = linear_model(file, inputs=own.names(FORCE), outputs=told, at=at)
        S = law.S[:, [asked.index(name) for name in told]]
        rows = [given.index(force_of(face, port)) for port in own.ports]
        onto = np.eye(len(given))[rows]
        pushed.append(S @ model.D @ onto)
        bodies.append((model.A, model.B @ onto, S @ model.C))
    A, B, C = zip(*bodies, strict=True)
    return StateSpace(
        name="motions of the contacts",
        A=sp.block_diag(A, format="csc"),
        B=np.vstack(B),
        C=np.hstack(C),
        D=sum(pushed, start=np.zeros((len(law.S), len(given)))),
        inputs=law.outputs,
        outputs=tuple(Variable(name=f"motion[{k + 1}]", unit="1") for k in range(len(law.S))),
    )


def compression_model(vehicle: Path, track: Path, positions: FloatArray) -> StateSpace:
    """The same of contacts that are only pressed."""
    layout = Layout(len(positions))
    law = contact_law(LinearContact(k_H=1.0), layout, {})
    return motion_model(vehicle, track, positions, law, layout)


def converged_forces(
    model: StateSpace,
    law: ForceLaw,
    rest: FloatArray,
    heights: Heights,
    stop: float,
    progress: Progress = unheard,
    *,
    held: FloatArray | None = None,
) -> ContactForces:
    """Solve for the contact forces from rest, with ever shorter intervals.

    Parameters
    ----------
    model : StateSpace
        From changes of the forces (N) to changes of the motions that the law asks for, such as
        compressions (m).
    law : ForceLaw
        Forces of each contact against its motions.
    rest : ndarray, shape (n_contacts,) or (n_contacts, m)
        Motions at rest.
    heights : callable
        Time (s) to what the rails' surfaces take from the motions: by how far they are below their
        nominal height at each contact (m).
    stop : float
        Until when, s.
    progress : callable, optional
        Told what is done and the total, as if all halvings were needed; may raise to stop it.
    held : ndarray, shape (n_forces,), optional
        Forces under which both bodies stay where they are, N: those at rest if not given. Axles
        that begin to roll by others find their speed first.

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

    at_rest = law.force(rest.reshape(len(rest), -1)).ravel()
    under = at_rest if held is None else held
    coarse = _forces(model, law, rest, under, heights, stop / count, count, tell)
    for _ in range(HALVINGS):
        count *= 2
        fine = _forces(model, law, rest, under, heights, stop / count, count, tell)
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
    law: ForceLaw,
    rest: FloatArray,
    held: FloatArray,
    heights: Heights,
    interval: float,
    count: int,
    tell: Callable[[], None],
) -> ContactForces:
    """Solve interval by interval."""
    n, n_forces = model.B.shape
    end, seen, gain, push = _interval(model, interval)
    contacts = len(rest)
    at_nodes = _AtNodes(law, contacts, n_forces // contacts)
    at_rest, level = law.force(rest.reshape(contacts, -1)).ravel(), heights(0.0)
    x, F = np.zeros(n), np.zeros(STAGES * n_forces)
    resting, values = np.tile(rest.ravel(), STAGES), np.empty((count, STAGES, n_forces))
    usual = np.tile(held, STAGES)
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
        F = at_nodes.force(delta.reshape(STAGES * contacts, -1)).ravel() - usual
        x = end @ x + push @ F
        values[k] = F.reshape(STAGES, n_forces) + held
    return ContactForces(interval=interval, values=values, rest=at_rest)


@dataclass(frozen=True)
class _AtNodes:
    """A law of all contacts at all nodes, node by node; a `ContactLaw`."""

    law: ForceLaw
    contacts: int
    directions: int

    def force(self, motion: FloatArray) -> FloatArray:
        """See `ContactLaw`."""
        return self._of(self.law.force, motion)

    def tangent(self, motion: FloatArray) -> FloatArray:
        """See `ContactLaw`."""
        return self._of(self.law.tangent, motion)

    def _of(self, what: Callable[[FloatArray], FloatArray], motion: FloatArray) -> FloatArray:
        found = what(motion.reshape(STAGES, self.contacts, -1))
        return found.reshape(len(motion), *found.shape[2:])


def _interval(
    model: StateSpace, h: float
) -> tuple[sp.csr_array, FloatArray, FloatArray, FloatArray]:
    """What an interval does: to the states (twice, first freely) and to the compressions.

    Returns
    -------
    tuple
        exp(A h), (n, n); C exp(A tau h) at all nodes, (STAGES n_motions, n); what the forces at
        the nodes do to the motions there; and to the states at the end.
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
        gain[-1][:, m * len(gain) - m : m * len(gain)] += model.D
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
