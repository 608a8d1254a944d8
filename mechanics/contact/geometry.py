"""Where a wheel touches a rail, and how they press: a cone on the head's circle.

x forward, y to the right, z down, one frame for both rails. A contact has eight coordinates: five
of its wheelset and three of its rail. The rail's are those of its datum, the point of the head that
the wheel touches where everything stands as it was designed.

Frictionless contact forces are -N times the gradient of the compression in these coordinates, so
whatever is left out of the geometry, they can neither give nor take energy.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, Generic, Protocol

import numpy as np

from ..arrays import FloatArray
from .creep import Patch
from .numbers import Numbers

OF_WHEELSET = ("y", "z", "roll", "spin", "yaw")
"""The spin is what an axle turns beyond its rolling."""
OF_RAIL = ("y", "z", "roll")
COORDINATES = (*OF_WHEELSET, *(f"rail_{name}" for name in OF_RAIL))
LEFT, RIGHT = -1.0, 1.0
"""Sides, by the sign of y."""


@dataclass(frozen=True, kw_only=True)
class Touch(Generic[Numbers]):
    """Contacts as they are, each array of shape (..., n).

    Attributes
    ----------
    compression : array
        By how much the undeformed bodies overlap along the normal, m; negative where apart.
    gradient : array, shape (..., n, 8)
        Its derivatives by the coordinates.
    slope : array
        Angle of the normal, from straight down to the right, as the wheelset sees it, rad. The
        normal goes from wheel into rail: positive under a right wheel, negative under a left one.
    y, radius : array
        The contact from the wheelset's centre along the axle, and from the axle: the rolling
        radius, m.
    rail_y, rail_z : array
        The contact from the rail's datum, m.
    patch : Patch
        Curvatures there, and what follows from them.
    """

    compression: Numbers
    gradient: Numbers
    slope: Numbers
    y: Numbers
    radius: Numbers
    rail_y: Numbers
    rail_z: Numbers
    patch: Patch


class Geometry(Protocol):
    """What surfaces meet: how they stand to each other, whatever the wheelset's spin."""

    @property
    def radius(self) -> float:
        """r0, the rolling radius where everything stands as it was designed, m."""

    def touch(self, q: Numbers, side: FloatArray) -> Touch[Numbers]:
        """Contacts of coordinates q, shape (..., n, 8), on given sides, shape (n,)."""


@dataclass(frozen=True, kw_only=True)
class Conical:
    """A conical wheel on a rail head that is a circle across.

    The rail is inclined as the cone is, so the datum is in the middle of its head. The contact
    follows the circle when the rail rolls.

    Attributes
    ----------
    radius : float
        r0, m. Of this and of the others there may be one for every contact, shape (n,).
    half_distance : float
        b, of the contacts from the wheelset's middle, m.
    conicity : float
        lambda, the tangent of the cone's angle.
    head_radius : float
        R of the rail head across, m.
    """

    radius: float
    half_distance: float
    conicity: float
    head_radius: float

    @property
    def angle(self) -> float:
        """Of the cone, rad."""
        angle: float = np.arctan(self.conicity)
        return angle

    @property
    def patch(self) -> Patch:
        """The same wherever they touch."""
        raise NotImplementedError

    def touch(self, q: Numbers, side: FloatArray) -> Touch[Numbers]:
        """See `Geometry`."""
        pose = relative_pose(q, side * self.half_distance, self.radius)
        slope = side * self.angle
        # The wheel is a line through its reference point, seen by the rail; its normal:
        tilt = slope - pose.roll
        n_y, n_z = np.sin(tilt), np.cos(tilt)
        # From there to the circle's centre, along the line; and what is less than R to the line.
        R = self.head_radius
        along = R * np.sin(pose.roll) - (pose.y * n_z - pose.z * n_y)
        overlap = 2 * R * np.sin(pose.roll / 2) ** 2 + pose.y * n_y + pose.z * n_z
        yaw = q[..., 4]
        sinking = self.yaw_sinking
        return Touch(
            compression=overlap - sinking * yaw**2 / 2,
            gradient=pose.gradient(n_y, n_z, along, -sinking * yaw),
            slope=slope + np.zeros_like(yaw),
            y=side * self.half_distance + along * np.cos(slope),
            radius=self.radius - along * np.sin(slope),
            **pose.from_datum(along * np.cos(slope), -along * np.sin(slope)),
            patch=self.patch,
        )

    @property
    def yaw_sinking(self) -> float:
        """How fast a wheelset that yaws goes down on the rails: (b - r0 lambda) sin(angle), m.

        A contact at y from the middle comes to x = -(y - r0 tan(slope)) yaw: the axle takes it
        back, and on a cone it goes forward, to where the rail's direction lies in the surface.
        The moment of the normal force about z, x times its part across, is what follows from a
        compression that falls by half of this times the yaw's square.
        """
        sinking: float = (self.half_distance - self.radius * self.conicity) * np.sin(self.angle)
        return sinking


@dataclass(frozen=True, kw_only=True)
class Cone(Conical):
    """A conical wheel whose patch follows from curvatures and material.

    Attributes
    ----------
    shear_modulus : float
        G of wheel and rail, N/m2.
    poisson_ratio : float
        Of wheel and rail.
    """

    shear_modulus: float
    poisson_ratio: float

    @cached_property
    def patch(self) -> Patch:
        """See `Conical`."""
        return Patch.of(
            np.cos(self.angle) / self.radius,
            1 / self.head_radius,
            shear_modulus=self.shear_modulus,
            poisson_ratio=self.poisson_ratio,
        )


