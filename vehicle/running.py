"""A vehicle that runs on rigid rails: nonlinear equations of motion, of many runs at once.

Bodies and springs are linear but for lateral stops with a gap; contacts are the rolling law of the
vehicle's ``[rolling]``. Creepages are velocities over the speed, so runs at different speeds have
one law, at 1 m/s, and are stepped together.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from railcosim.mechanics.arrays import ComplexArray, FloatArray
from railcosim.mechanics.contact.geometry import COORDINATES, LEFT, OF_WHEELSET, RIGHT
from railcosim.mechanics.contact.numbers import Numbers, derivatives, positive
from railcosim.mechanics.contact.rolling import RollingContact
from railcosim.mechanics.contact.wheelset import at_rest

from .assembly import assemble
from .eigenmodes import poles_of
from .multibody import SPATIAL, Multibody, build_multibody
from .on_rails import gyroscopes, of_wheelsets
from .parameters import Vehicle
from .rolling import rolling_law
from .train import Train, train_of

Matrices: TypeAlias = tuple[FloatArray, FloatArray, FloatArray]

MOST_ITERATIONS = 30  # Newton takes four
SETTLED = 1e-10  # m/s2 and rad/s2: ten digits below gravity
STABLE = (
    2.0  # of a step times the fastest pole, of 2.8 that Runge-Kutta bears: contacts get stiffer
)
LONGEST = 2e-3  # s: a hundredth of a period of hunting at 5 Hz
SHORTEST = 2e-5  # s


class Equations(ABC):
    """Equations of motion of what hunts, by its speed.

    A state is the coordinates, then their rates, the last axis of 2 n numbers.
    """

    @property
    @abstractmethod
    def across(self) -> NDArray[np.intp]:
        """Places of the wheelsets' lateral coordinates."""

    @property
    @abstractmethod
    def rest(self) -> FloatArray:
        """Straight running at 1 m/s, shape (2 n,); at another speed the rates are as much more."""

    @abstractmethod
    def rates(self, state: Numbers, speed: FloatArray) -> Numbers:
        """How states change.

        Parameters
        ----------
        state : array, shape (..., 2 n)
            m, rad and their rates.
        speed : array, shape (...)
            m/s, above 0.
        """

    @abstractmethod
    def matrices(self, speed: float) -> Matrices:
        """M, C and K about straight running."""

    def poles(self, speed: float) -> ComplexArray:
        """Of these, rad/s."""
        return poles_of(*self.matrices(speed))[0]

    def step_of(self, speeds: FloatArray) -> float:
        """A step (s) that Runge-Kutta's method bears at speeds.

        Raises
        ------
        ArithmeticError
            If it were too short to be run: at a very low speed creep is almost rigid.
        """
        fastest = 0.0
        for speed in (float(speeds.min()), float(speeds.max())):
            fastest = max(fastest, float(np.abs(self.poles(speed)).max()))
        step = min(LONGEST, STABLE / fastest)
        if step < SHORTEST:
            raise ArithmeticError(
                f"at {speeds.min():.3g} m/s creep needs steps of {step:.2g} s: begin at a higher "
                "speed"
            )
        return step

    def run(
        self,
        state: FloatArray,
        speed: FloatArray,
        step: float,
        count: int,
        see: Callable[[FloatArray], None],
    ) -> FloatArray:
        """Go on from states, shape (m, 2 n), at speeds (m,), by Runge and Kutta's method.

        Parameters
        ----------
        step : float
            s.
        count : int
            Of steps.
        see : callable
            Is shown the states after every step.
        """
        for _ in range(count):
            k1 = self.rates(state, speed)
            k2 = self.rates(state + step / 2 * k1, speed)
            k3 = self.rates(state + step / 2 * k2, speed)
            k4 = self.rates(state + step * k3, speed)
            state = state + step / 6 * (k1 + 2 * (k2 + k3) + k4)
            see(state)
        return state


