"""Slabs of the whole ring, each a free plate on its foundation."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass

import numpy as np

from railcosim.mechanics.arrays import FloatArray
from railcosim.mechanics.ports import ROLL, Direction, Y, Z
from railcosim.track.cell import EVEN, ODD
from railcosim.track.parameters import Track
from railcosim.track.section import moves_aside
from railcosim.track.slab import PlateModes, free_plate_modes


@dataclass(frozen=True, kw_only=True)
class Slabs:
    """What every slab can do: bend, by the modes of a free plate, and shift and yaw in its plane.

    Attributes
    ----------
    track : Track
        Its parameters.
    plates : tuple of PlateModes
        Bending; none where fastenings stand on rigid ground.
    sideways : bool
        Whether it shifts (m) and yaws (rad), as a rigid body.
    """

    track: Track
    plates: tuple[PlateModes, ...]
    sideways: bool

    @property
    def diagonals(self) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Mass, damping and stiffness of one slab's unknowns, on its foundation."""
        slab, ground = self.track.slab, self.track.foundation
        omega = np.concatenate([np.empty(0), *(plate.omega for plate in self.plates)])
        per_mass, one = 1 / slab.mass_per_area, np.ones(omega.size)
        area = slab.length * slab.width
        # About the middle; the layer below resists shear alike along and across.
        areas = area * np.array([1.0, (slab.length**2 + slab.width**2) / 12][: 2 * self.sideways])
        return (
            np.append(one, slab.mass_per_area * areas),
            np.append(ground.damping * per_mass * one, ground.damping_lateral * areas),
            np.append(
                omega**2 + ground.series_stiffness * per_mass, ground.stiffness_lateral * areas
            ),
        )

    def motion(self, direction: Direction, x: FloatArray, y: FloatArray) -> FloatArray:
        """Of the surface at points from the middle by a slab's unknowns, shape (points, n)."""
        half, tilts = self.track.slab.thickness / 2, float(self.track.slab.tilts_rails)
        none, aside = np.zeros((x.size, 2)), np.stack([np.ones_like(x), x], axis=1)
        across = {Y: aside}.get(direction, none)[:, : 2 * self.sideways]
        bent = {
            Z: lambda plate: plate.at(x, y),
            Y: lambda plate: tilts * half * plate.slope_across(x, y),
            ROLL: lambda plate: tilts * plate.slope_across(x, y),
        }[direction]
        return np.concatenate([*map(bent, self.plates), across], axis=1)


def slabs_of(track: Track, directions: Collection[Direction]) -> Slabs:
    """What slabs do for loads in directions."""
    there, top = track.slab.present, track.mesh.highest_slab_frequency
    bend = there and (Z in directions or track.rails_tilt)
    return Slabs(
        track=track,
        plates=tuple(free_plate_modes(track.slab, p, top) for p in (EVEN, ODD)) if bend else (),
        sideways=there and moves_aside(directions),
    )