@dataclass(frozen=True, kw_only=True)
class KnownCone(Conical):
    """A conical wheel whose patch is given.

    Attributes
    ----------
    known : Patch
        It.
    """

    known: Patch

    @property
    def patch(self) -> Patch:
        """See `Conical`."""
        return self.known


@dataclass(frozen=True, kw_only=True)
class Pose(Generic[Numbers]):
    """The wheel's reference point as the rail sees it, and how coordinates move it.

    Attributes
    ----------
    y, z, roll : array
        From the datum in the frame that rolls with the rail, m and rad.
    across, down : array
        The same in the track's frame, m.
    wheel_roll, rail_roll : array
        rad.
    arm_y, arm_z : array
        Reference point from the wheelset's centre, m.
    """

    y: Numbers
    z: Numbers
    roll: Numbers
    across: Numbers
    down: Numbers
    wheel_roll: Numbers
    rail_roll: Numbers
    arm_y: Numbers
    arm_z: Numbers

    def gradient(self, by_y: Numbers, by_z: Numbers, by_roll: Numbers, by_yaw: Numbers) -> Numbers:
        """Derivatives by the eight coordinates from those by y, z and roll, and by the yaw."""
        c, s = np.cos(self.rail_roll), np.sin(self.rail_roll)
        n_y, n_z = by_y * c - by_z * s, by_y * s + by_z * c
        roll = by_roll - n_y * self.arm_z + n_z * self.arm_y
        rail_roll = by_y * self.z - by_z * self.y - by_roll
        none = np.zeros_like(n_y)
        found: Numbers = np.stack([n_y, n_z, roll, none, by_yaw, -n_y, -n_z, rail_roll], axis=-1)
        return found

    def from_datum(self, y: Numbers, z: Numbers) -> dict[str, Numbers]:
        """Where a point of the wheel, from its reference point as the wheelset sees it, is."""
        c, s = np.cos(self.wheel_roll), np.sin(self.wheel_roll)
        return {"rail_y": self.across + c * y - s * z, "rail_z": self.down + s * y + c * z}


def relative_pose(
    q: Numbers, y: FloatArray, z: float, apart: FloatArray | float = 0.0
) -> Pose[Numbers]:
    """The pose of a wheel whose reference point is at y and z from its wheelset's centre.

    Parameters
    ----------
    q : array, shape (..., n, 8)
        Coordinates.
    y : array, shape (n,)
        Along the axle, m.
    z : float
        Down, m.
    apart : array, shape (n,) or float
        How far below the datum it was designed to be, m.
    """
    roll, rail_roll = q[..., 2], q[..., 7]
    # Micrometres beside half a metre: the difference is formed before the sum.
    by_roll_y, by_roll_z = _turned(y, z, roll)
    across, down = q[..., 0] - q[..., 5] + by_roll_y, q[..., 1] - q[..., 6] + by_roll_z + apart
    back_y, back_z = _turned(across, down, -rail_roll)
    return Pose(
        y=across + back_y,
        z=down + back_z,
        roll=roll - rail_roll,
        across=across,
        down=down,
        wheel_roll=roll,
        rail_roll=rail_roll,
        arm_y=y + by_roll_y,
        arm_z=z + by_roll_z,
    )


def _turned(y: Any, z: Any, roll: Numbers) -> tuple[Numbers, Numbers]:
    """By how much a roll moves the point (y, z)."""
    less, s = 2 * np.sin(roll / 2) ** 2, np.sin(roll)
    return -less * y - s * z, s * y - less * z


@dataclass(frozen=True, kw_only=True)
class Textbook(Conical):
    """A cone whose contact springs are vertical, with the textbook's gravity stiffness by hand.

    Eqs 4 and 5 of Xu & Lu: a wheelset of axle load W that moves across by y from the middle of its
    rails is driven back by W lambda y / b, and one that yaws is driven on by W lambda b yaw. With
    springs along the normals this comes out by itself, and about twice as large across,
    because load goes from wheel to wheel.

    References
    ----------
    Xu, L. & Lu, T. (2021), doi 10.1080/23248378.2020.1811170, eqs 4, 5.
    """

    def touch(self, q: Numbers, side: FloatArray) -> Touch[Numbers]:
        """See `Geometry`: where they touch is the cone's, how they press is not."""
        cone = super().touch(q, side)
        b, rise = self.half_distance, self.conicity / self.half_distance
        across, yaw = q[..., 0] - q[..., 5], q[..., 4]
        down = q[..., 1] - q[..., 6] + side * b * q[..., 2]
        none, one = np.zeros_like(yaw), np.ones_like(yaw)
        gradient = np.stack([
            rise * across, one, side * b * one, none, -self.conicity * b * yaw,
            -rise * across, -one, none,
        ], axis=-1)  # fmt: skip
        return replace(
            cone,
            compression=down + rise * across**2 / 2 - self.conicity * b * yaw**2 / 2,
            gradient=gradient,
        )


@dataclass(frozen=True, kw_only=True)
class TextbookCone(Textbook, Cone):
    """Both."""


@dataclass(frozen=True, kw_only=True)
class KnownTextbookCone(Textbook, KnownCone):
    """Both."""
