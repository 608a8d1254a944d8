"""The law of rolling wheels on rails: normal forces, creep and flanges, with their tangents."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Generic

import numpy as np

from ..arrays import ComplexArray, FloatArray
from .creep import LINEAR, CreepLaw
from .geometry import COORDINATES, Geometry, Touch
from .numbers import Numbers, derivatives, positive

_UNIT = dict(zip(COORDINATES, np.eye(len(COORDINATES)), strict=True))
_MOVED = np.stack([_UNIT[name] for name in ("y", "z", "roll", "yaw", "rail_roll")])
"""Motions that forces depend on, as coordinates: of y and z, the wheelset's."""
_APART = _MOVED.copy()
"""The same by the coordinates: y and z are those of the wheelset less those of the rail."""
_APART[:2] -= _UNIT["rail_y"], _UNIT["rail_z"]
_ROLL, _YAW = COORDINATES.index("roll"), COORDINATES.index("yaw")


@dataclass(frozen=True, kw_only=True)
class Flange:
    """Flanges as stiff stops, without friction.

    Attributes
    ----------
    stiffness : float
        Across, N/m.
    clearance : float
        How far a wheel may go outwards from where it was designed to stand, m.
    depth : float
        Of the point of contact below the rail's datum, m.
    """

    stiffness: float
    clearance: float
    depth: float = 0.014

    def force(self, q: Numbers, side: FloatArray, radius: float) -> Numbers:
        """Generalised forces, shape (..., n, 8), N and N m."""
        arm = radius + self.depth
        none, one = np.zeros_like(q[..., 0]), side * np.ones_like(q[..., 0])
        way = np.stack([one, none, -arm * one, none, none, -one, none, self.depth * one], axis=-1)
        pressed = positive((way * q).sum(axis=-1) - self.clearance)
        found: Numbers = -(self.stiffness * pressed)[..., None] * way
        return found


@dataclass(frozen=True, kw_only=True)
class Slip(Generic[Numbers]):
    """How wheels slide and turn on their rails: rates of slip = J v + speed x rolling.

    Attributes
    ----------
    J : array, shape (..., n, 3, 8)
        Along, across in the plane of contact, and about the normal, per rate of a coordinate.
    rolling : array, shape (..., n, 3)
        Of a wheelset that rolls on at unit speed.
    """

    J: Numbers
    rolling: Numbers


def ahead(touch: Touch[Numbers], yaw: Numbers) -> Numbers:
    """How far in front of its wheelset's middle a contact lies, m; see `Cone.yaw_sinking`."""
    found: Numbers = -(touch.y - touch.radius * np.tan(touch.slope)) * yaw
    return found


def slip(touch: Touch[Numbers], q: Numbers, radius: float) -> Slip[Numbers]:
    """Kinematics of contact points, of the material of wheel and rail.

    The axle turns by -V/r0 beyond its spin, about (-yaw, cos roll, sin roll).

    References
    ----------
    Wickens, A. H. (2003), Fundamentals of Rail Vehicle Dynamics, Swets & Zeitlinger, chapter 2.
    """
    roll, yaw = q[..., 2], q[..., 4]
    slope, r, y = touch.slope, touch.radius, touch.y
    alpha = slope - roll  # of the normal in the track's frame
    c, s = np.cos(alpha), np.sin(alpha)
    x = ahead(touch, yaw)
    out = np.cos(roll) * y - np.sin(roll) * r  # across from the wheelset's centre, in the track
    none = np.zeros_like(yaw)
    turned = yaw * r / np.cos(slope)
    above = np.sin(slope) * y + np.cos(slope) * r  # the centre from the plane of contact
    below = c * touch.rail_z + s * touch.rail_y
    J = [
        [none, none, none, r, -out, none, none, none],
        [c, -s, -above, turned, c * x, -c, s, below],
        [none, none, none, np.sin(slope), c, none, none, none],
    ]
    rolling = [1 - r / radius, -turned / radius, -np.sin(slope) / radius]
    return Slip(
        J=np.stack([np.stack(row, axis=-1) for row in J], axis=-2),
        rolling=np.stack(rolling, axis=-1),
    )


