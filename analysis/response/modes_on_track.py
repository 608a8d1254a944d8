"""Eigenmodes of a vehicle on a flexible track: poles of both together."""

from __future__ import annotations

from abc import ABC, abstractmethod
from functools import cached_property

import numpy as np

from railcosim.master.component import FloatArray
from railcosim.master.linear.state_space import ComplexArray
from railcosim.master.progress import Progress, unheard
from railcosim.mechanics.contact.geometry import OF_WHEELSET
from railcosim.mechanics.contact.wheelset import NAMES
from railcosim.mechanics.modal import Met
from railcosim.mechanics.ports import DIMENSIONS, SIDES, Layout
from railcosim.track.decay import check_ring
from railcosim.track.parameters import Track
from railcosim.track.reduced import reduce_track
from railcosim.vehicle.eigenmodes import Oscillation, Oscillations, swings
from railcosim.vehicle.multibody import Multibody
from railcosim.vehicle.on_rails import Contacts, of_wheelsets

SETTLED = 1e-10  # of a pole: it squares its error, so the next would be rounding
MOST_STEPS = 30
STEP = 1e-6  # of a pole, for the derivative: as much of each correction is left to the next
STAGES = 8  # from a track without dynamics to the whole; in one stride modes of four wheelsets meet


def on_track(
    body: Multibody,
    contacts: Contacts,
    track: Track,
    progress: Progress = unheard,
) -> Oscillations:
    """Modes of a vehicle whose rails give way in all directions, the last wheelset at a railseat.

    They begin on the track's static flexibility. Its dynamics are brought in by stages, and each
    mode follows by Newton's method to where vehicle and track swing freely together.

    Parameters
    ----------
    body : Multibody
        The vehicle in space.
    contacts : Contacts
        Of its wheels.
    track : Track
        Parameters.
    progress : callable
        Told what is done and the total.

    Returns
    -------
    Oscillations
        Those of the vehicle. Modes that end in no swinging are left out.
    """
    check_ring(track, float(np.ptp(body.wheelset_x)))
    position = body.wheelset_x - body.wheelset_x[-1] + track.fastening.spacing / 2
    layout = Layout(body.wheelset_x.size, directions=DIMENSIONS["spatial"])
    rails = reduce_track(track, layout.directions).under(layout).at(position)
    both = Together(body, contacts, rails)
    first = swings(body.M, body.C + both.damping, both.held(0.0, 0.0).real)
    found: list[Oscillation] = []
    for k, mode in enumerate(first.modes):
        progress(k, len(first.modes))
        followed = both.followed(mode)
        if followed is not None:
            found.append(followed)
    found.sort(key=lambda mode: mode.undamped)
    return Oscillations(modes=tuple(found), free=first.free)


class Following(ABC):
    """A vehicle on rails whose dynamics are brought in by stages, and modes that follow."""

    body: Multibody

    @abstractmethod
    def stiffness(self, s: complex, dynamic: float) -> ComplexArray:
        """Of everything at a complex frequency, (n, n).

        `dynamic` is the part of the rails' compliance that is as it is at s, the rest is static.
        """

    def followed(self, mode: Oscillation) -> Oscillation | None:
        """What a mode on the static track becomes; None if it only fades away."""
        s, v = mode.pole, mode.shape
        for stage in range(1, STAGES + 1):
            s, v = self._settled(s, v, stage / STAGES)
        return Oscillation.of(s, v, self.body.M) if s.imag > 0 or s.real > 0 else None

    def _settled(self, s: complex, v: ComplexArray, dynamic: float) -> tuple[complex, ComplexArray]:
        """Pole and shape near given ones, by inverse iteration."""
        for _ in range(MOST_STEPS):
            h = STEP * abs(s)
            here, ahead = self.stiffness(s, dynamic), self.stiffness(s + h, dynamic)
            try:
                u = np.linalg.solve(here, (ahead - here) @ v / h)
            except np.linalg.LinAlgError:  # not even rounding is left between s and a pole
                return s, v
            change = complex(np.vdot(v, v) / np.vdot(v, u))
            s -= change
            if abs(change) <= SETTLED * abs(s):
                return s, v  # as it was: of several with one pole each keeps its own shape
            v = (u / np.linalg.norm(u)).astype(complex)
        raise ArithmeticError(
            f"no mode of vehicle and track found near {abs(s) / (2 * np.pi):g} Hz in {MOST_STEPS} "
            "steps; take wheels on their contact springs instead"
        )


class Together(Following):
    """The dynamic stiffness of a vehicle on its track, at any complex frequency.

    Parameters
    ----------
    body, contacts
        See `on_track`.
    rails : Met
        The track where the wheels are.
    """

    def __init__(self, body: Multibody, contacts: Contacts, rails: Met) -> None:
        self.body, self.rails = body, rails
        m, count = len(OF_WHEELSET), body.wheelset_x.size
        directions = rails.body.layout.directions
        at_rails = [NAMES.index(f"{side}.rail_{d.name}") for side in SIDES for d in directions]
        k = len(directions)
        S = of_wheelsets(body)

        def parts(A: FloatArray) -> tuple[FloatArray, ...]:
            """Between vehicle (v) and rails (r, ports: left ones first): vv, vr, rv, rr."""
            own, across = A[:, :m, :m], A[:, :m, at_rails]
            vv = np.einsum("iab,ian,ibm->nm", own, S, S)
            # Ports are ordered by side, wheelset and direction.
            vr = np.einsum("iasd,ian->nsid", across.reshape(count, m, 2, k), S)
            rv = np.einsum("isda,ian->sidn", A[:, at_rails, :m].reshape(count, 2, k, m), S)
            rr = np.zeros((2, count, k, 2, count, k))
            for i in range(count):
                rr[:, i, :, :, i] = A[i][np.ix_(at_rails, at_rails)].reshape(2, k, 2, k)
            n = len(vv)
            return vv, vr.reshape(n, -1), rv.reshape(-1, n), rr.reshape(2 * count * k, -1)

        self.K, self.C = parts(contacts.K), parts(contacts.C)
        self.damping = self.C[0]

    @cached_property
    def static(self) -> FloatArray:
        """Compliance of the rails at rest."""
        return self.rails.static_compliance()

    def held(self, s: complex, dynamic: float) -> ComplexArray:
        """Stiffness that holds the vehicle: its own, its contacts' and the rails' behind them.

        `dynamic` is the part of the rails' compliance that is as it is at s, the rest is static.
        """
        (vv, vr, rv, rr), (_, c_vr, c_rv, c_rr) = self.K, self.C
        compliance = self.static + dynamic * (self.compliance(s) - self.static)
        rail = np.linalg.inv(compliance) + rr + s * c_rr
        through = np.linalg.solve(rail, rv + s * c_rv)
        return np.asarray(self.body.K + vv - (vr + s * c_vr) @ through, complex)

    def compliance(self, s: complex) -> ComplexArray:
        """Of the rails, (ports, ports): sums over poles and their conjugates."""
        poles = self.rails.body.poles
        one, other = 1 / (s - poles), (1 / (s - poles.conj())).conj()
        real, imaginary = (
            self.rails.compliance(weight, 0.0) for weight in ((one + other) / 2, (one - other) / 2j)
        )
        whole: ComplexArray = real.astype(complex) + 1j * imaginary
        return whole

    def stiffness(self, s: complex, dynamic: float) -> ComplexArray:
        """See `Following`."""
        M, C = self.body.M, self.body.C + self.damping
        return s * s * M + s * C + self.held(s, dynamic)
