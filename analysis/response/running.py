"""Poles of a vehicle that rolls, from a linear model of it and the compliance of the rails."""

from __future__ import annotations

from collections.abc import Callable
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
from railcosim.vehicle.hunting import GROWS, Critical, Poles, critical_speed, greatest

from .rolling import LinearContacts

SPEEDS = np.arange(5.0, 1001.0, 2.5) / 3.6
"""Where growth is looked for, m/s: a mode that grew between two of them only would be missed."""
BEYOND = 1.5  # of the critical speed: how far the poles are followed
FIRST = 3.0  # Hz: where hunting is looked for if there is none on rigid rails
NEAR = np.array([0.8, 0.9, 1.0, 1.1, 1.2])  # of a speed that is almost the critical one
ALIKE = 1e-3  # of the frequency: a tenth of it changes the speed by 1e-4
MOST_ROUNDS = 8
LEAST = 0.1  # Hz: below, a track gives way as it does at rest
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


@dataclass(frozen=True)
class OnRails:
    """The same on rails that give way as they do at the frequency of hunting.

    Attributes
    ----------
    rolling : Rolling
        Vehicle and contacts.
    rails : callable or None
        Compliance of the rails under the wheels at a frequency in Hz, in the order of the ports.
        None: rails that do not move.
    """

    rolling: Rolling
    rails: Callable[[float], ComplexArray] | None

    def poles(self, frequency: float | None) -> Poles:
        """By the speed, on rails as they give way at a frequency, Hz; None: rigid."""
        if self.rails is None or frequency is None:
            return lambda speed: self.rolling.poles(speed, None)
        compliance = self.rails(frequency)
        return lambda speed: self.rolling.poles(speed, compliance)

    def critical(self) -> Critical:
        """Where growth begins.

        Raises
        ------
        ArithmeticError
            If no frequency is found at which vehicle and track hunt.
        """
        found = critical_speed(self.poles(None), SPEEDS)
        if self.rails is None:
            return found
        frequency = found.frequency if found.frequency > 0 else FIRST
        speeds = SPEEDS[BEYOND * found.speed > SPEEDS]
        for _ in range(MOST_ROUNDS):
            poles = self.poles(frequency)
            found = critical_speed(poles, speeds)
            if not found.speed > 0:  # then it is not where it was looked for
                found = critical_speed(poles, SPEEDS)
            if not found.speed > 0 or abs(found.frequency - frequency) <= ALIKE * frequency:
                return found
            # The track at another frequency is almost the same.
            frequency, speeds = found.frequency, found.speed * NEAR
        raise ArithmeticError(
            "the frequency at which the vehicle hunts does not settle in "
            f"{MOST_ROUNDS} rounds, last {found.frequency:g} Hz at {3.6 * found.speed:g} km/h; see "
            "what it does on rigid rails"
        )

    def growing(self, speed: float) -> complex | None:
        """The pole (rad/s) that grows fastest at a speed in m/s; None if none does."""
        pole = greatest(self.poles(FIRST)(speed))
        for _ in range(MOST_ROUNDS):
            frequency = abs(pole.imag) / (2 * np.pi)
            if self.rails is None or frequency < LEAST:
                break
            before, pole = pole, greatest(self.poles(frequency)(speed))
            if abs(pole.imag - before.imag) <= ALIKE * abs(before.imag):
                break
        return pole if pole.real > GROWS else None