@dataclass(frozen=True, kw_only=True)
class RollingContact:
    """Wheels that roll on rails: forces of all coordinates that they touch.

    Attributes
    ----------
    geometry : Geometry
        Of wheel and rail.
    side : array, shape (n,)
        LEFT or RIGHT of every contact.
    speed : float
        Of the vehicle, m/s, above 0; where a method is given that of the moment, shape (..., n), it
        is that.
    creep : CreepLaw
        Of the tangential forces.
    flange : Flange or None
        None: none.
    axle_inertia : float or array, shape (n,)
        Of the wheelset about its axle, which turns by -speed/r0, kg m2: a gyroscope, whose moments
        are felt by halves at its two wheels, closed or not. 0: none, or the wheelset's own model
        has them.

    Raises
    ------
    ValueError
        If the speed is not above 0: creepages are velocities over the speed.
    """

    geometry: Geometry
    side: FloatArray
    speed: float
    creep: CreepLaw = LINEAR
    flange: Flange | None = None
    axle_inertia: float | FloatArray = 0.0

    def __post_init__(self) -> None:
        if not (np.isfinite(self.speed) and self.speed > 0):
            raise ValueError(f"speed {self.speed:g} m/s: must be above 0 for creep")

    @property
    def directions(self) -> int:
        """Coordinates of a contact, `COORDINATES`."""
        return len(COORDINATES)

    def normal_force(self, q: Numbers) -> Numbers:
        """Along the normals, N, shape (..., n); nothing where wheel and rail part."""
        return self._normal(self.geometry.touch(q, self.side))

    def force(self, q: Numbers, v: Numbers, speed: FloatArray | None = None) -> Numbers:
        """Generalised forces on wheelsets and rails.

        Parameters
        ----------
        q, v : array, shape (..., n, 8)
            Coordinates and their rates, m, rad; see `COORDINATES`. An irregularity of the rail
            belongs to q alone: it is no velocity of the rail's material.
        speed : array, optional
            Of the moment, m/s.

        Returns
        -------
        array, shape (..., n, 8)
            N and N m: with a coordinate's rate they give the power into its body.
        """
        V = self._at(speed)
        found: Numbers = self._total(q, *self._parts(q, v, V)) + self.turning(v, V)
        return found

    def creep_forces(self, q: Numbers, v: Numbers) -> tuple[Numbers, Numbers]:
        """Creepages, and forces on the wheels in the planes of contact, both (..., n, 3)."""
        V = self._at(None)
        _, _, slides, tangential = self._parts(q, v, V)
        return _creepage(slides, v, V), tangential

    def at_datum(self, q: Numbers, v: Numbers) -> Numbers:
        """What the wheels do to the rails, at the rails' data.

        Returns
        -------
        array, shape (..., n, 5)
            Forces along x, y and z (N), moments about x and z (N m). Those about y and those of
            second order of the moment about z are left out: a rail does not feel them.
        """
        touch, normal, slides, tangential = self._parts(q, v, self._at(None))
        down = self._total(q, touch, normal, slides, tangential)[..., 5:]
        alpha = touch.slope - q[..., 2]
        on_rail = -tangential
        out = np.cos(alpha) * on_rail[..., 1] + normal * np.sin(alpha)
        yawing = (
            ahead(touch, q[..., 4]) * out
            - touch.rail_y * on_rail[..., 0]
            + np.cos(alpha) * on_rail[..., 2]
        )
        found: Numbers = np.concatenate([on_rail[..., :1], down, yawing[..., None]], axis=-1)
        return found

    def tangents(
        self, q: FloatArray, v: FloatArray, speed: FloatArray | None = None
    ) -> tuple[FloatArray, FloatArray]:
        """Derivatives of the forces by coordinates and by rates, each (..., n, 8, 8).

        Not one for each of 16 motions: a wheelset that moves across or down is a rail that moves
        the other way, nothing depends on the spin, and rates make creepages, of which there are
        three.
        """
        k, V = len(_MOVED), self._at(speed)
        rates: ComplexArray = v.astype(np.complex128)

        def total(x: ComplexArray) -> ComplexArray:
            at: ComplexArray = q + x[..., :k] @ _MOVED
            creepage: ComplexArray = x[..., k:]
            return self._total(at, *self._parts(at, rates, V, creepage))

        by = derivatives(total, np.zeros((*q.shape[:-1], k + 3)))
        J = slip(self.geometry.touch(q, self.side), q, self.geometry.radius).J
        unit = np.eye(len(COORDINATES)).reshape(-1, *(1 for _ in V.shape), len(COORDINATES))
        return by[..., :k] @ _APART, by[..., k:] @ J / V[..., None, None] + np.moveaxis(
            self.turning(unit, V), 0, -1
        )

    def turning(self, v: Numbers, speed: FloatArray) -> Numbers:
        """Moments of the axle by its rates: a yaw turns its momentum forward, and a roll up."""
        momentum = 0.5 * speed * np.divide(self.axle_inertia, self.geometry.radius)
        found = np.zeros_like(v + momentum[..., None])
        found[..., _ROLL], found[..., _YAW] = -momentum * v[..., _YAW], momentum * v[..., _ROLL]
        return found

    def _at(self, speed: FloatArray | None) -> FloatArray:
        """The speed that counts, of every contact."""
        return np.full(self.side.shape, self.speed) if speed is None else speed

    def _parts(
        self, q: Numbers, v: Numbers, speed: FloatArray, more: Numbers | float = 0.0
    ) -> tuple[Touch[Numbers], Numbers, Slip[Numbers], Numbers]:
        """Contacts, normal forces, what slides, and forces in the planes of contact.

        Creepages are `more` than those of q and v.
        """
        touch = self.geometry.touch(q, self.side)
        normal = self._normal(touch)
        slides = slip(touch, q, self.geometry.radius)
        creepage: Numbers = _creepage(slides, v, speed) + more
        tangential: Numbers = self.creep.force(touch.patch, normal, creepage)
        return touch, normal, slides, tangential

    def _total(
        self,
        q: Numbers,
        touch: Touch[Numbers],
        normal: Numbers,
        slides: Slip[Numbers],
        tangential: Numbers,
    ) -> Numbers:
        """Generalised forces of all parts; see `force`."""
        total = np.einsum("...ij,...i->...j", slides.J, tangential)
        total = total - normal[..., None] * touch.gradient
        if self.flange is not None:
            total = total + self.flange.force(q, self.side, self.geometry.radius)
        found: Numbers = total
        return found

    def _normal(self, touch: Touch[Numbers]) -> Numbers:
        closed = positive(touch.compression)
        found: Numbers = touch.patch.ellipse.C * closed * np.sqrt(closed)
        return found


def _creepage(slides: Slip[Numbers], v: Numbers, speed: FloatArray) -> Numbers:
    rates = np.einsum("...ij,...j->...i", slides.J, v)
    found: Numbers = rates / speed[..., None] + slides.rolling
    return found


@dataclass(frozen=True)
class OfMotion:
    """A rolling contact as a `ContactLaw` of m = 16 motions: coordinates, then their rates.

    What `solve_compression` solves: with a compliance that says by how much forces change both,
    negative where forces drive what they act on.

    Attributes
    ----------
    contact : RollingContact
        The law.
    """

    contact: RollingContact

    @property
    def directions(self) -> int:
        """Of the forces."""
        return self.contact.directions

    def force(self, motion: FloatArray) -> FloatArray:
        """Generalised forces, shape (n, 8), of motions of shape (n, 16)."""
        q, v = np.split(motion, 2, axis=-1)
        return self.contact.force(q, v)

    def tangent(self, motion: FloatArray) -> FloatArray:
        """Their derivatives, shape (n, 8, 16)."""
        q, v = np.split(motion, 2, axis=-1)
        return np.concatenate(self.contact.tangents(q, v), axis=-1)