@dataclass(frozen=True, kw_only=True)
class Running(Equations):
    """A vehicle on rigid rails.

    Attributes
    ----------
    body : Multibody
        Bodies and springs, in space.
    laws : tuple of (array, RollingContact)
        Contacts, left and right of each wheelset in turn, and their law at 1 m/s.
    stops : array, shape (m, n)
        Stretch of lateral stops with a gap by the coordinates.
    stop_stiffness, stop_gap : array, shape (m,)
        N/m and m.
    """

    body: Multibody
    laws: tuple[tuple[NDArray[np.intp], RollingContact], ...]
    stops: FloatArray
    stop_stiffness: FloatArray
    stop_gap: FloatArray

    @property
    def size(self) -> int:
        """n, coordinates."""
        return len(self.body.coordinates)

    @cached_property
    def across(self) -> NDArray[np.intp]:
        """See `Equations`."""
        return np.array([self.body.at(axle, "y") for axle in self.body.axles])

    @cached_property
    def contacts(self) -> FloatArray:
        """Coordinates of contacts by those of the vehicle, shape (contacts, 8, n)."""
        own = of_wheelsets(self.body)
        T = np.zeros((2 * len(own), len(COORDINATES), self.size))
        T[:, : len(OF_WHEELSET)] = np.repeat(own, 2, axis=0)
        return T

    @cached_property
    def weights(self) -> FloatArray:
        """What presses the wheelsets down where springs are as they were measured from, N."""
        force = np.zeros(self.size)
        force[self.body.wheelsets] = 2 * self.body.wheel_load
        return force

    @cached_property
    def turning(self) -> FloatArray:
        """Gyroscopic matrix of turning axles at 1 m/s."""
        G = gyroscopes(self.body, self.body.wheels)[:, : len(OF_WHEELSET), : len(OF_WHEELSET)]
        own = of_wheelsets(self.body)
        whole: FloatArray = np.einsum("ian,iab,ibm->nm", own, G, own)
        return whole

    def rates(self, state: Numbers, speed: FloatArray) -> Numbers:
        """See `Equations`."""
        q, v = np.split(state, 2, axis=-1)
        per_metre = v / speed[..., None]
        force = self.weights - q @ self.body.K.T - v @ self.body.C.T
        force = force - speed[..., None] * (v @ self.turning.T)
        at, moving = (np.einsum("cij,...j->...ci", self.contacts, x) for x in (q, per_metre))
        for which, law in self.laws:
            pressed = law.force(at[..., which, :], moving[..., which, :])
            force = force + np.einsum("cij,...ci->...j", self.contacts[which], pressed)
        force = force - self._stops(q)
        found: Numbers = np.concatenate([v, force / np.diag(self.body.M)], axis=-1)
        return found

    def _stops(self, q: Numbers) -> Numbers:
        stretch = q @ self.stops.T
        way = np.sign(stretch.real)
        pressed = way * self.stop_stiffness * positive(way * stretch - self.stop_gap)
        found: Numbers = pressed @ self.stops
        return found

    @cached_property
    def rest(self) -> FloatArray:
        """See `Equations`.

        Raises
        ------
        ArithmeticError
            If none is found.
        """
        sunk = np.zeros(self.body.wheelset_x.size)
        for which, law in self.laws:
            one = RollingContact(
                geometry=law.geometry, side=np.array([LEFT, RIGHT]), speed=1.0, creep=law.creep
            )
            for i in set((which // 2).tolist()):
                sunk[i] = at_rest(one, float(self.body.wheel_load[i]))[:, 1].mean()
        state = np.concatenate([self.body.following @ sunk, np.zeros(self.size)])
        speed = np.array(1.0)
        for _ in range(MOST_ITERATIONS):
            missing = self.rates(state, speed)[self.size :]
            if np.abs(missing).max() < SETTLED:
                return state
            by = self._tangent(state)[self.size :]
            # Coordinates but the spins, which nothing holds, and the rates of these alone.
            spins = np.array([name.endswith(".spin") for name in self.body.coordinates])
            free = np.concatenate([~spins, spins])
            state[free] -= np.linalg.solve(by[:, free], missing)
        raise ArithmeticError("the vehicle finds no rest on rigid rails: check [rolling] and loads")

    def _tangent(self, state: FloatArray) -> FloatArray:
        """Derivatives of the rates at 1 m/s by the state."""
        return derivatives(lambda x: self.rates(x, np.ones(x.shape[:-1])), state)

    @cached_property
    def _linear(self) -> FloatArray:
        return self._tangent(self.rest)[self.size :] * np.diag(self.body.M)[:, None]

    def matrices(self, speed: float) -> Matrices:
        """See `Equations`."""
        n, body = self.size, self.body
        K = -self._linear[:, :n]
        creep = -self._linear[:, n:] - body.C - self.turning
        return body.M, body.C + speed * self.turning + creep / speed, K


def running(stock: Vehicle | Train, folder: Path | None = None) -> Running:
    """A vehicle or a train on rigid rails, its wheels rolling as its ``[rolling]`` says.

    Parameters
    ----------
    stock : Vehicle or Train
        Parameters.
    folder : Path, optional
        Of its file: profiles are in it, or below.

    Raises
    ------
    ParameterError
        If a profile cannot be used, or a body is not held.
    """
    train = train_of(stock)
    body = build_multibody(train, SPATIAL)
    parts = train.parts()
    gaps = [spring for spring in parts.springs if spring.gap > 0 and spring.acts]
    stretch = np.zeros((0, len(body.coordinates)))
    if gaps:
        stretch = assemble(parts.bodies, gaps)[4]
    kinds: dict[object, list[int]] = {}
    owner = [one.vehicle for one in train.vehicles for _ in range(one.wheelsets)]
    for i, (vehicle, cone) in enumerate(zip(owner, body.wheels, strict=True)):
        kinds.setdefault((vehicle.rolling, vehicle.contact, cone.radius), []).append(i)
    laws = []
    for wheelsets in kinds.values():
        first = wheelsets[0]
        law = rolling_law(
            owner[first].rolling, owner[first].contact, radius=body.wheels[first].radius,
            side=np.tile([LEFT, RIGHT], len(wheelsets)), speed=1.0, folder=folder,
        )  # fmt: skip
        laws.append((np.array([2 * i + side for i in wheelsets for side in (0, 1)]), law))
    return Running(
        body=body,
        laws=tuple(laws),
        stops=stretch,
        stop_stiffness=np.array([spring.k for spring in gaps]),
        stop_gap=np.array([spring.gap for spring in gaps]),
    )
