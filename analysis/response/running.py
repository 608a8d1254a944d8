"""Poles of a vehicle that rolls, from a linear model of it and the compliance of the rails."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.linalg import block_diag, eig

from railcosim.master.component import FloatArray
from railcosim.master.connections import CouplingError
from railcosim.master.linear.realisation import ComplexArray
from railcosim.master.linear.state_space import StateSpace
from railcosim.mechanics.contact.at_ports import PORTS
from railcosim.mechanics.ports import FORCE, OF_WHEELS, WHEEL, Layout
from railcosim.vehicle.eigenmodes import FASTEST, REAL

from .rolling import LinearContacts

AT_ONCE = 1e-9
"""Of a velocity by a force over the greatest: what is rounding and no jump."""


@dataclass(frozen=True)
class Rolling:
    """A vehicle on its contacts, at any speed.

    Attributes
    ----------
    vehicle : StateSpace
        From forces at the wheels in five directions to their motions.
    contacts : LinearContacts
        Of its wheels.

    Raises
    ------
    CouplingError
        If the vehicle is not one in space, or its wheels jump under a force.
    """

    vehicle: StateSpace
    contacts: LinearContacts

    @cached_property
    def free(self) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
        """A, B, and the wheels' motions and velocities by the states."""
        layout = Layout(len(self.contacts.turning), directions=OF_WHEELS["spatial"])
        inputs = [v.name for v in self.vehicle.inputs]
        outputs = [v.name for v in self.vehicle.outputs]
        wanted = [(FORCE, inputs), (WHEEL.motion, outputs)]
        for quantity, known in wanted:
            missing = [name for name in layout.names(quantity) if name not in known]
            if missing:
                raise CouplingError(
                    f"{self.vehicle.name}: has no {missing[0]}; rolling takes a vehicle in space"
                )
        columns = [inputs.index(name) for name in layout.names(FORCE)]
        rows = [outputs.index(name) for name in layout.names(WHEEL.motion)]
        A, B = self.vehicle.A.toarray(), self.vehicle.B[:, columns]
        C = self.vehicle.C[rows]
        rates, jump = C @ A, C @ B
        size = np.abs(rates).max(axis=1)[:, None] * np.abs(B).max(axis=0)
        if self.vehicle.D[rows].any() or (np.abs(jump) > AT_ONCE * size).any():
            raise CouplingError(
                f"{self.vehicle.name}: a wheel moves at once under a force; its mass is missing"
            )
        return A, B, C, rates

    def poles(self, speed: float, compliance: ComplexArray | None) -> ComplexArray:
        """All poles at a speed, rad/s, real ones exactly so.

        Parameters
        ----------
        speed : float
            m/s.
        compliance : array, shape (rail ports, rail ports), or None
            Of rails without mass but for what it knows of, in the order of their ports; at one
            frequency, so of the poles only those that swing at it, neither growing nor decaying,
            are vehicle's and track's. None: rigid rails.
        """
        A, B, C, rates = self.free
        running = self.contacts.at(speed)
        m = len(OF_WHEELS["spatial"])
        one, other = slice(None, m), slice(m, len(PORTS))
        K, D = running.K, running.C + running.G
        (K_ww, K_wr, K_rw, K_rr), (D_ww, D_wr, D_rw, D_rr) = (
            [block_diag(*X[:, a, b]) for a in (one, other) for b in (one, other)] for X in (K, D)
        )
        held = A + B @ (K_ww @ C + D_ww @ rates)
        if compliance is None:
            poles, _ = np.linalg.eig(held)
        else:
            n, k = len(A), len(K_rr)
            rails = np.linalg.inv(compliance) - K_rr
            # x' = held x + B (K_wr q + D_wr q'), and q moves by forces on rails as their compliance
            # says. Rails are stiffer than suspensions: brought to one size, for rounding.
            size = 1 / np.sqrt(np.abs(np.diag(rails)))
            right = np.zeros((n + k, n + k), complex)
            right[:n, :n], right[:n, n:] = held, B @ K_wr * size
            right[n:, :n] = -size[:, None] * (K_rw @ C + D_rw @ rates)
            right[n:, n:] = size[:, None] * rails * size
            left = np.eye(n + k)
            left[:n, n:] = -B @ D_wr * size
            left[n:, n:] = size[:, None] * D_rr * size
            poles, _ = eig(right, left)
            poles = poles[np.isfinite(poles) & (np.abs(poles) < FASTEST)]
        return np.where(np.abs(poles.imag) <= REAL * np.abs(poles), poles.real, poles).astype(
            complex
        )
