"""What faded modes of a track leave out where rails go down: an oscillator under every wheel."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from railcosim.mechanics.arrays import ComplexArray, FloatArray

from .along import Rows
from .left_out import FIT_FROM, TRIFLE, at_places, held_by, left_out_by, natural, static_flexibility
from .parameters import Track
from .ring import RingModes
from .section import VERTICAL

FIT_TO = 0.4  # of the highest frequency kept: where the residual's inertia shows
LEAST_DAMPING, MOST_DAMPING = 1e-3, 0.9  # ratio of the residual's pole, whatever the fit finds
RIPPLES = 5.0  # m: those of the modes fade with distance
OTHERS, APART = 3, 1.5  # other wheelsets, and m to the next one; bogies have 1.8 m or more


@dataclass(frozen=True, kw_only=True)
class LeftOut:
    """What modes of one kind of track leave out, where rails go down.

    Attributes
    ----------
    rows : Rows
        Of its tables.
    at_nodes : array, shape (n_omega, n_nodes)
        At frequencies of the fit, the first one 0.
    known : array of bool, shape (n_nodes,)
        Where it is more than rounding.
    static : array, shape (places,)
        At rest, not negative.
    missing : array, shape (places,)
        See `_missing_jumps`.
    """

    rows: Rows
    at_nodes: ComplexArray
    known: NDArray[np.bool_]
    static: FloatArray
    missing: FloatArray

    @classmethod
    def of(
        cls, track: Track, rows: Rows, tables: list[ComplexArray], modes: list[RingModes]
    ) -> LeftOut:
        """Of a track's own ring; see `left_out_by`."""
        omega = _frequencies(track)
        N = left_out_by(track, rows, tables, modes, VERTICAL, omega)[0][:, :, 0, 0]
        whole = static_flexibility(track, rows, VERTICAL)[:, 0, 0]
        # Fading modes may leave out less than nothing at a railseat that is all but clamped. An
        # oscillator of negative flexibility would give power at its resonance.
        return cls(
            rows=rows,
            at_nodes=N,
            known=N[0].real > TRIFLE * whole.mean(),
            static=np.maximum(whole - held_by(rows, tables, modes)[:, 0, 0], TRIFLE * whole),
            missing=_missing_jumps(track, rows, tables, modes),
        )


def _frequencies(track: Track) -> FloatArray:
    top = 2 * np.pi * track.mesh.highest_frequency
    return np.concatenate([[0.0], np.linspace(FIT_FROM, FIT_TO, 8) * top])


def residual(track: Track, kinds: Sequence[LeftOut]) -> tuple[complex, list[ComplexArray]]:
    """Pole of the residual, and its shape at all places of the rows of each kind, (.., 1, 1).

    What is left out is nearly (R0 + tau s) / (1 + d s + s^2 / omega_r^2). R0 and tau differ from
    place to place; omega_r, by least squares, and d do not. R0 is known everywhere, tau from the
    nodes.

    Complete, a track answers an impulse with a motion that begins at 0. Some of its complex modes
    alone begin with a jump, and at a damped railseat against the force: above their frequencies the
    rail would give power to what rests on it. The residual jumps by tau omega_r^2, which must make
    up for it. And it must take no less power than what is left out: where waves run between wheels
    undamped, their powers nearly cancel. The d taken is the least that allows both.

    Parameters
    ----------
    track : Track
        Whose highest frequency is that of all kinds.
    kinds : sequence of LeftOut
        One, or those that a wheel meets one after the other.
    """
    omega = _frequencies(track)
    w = omega[1:, None]
    N = np.concatenate([kind.at_nodes for kind in kinds], axis=1)
    known = np.concatenate([kind.known for kind in kinds])
    omega_r = natural(N, known, w, 2 * np.pi * track.mesh.highest_frequency)
    losses, d = [], -np.inf
    for kind in kinds:
        loss = np.max(-kind.at_nodes[1:].imag / w * (1 - (w / omega_r) ** 2), axis=0)
        # With tau below d R0 - loss, the residual takes no less power than what is left out.
        loss = kind.rows.spread(loss)
        losses.append(loss)
        d = max(d, float(np.max(kind.missing / omega_r**2 + loss) / np.max(kind.static)))
    zeta = np.clip(0.5 * d * omega_r, LEAST_DAMPING, MOST_DAMPING)
    pole = omega_r * complex(-zeta, np.sqrt(1 - zeta**2))
    shapes = []
    for kind, loss in zip(kinds, losses, strict=True):
        jump = 2 * zeta * omega_r * kind.static - omega_r**2 * loss
        jump = np.maximum(jump, kind.missing)
        shape = np.sqrt(jump - 1j * (kind.static * omega_r**2 + jump * pole.real) / pole.imag)
        shapes.append(shape[:, None, None])
    return pole, shapes


def _missing_jumps(
    track: Track, rows: Rows, tables: list[ComplexArray], modes: list[RingModes]
) -> FloatArray:
    """What the residual must jump by at least after an impulse, m/(N s), at all places.

    Less the modes' own motion at once under the wheel that is pushed, and what all other wheels may
    take (Gershgorin): as many as a vehicle has, where they answer most. The two of a wheelset are
    pushed alike or oppositely. At every place and those beside it.
    """
    node, share = rows.places
    x = rows.nodes[node] + share * rows.nodes[1]
    cells_near = int(np.ceil(RIPPLES / track.cell_length - 1e-9))
    missing = np.full(x.size, -np.inf)
    for table, ring in zip(tables, modes, strict=True):
        w, others = at_places(rows, table)[:, 0], np.zeros(x.size)
        own = np.sum(w * w[:, ring.partner], axis=1).real
        two = table[rows.firsts, 0][:, ring.partner]
        for c in range(-cells_near, cells_near + 1):
            J = np.abs(((w * np.exp(1j * ring.mu * c)) @ two.T).real)
            far = np.abs(x[:, None] + c * track.cell_length - rows.nodes) > APART
            others = np.maximum(others, np.max(J * far, axis=1))
        missing = np.maximum(missing, OTHERS * others - own)
    ends = np.concatenate([missing[:1], missing, missing[-1:]])
    most: FloatArray = np.maximum(np.maximum(ends[:-2], ends[2:]), missing)
    return most
