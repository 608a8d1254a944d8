"""What moves of a rail's section, and what that costs: unknowns of a node as data.

Unknowns are [w, theta] of vertical bending, then [v, psi] of lateral bending and [phi] of torsion,
if a direction asks for them: w of the centroid (down), v of the shear centre (right), phi about the
forward axis, theta and psi along dw/dx and dv/dx. A rail that warps has [phi, dphi/dx].
"""

from __future__ import annotations

from collections.abc import Collection, Iterable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from railcosim.mechanics.arrays import FloatArray
from railcosim.mechanics.ports import DIMENSIONS, ROLL, Direction, Y, Z
from railcosim.mechanics.shape_functions import shape_functions

from .parameters import Rail

VERTICAL, SPATIAL = DIMENSIONS["vertical"], DIMENSIONS["spatial"]
ASIDE = (Y, ROLL)

GAUSS = np.polynomial.legendre.leggauss(4)  # exact to degree 7; a deflection squared has 6


@dataclass(frozen=True, kw_only=True)
class Beam:
    """A deflection and a rotation: bending with shear, or torsion with warping.

    Attributes
    ----------
    unknowns : tuple of str
        Their names.
    mass, rotary_inertia : float
        Per length, of deflection and rotation.
    bending, shear : float
        Stiffness against a change of the rotation along x, and against its difference to the slope
        (infinite: the rotation is the slope).
    slope : float
        Stiffness against a slope of the deflection, as a string's: torsion's GJ.
    """

    unknowns: tuple[str, ...]
    mass: float
    rotary_inertia: float
    bending: float
    shear: float = np.inf
    slope: float = 0.0

    def softness(self, L: FloatArray) -> FloatArray:
        """Shear parameter of elements of length L."""
        phi: FloatArray = 12 * self.bending / (self.shear * L**2)
        return phi

    def wavenumber(self, omega: float) -> float:
        """The greatest of its free waves (Timoshenko's beam; as a string or bar if it is one)."""
        if self.slope:
            return float(omega * np.sqrt(self.mass / self.slope))
        shear, bent = self.mass / self.shear, self.rotary_inertia / self.bending
        root = np.sqrt(omega**4 * (shear - bent) ** 2 + 4 * omega**2 * self.mass / self.bending)
        return float(np.sqrt((omega**2 * (shear + bent) + root) / 2))

    def shapes(self, xi: FloatArray, L: FloatArray) -> FloatArray:
        """Deflection at xi (0..1) of elements from their four unknowns, shape (..., 4)."""
        return shape_functions(xi, L, self.softness(L))[0]

    @property
    def inertias(self) -> list[float]:
        """Per length, of each unknown."""
        return [self.mass, self.rotary_inertia]

    def stiffness(self, L: FloatArray) -> FloatArray:
        """Of elements, shape (n, 4, 4)."""
        phi = self.softness(L)
        K = np.empty((L.size, 4, 4))
        six, two, four = 6 * L, (2 - phi) * L**2, (4 + phi) * L**2
        twelve = np.full_like(L, 12.0)
        rows = [
            [twelve, six, -twelve, six],
            [six, four, -six, two],
            [-twelve, -six, twelve, -six],
            [six, two, -six, four],
        ]
        for i, row in enumerate(rows):
            for j, entry in enumerate(row):
                K[:, i, j] = entry
        K *= (self.bending / (L**3 * (1 + phi)))[:, None, None]
        if self.slope:
            weight, _, slopes = self._inside(L)  # with no shear the rotation is the slope
            K += self.slope * np.einsum("gn,gni,gnj->nij", weight, slopes, slopes)
        return K

    def consistent_mass(self, L: FloatArray) -> FloatArray:
        """Of elements, shape (n, 4, 4)."""
        weight, N_w, N_theta = self._inside(L)
        M: FloatArray = self.mass * np.einsum("gn,gni,gnj->nij", weight, N_w, N_w)
        M += self.rotary_inertia * np.einsum("gn,gni,gnj->nij", weight, N_theta, N_theta)
        return M

    def _inside(self, L: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        points, weights = GAUSS
        xi = (points[:, None] + 1) / 2
        weight = weights[:, None] / 2 * L
        return weight, *shape_functions(xi, L, self.softness(L))


@dataclass(frozen=True, kw_only=True)
class Bar:
    """One unknown: torsion without warping.

    Attributes
    ----------
    unknowns : tuple of str
        Its name.
    mass : float
        Its inertia per length.
    slope : float
        Stiffness against its slope.
    """

    unknowns: tuple[str, ...]
    mass: float
    slope: float

    def wavenumber(self, omega: float) -> float:
        """Of its free wave; 0 if nothing carries one along it."""
        return float(omega * np.sqrt(self.mass / self.slope)) if self.slope else 0.0

    def shapes(self, xi: FloatArray, L: FloatArray) -> FloatArray:
        """Inside elements from their two unknowns, shape (..., 2)."""
        xi, _ = np.broadcast_arrays(xi, L)
        return np.stack([1 - xi, xi], axis=-1)

    @property
    def inertias(self) -> list[float]:
        """Per length."""
        return [self.mass]

    def stiffness(self, L: FloatArray) -> FloatArray:
        """Of elements, shape (n, 2, 2)."""
        K: FloatArray = (self.slope / L)[:, None, None] * np.array([[1.0, -1.0], [-1.0, 1.0]])
        return K

    def consistent_mass(self, L: FloatArray) -> FloatArray:
        """Of elements, shape (n, 2, 2)."""
        M: FloatArray = (self.mass * L / 6)[:, None, None] * np.array([[2.0, 1.0], [1.0, 2.0]])
        return M


@dataclass(frozen=True, kw_only=True)
class Section:
    """A rail's section.

    Attributes
    ----------
    members : tuple of Beam or Bar
        What it can do; each deflects by its first unknown.
    shared : tuple of (int, int, float)
        Inertia per length that couples the deflections of two members.
    shear_centre : float
        Below the centroid, m.
    """

    members: tuple[Beam | Bar, ...]
    shared: tuple[tuple[int, int, float], ...]
    shear_centre: float

    @property
    def unknowns(self) -> tuple[str, ...]:
        """Of a node, in order."""
        return tuple(name for member in self.members for name in member.unknowns)

    @property
    def size(self) -> int:
        """How many."""
        return len(self.unknowns)

    def element_unknowns(self, member: int) -> NDArray[np.intp]:
        """Where those of a member are among the unknowns of an element, first node first."""
        start = sum(len(m.unknowns) for m in self.members[:member])
        own = start + np.arange(len(self.members[member].unknowns))
        return np.concatenate([own, self.size + own])

    def deflections(self, direction: Direction, y: float, z: float) -> FloatArray:
        """How much of each member's deflection a point moves by, shape (members,).

        Parameters
        ----------
        direction : Direction
            In which it moves.
        y, z : float
            The point, to the right of the centroid and below it, m.
        """
        moved = {
            Z: {"w": 1.0, "phi": y},
            Y: {"v": 1.0, "phi": self.shear_centre - z},
            ROLL: {"phi": 1.0},
        }[direction]
        return np.array([moved.get(member.unknowns[0], 0.0) for member in self.members])


def section_of(rail: Rail, directions: Collection[Direction] = SPATIAL) -> Section:
    """The section as far as it moves in directions.

    Vertical bending for Z; lateral bending and torsion, which belong together at any height but the
    shear centre's, for Y and ROLL.
    """
    members: list[Beam | Bar] = []
    shared: list[tuple[int, int, float]] = []
    if Z in directions:
        members.append(
            Beam(
                unknowns=("w", "theta"),
                mass=rail.mass_per_length,
                rotary_inertia=rail.rotary_inertia,
                bending=rail.bending_stiffness,
                shear=rail.shear_stiffness,
            )
        )
    if moves_aside(directions):
        shared.append(
            (len(members), len(members) + 1, rail.mass_per_length * rail.shear_centre_depth)
        )
        members += [lateral(rail), torsion(rail)]
    return Section(
        members=tuple(members), shared=tuple(shared), shear_centre=rail.shear_centre_depth
    )


def moves_aside(directions: Collection[Direction]) -> bool:
    """Whether a rail bends sideways and twists: neither comes without the other."""
    return Y in directions or ROLL in directions


def directions_for(asked: Iterable[Direction], *, coupled: bool) -> tuple[Direction, ...]:
    """Those of the smallest model that moves in all that are asked for.

    Unless slabs that bend tilt the rails (`coupled`), what moves aside does without bending down.
    """
    wanted = set(asked)
    models = (VERTICAL, SPATIAL) if coupled else (VERTICAL, ASIDE, SPATIAL)
    return next(d for d in models if wanted <= set(d))


def lateral(rail: Rail) -> Beam:
    """Lateral bending, of the line of shear centres."""
    return Beam(
        unknowns=("v", "psi"),
        mass=rail.mass_per_length,
        rotary_inertia=rail.mass_per_length / rail.area * rail.second_moment_lateral,
        bending=rail.young_modulus * rail.second_moment_lateral,
        shear=rail.shear_coefficient_lateral * rail.shear_modulus * rail.area,
    )


def torsion(rail: Rail) -> Beam | Bar:
    """Torsion about the line of shear centres."""
    inertia = rail.polar_inertia + rail.mass_per_length * rail.shear_centre_depth**2
    if not rail.warping_constant:
        return Bar(unknowns=("phi",), mass=inertia, slope=rail.torsional_rigidity)
    return Beam(
        unknowns=("phi", "warp"),
        mass=inertia,
        rotary_inertia=rail.mass_per_length / rail.area * rail.warping_constant,
        bending=rail.young_modulus * rail.warping_constant,
        slope=rail.torsional_rigidity,
    )
