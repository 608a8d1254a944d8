"""The monolithic system at rest under its weight, or rolling on as steadily as if at rest."""

from __future__ import annotations

import numpy as np
from scipy import sparse
from scipy.sparse.linalg import splu

from railcosim.mechanics.arrays import FloatArray
from railcosim.mechanics.solve import ContactError

from .contacts import Contacts
from .monolithic import Monolithic
from .state import State, apart, together

DEEP = 1e-4  # m, where Newton's method starts: wheels that press
MOST_ITERATIONS = 50
SETTLED = 1e-10  # of the largest motion: above the rounding of contacts beside soft suspensions
SHIFT = 1e-2  # 1/s2, a thousandth of the softest mode's: leaves what nothing holds where it is


def equilibrium(
    mono: Monolithic, contacts: Contacts, position: FloatArray, irregularity: FloatArray
) -> State:
    """The system as it rests, by Newton's method from a stiff start.

    What no spring holds turns at a steady rate instead: the spins of axles that roll.

    Parameters
    ----------
    mono : Monolithic
        The system.
    contacts : Contacts
        Between wheels and rails.
    position : array, shape (n_wheelsets,)
        Of the wheelsets, m.
    irregularity : array
        Under the wheels, m.

    Raises
    ------
    ContactError
        If Newton's method does not settle.
    """
    rows, law = contacts.rows(mono, position), contacts.law
    turning = sparse.diags_array((np.abs(mono.K).sum(axis=0) == 0.0).astype(float))
    still = sparse.eye_array(*turning.shape) - turning
    parts = [rows @ still, rows @ turning][: contacts.orders]
    lowered = contacts.lowered(mono) @ np.ravel(irregularity)
    weight = mono.wheels.T @ mono.load
    held = mono.K + mono.C @ turning + SHIFT * mono.M
    x, start = np.zeros(mono.K.shape[0]), np.zeros(mono.K.shape[0])
    start[mono.body.wheelsets] = DEEP
    shape = (-1, law.directions * contacts.orders)
    motion = together([part @ start for part in parts], law.directions).reshape(shape)
    for _ in range(MOST_ITERATIONS):
        # Linearised law: force + by (motion of x - motion).
        by = [
            sparse.block_diag(list(one), format="csr")
            for one in np.split(law.tangent(motion), contacts.orders, axis=-1)
        ]
        there = apart(motion, contacts.orders)
        there[0] = there[0] + lowered
        K = held + rows.T @ sum(T @ part for T, part in zip(by, parts, strict=True))
        known = law.force(motion).ravel() - sum(T @ m for T, m in zip(by, there, strict=True))
        x = splu(K.tocsc()).solve(weight + SHIFT * (mono.M @ x) - rows.T @ known)
        found = [part @ x for part in parts]
        found[0] = found[0] - lowered
        change = together(found, law.directions).reshape(shape) - motion
        motion = motion + change
        if np.abs(change).max() <= SETTLED * np.abs(motion).max():
            return State(
                x=still @ x, v=turning @ x, a=np.zeros_like(x), motion=motion,
                force=contacts.pushes(mono) @ law.force(motion).ravel(),
            )  # fmt: skip
    raise ContactError("the system found no rest: a wheel may hang, or nothing holds it up")
