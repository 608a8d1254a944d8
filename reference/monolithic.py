"""Vehicle and the whole ring of track as ONE set of sparse matrices.

The answer that every coupled result is held against. Of the track it shares the rail element, the
plate modes and the parameters with the FMUs, and nothing else: no Bloch waves, no symmetry, no
modes of the ring, no reduction. The vertical system is a choice of directions.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy import sparse

from railcosim.mechanics.arrays import FloatArray
from railcosim.mechanics.ports import DIMENSIONS, OF_WHEELS, ROLL, YAW, Direction, X, Y, Z
from railcosim.track.decay import check_ring
from railcosim.track.parameters import Track
from railcosim.vehicle.multibody import VERTICAL, Dimension, Multibody, build_multibody
from railcosim.vehicle.parameters import Vehicle
from railcosim.vehicle.train import Train

from .below import SIDES
from .ring import TrackRing, build_ring


@dataclass(frozen=True, kw_only=True)
class Monolithic:
    """M, C, K of everything, contacts apart.

    The unknowns are the vehicle's coordinates, then the ring's. Contacts are those of the left
    wheels from the front, then those of the right ones, as in a `Layout`: all directions of a
    contact stand together.

    Attributes
    ----------
    M, C, K, K_loss : sparse array, shape (n, n)
        Mass, viscous damping, stiffness, hysteretic part (complex stiffness K + i K_loss).
    wheel_ports : sparse array, shape (n_contacts x `OF_WHEELS`, n)
        Displacements of the wheels, of their points at the rails' data.
    load : array, shape (n_contacts x n_directions,)
        Static load of each wheel, N: of z, and nothing of other directions.
    body : Multibody
        The vehicle.
    ring : TrackRing
        The track.
    """

    M: sparse.csc_array
    C: sparse.csc_array
    K: sparse.csc_array
    K_loss: sparse.csc_array
    wheel_ports: sparse.csr_array
    load: FloatArray
    body: Multibody
    ring: TrackRing

    @property
    def track(self) -> Track:
        """Parameters of the track."""
        return self.ring.track

    @property
    def directions(self) -> tuple[Direction, ...]:
        """Of every contact."""
        return self.ring.directions

    @property
    def wheels(self) -> sparse.csr_array:
        """Displacements of the wheels in the directions of rails, as rows of `rails`."""
        contacts, here = 2 * len(self.body.axles), len(self.directions)
        of_each = np.arange(self.wheel_ports.shape[0]).reshape(contacts, -1)
        return self.wheel_ports[of_each[:, :here].ravel()]

    @property
    def viscous_damping(self) -> sparse.csc_array:
        """C with the hysteretic part made viscous at the stated frequency, for time."""
        omega = 2 * np.pi * self.track.mesh.loss_factor_frequency
        return self.C + self.K_loss / omega

    def coordinate(self, name: str) -> int:
        """Place of a vehicle coordinate among the unknowns."""
        return self.body.coordinates.index(name)

    def rails(self, position: FloatArray) -> sparse.csr_array:
        """Displacements of the rails under wheelsets at their positions, as rows of `wheels`."""
        heads = self.ring.heads(position)
        before = sparse.csr_array((heads.shape[0], len(self.body.coordinates)))
        return sparse.hstack([before, heads], format="csr")


def assemble(
    stock: Vehicle | Train, track: Track, position: FloatArray, dimension: Dimension = VERTICAL
) -> Monolithic:
    """Assemble the whole system.

    Parameters
    ----------
    stock, track : Vehicle or Train, Track
        Parameters.
    position : array, shape (n_wheelsets,)
        Wheelset positions (m) that get a rail node, so that the loaded elements are exact there.
    dimension : Dimension
        Of vehicle and track.

    Raises
    ------
    ParameterError
        If the vehicle meets itself through the ring.

    Warns
    -----
    RingWarning
        If the ring is too short for what `railcosim.track.decay` promises.
    """
    body, directions = build_multibody(stock, dimension), DIMENSIONS[dimension.name]
    check_ring(track, float(np.ptp(body.wheelset_x)))
    ring = build_ring(track, directions, np.asarray(position))
    nothing = sparse.csr_array(body.K.shape)
    M, C, K, K_loss = (
        sparse.block_diag(both, format="csc")
        for both in (
            (body.M, ring.M), (body.C, ring.C), (body.K, ring.K), (nothing, ring.K_loss)
        )
    )  # fmt: skip
    moved = _wheels(body, OF_WHEELS[dimension.name])
    behind = sparse.csr_array((moved.shape[0], ring.K.shape[0]))
    wheel_ports = sparse.hstack([sparse.csr_array(moved), behind], format="csr")
    load = np.outer(np.tile(body.wheel_load, 2), [float(d is Z) for d in directions]).ravel()
    return Monolithic(
        M=M, C=C, K=K, K_loss=K_loss, wheel_ports=wheel_ports, load=load, body=body, ring=ring
    )


def _wheels(body: Multibody, directions: tuple[Direction, ...]) -> FloatArray:
    """Displacements of wheels by the vehicle's coordinates, those that it has."""
    found = np.zeros((2, len(body.axles), len(directions), len(body.coordinates)))
    for side, sign in enumerate(SIDES):
        for i, (axle, wheel) in enumerate(zip(body.axles, body.wheels, strict=True)):
            moved = {
                Z: {"z": 1.0, "roll": sign * wheel.half_distance},
                Y: {"y": 1.0, "roll": -wheel.radius},
                ROLL: {"roll": 1.0},
                X: {"spin": wheel.radius, "yaw": -sign * wheel.half_distance},
                YAW: {"yaw": 1.0},
            }
            for j, direction in enumerate(directions):
                for name, by in moved[direction].items():
                    if f"{axle}.{name}" in body.coordinates:
                        found[side, i, j, body.at(axle, name)] = by
    return found.reshape(-1, len(body.coordinates))
