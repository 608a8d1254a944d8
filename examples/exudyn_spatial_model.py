"""A vehicle in space in exudyn, with a creep law of its own; `exudyn_spatial.py` runs it.

Made as a user of exudyn would make it: rigid bodies, springs and dampers where they are, wheels
that roll. It has the numbers of our vehicle and nothing else of ours. x forward, y to the right,
z down; heights from the secondary suspension.
"""

from dataclasses import dataclass, field

import exudyn
import numpy as np
from exudyn.itemInterface import (
    CartesianSpringDamper,
    CoordinateConstraint,
    MarkerBodyPosition,
    MarkerNodeCoordinate,
    Mass1D,
    Node1D,
    NodePointGround,
    NodeRigidBodyRxyz,
    ObjectGenericODE2,
    RigidBody,
)
from exudyn_model import settle

from railcosim.vehicle.parameters import PrimarySuspension, SecondarySuspension, Vehicle

SIDE = np.repeat([-1.0, 1.0], 4)  # of the contacts: left 1..4, right 1..4
MOVES = 5  # of a wheelset: y, z, roll, yaw, and the spin beyond its rolling
NUDGE_Q, NUDGE_V = 1e-9, 1e-5  # m and m/s, rad and rad/s: differences find the tangents
BALANCE = 1e-2  # N, of some 1e4 that forces vary by
PRESSED_IN = 2e-4  # m, where the search for rest begins
SETTLED = 1e-6  # N, of what rails and wheels do to each other


@dataclass
class Rails:
    """Rails at the end of a step: y, z, roll of each, and by how much forces move them from there.

    Forces and motions of a rail are those of the middle of its head: to the right, down, and a
    moment about the forward axis. A force reaches no other wheel within a step.
    """

    q: np.ndarray = field(default_factory=lambda: np.zeros((8, 3)))
    v: np.ndarray = field(default_factory=lambda: np.zeros((8, 3)))
    q_by_force: np.ndarray = field(default_factory=lambda: np.zeros((8, 3, 3)))
    v_by_force: np.ndarray = field(default_factory=lambda: np.zeros((8, 3, 3)))
    uneven: np.ndarray = field(default_factory=lambda: np.zeros((8, 3)))  # y, z, 0 of the surface


@dataclass(frozen=True, kw_only=True)
class Wheels:
    """Cones on round heads, with Kalker's linear creep that friction bounds.

    What a load changes is known from Hertz: the patch grows with its cube root. All by vectors, for
    arrays (..., 8).
    """

    radius: float  # m
    half_distance: float  # m
    conicity: float
    head_radius: float  # m
    hertz: float  # N/m^1.5
    load: float  # N, at which the creep coefficients are given
    f11: float  # N
    f22: float  # N
    f23: float  # N m
    f33: float  # N m2
    friction: float
    speed: float  # m/s

    def forces(self, q: np.ndarray, v: np.ndarray, rail: np.ndarray, rail_v: np.ndarray):
        """On wheelsets (..., 8, 5) at their `MOVES`, and on rails (..., 8, 3), N and N m.

        q, v are those of each contact's wheelset, rail is with its surface as it is.
        """
        roll, yaw = q[..., 2], q[..., 3]
        normal = self._turn(SIDE * np.sin(self._angle), np.cos(self._angle), roll)
        centre = np.stack([q[..., 0], q[..., 1] - self.radius], axis=-1)
        tread = centre + self._turn(SIDE * self.half_distance, self.radius, roll)
        head = rail[..., :2] + [0.0, 0.0]
        head[..., 0] += SIDE * self.half_distance
        turned = self._turn(SIDE * np.sin(self._angle), np.cos(self._angle), rail[..., 2])
        middle = head + self.head_radius * turned  # of the circle that the head is
        apart = np.sum((middle - tread) * normal, axis=-1)
        N = self.hertz * np.maximum(self.head_radius - apart, 0.0) ** 1.5
        touches = middle - apart[..., None] * normal
        arm, on_head = touches - centre, touches - head
        # A wheelset that yaws touches where its cone lies along the rail, a little ahead.
        ahead = -(arm[..., 0] - self.radius * SIDE * np.tan(self._angle)) * yaw
        slip = self._slip(
            v, rail_v, q, np.stack([ahead, arm[..., 0], arm[..., 1]]), normal, on_head
        )
        T = self._creep(slip, N)
        across = np.stack([normal[..., 1], -normal[..., 0]], axis=-1)
        yz = -N[..., None] * normal + T[1][..., None] * across
        F_x, F_y, F_z = T[0], yz[..., 0], yz[..., 1]
        M_x = arm[..., 0] * F_z - arm[..., 1] * F_y
        M_y = arm[..., 1] * F_x - ahead * F_z + T[2] * normal[..., 0]
        M_z = ahead * F_y - arm[..., 0] * F_x + T[2] * normal[..., 1]
        spin = -yaw * M_x + M_y + roll * M_z  # about the axle
        on_wheels = np.stack([F_y, F_z, M_x, M_z, spin], axis=-1)
        twist = -(on_head[..., 0] * F_z - on_head[..., 1] * F_y)
        return on_wheels, np.stack([-F_y, -F_z, twist], axis=-1)

    @property
    def _angle(self) -> float:
        return float(np.arctan(self.conicity))

    @staticmethod
    def _turn(y, z, roll: np.ndarray) -> np.ndarray:
        c, s = np.cos(roll), np.sin(roll)
        return np.stack([y * c - z * s, y * s + z * c], axis=-1)

    def _slip(self, v, rail_v, q, arm, normal, on_head):
        """Along, across and about the normal, over the speed: wheel less rail."""
        turning = v[..., 4] - self.speed / self.radius
        w_x = v[..., 2] - turning * q[..., 3]
        w_y, w_z = turning, v[..., 3] + turning * q[..., 2]
        x = self.speed + w_y * arm[2] - w_z * arm[1]
        y = v[..., 0] + w_z * arm[0] - w_x * arm[2] - rail_v[..., 0]
        z = v[..., 1] + w_x * arm[1] - w_y * arm[0] - rail_v[..., 1]
        y += rail_v[..., 2] * on_head[..., 1]
        z -= rail_v[..., 2] * on_head[..., 0]
        across = y * normal[..., 1] - z * normal[..., 0]
        about = w_y * normal[..., 0] + w_z * normal[..., 1]
        return np.stack([x, across, about]) / self.speed

    def _creep(self, slip: np.ndarray, N: np.ndarray) -> np.ndarray:
        """Forces on the wheels along and across, and the moment about the normal."""
        grown = (N / self.load) ** (1 / 3)
        T_x = -self.f11 * grown**2 * slip[0]
        T_y = -self.f22 * grown**2 * slip[1] - self.f23 * grown**3 * slip[2]
        M = self.f23 * grown**3 * slip[1] - self.f33 * grown**4 * slip[2]
        part = np.hypot(T_x, T_y) / np.maximum(self.friction * N, 1e-9)  # no load, no creep
        safe = np.maximum(part, 1e-12)
        bound = np.where(part < 3, 1 - part / 3 + part**2 / 27, 1 / safe)
        return bound * np.stack([T_x, T_y, M])


class ExudynSpatialVehicle:
    """Car body, two bogies, four wheelsets; no springs are stretched by weights at rest.

    So bodies' weights do not topple them, and every wheelset carries what stands on it.
    """

    def __init__(self, p: Vehicle, wheels: Wheels) -> None:
        exudyn.config.printToConsole = False  # what goes wrong is raised anyway
        self.container = exudyn.SystemContainer()  # the system lives no longer than it
        self.mbs = self.container.AddSystem()
        self.wheels, self.rails, self.load = wheels, Rails(), p.wheel_load
        self.on_rails = np.zeros((8, 3))
        g = p.geometry
        self.ground = self._coordinate(self.mbs.AddNode(NodePointGround()), 0)
        car, self.carbody = self._body(p.carbody, (0.0, 0.0, -g.carbody_height))
        self.axles, spins, self.held = [], [], []
        for x_bogie in (g.bogie_half_distance, -g.bogie_half_distance):
            frame, _ = self._body(p.bogie, (x_bogie, 0.0, -g.bogie_height))
            self._secondary(p.secondary_suspension, car, frame, x_bogie)
            for x in (x_bogie + g.axle_half_distance, x_bogie - g.axle_half_distance):
                z = -g.bogie_height + g.wheelset_height
                axle, node = self._body(p.wheelset, (x, 0.0, z), turns_about_y=False)
                spin = self.mbs.AddNode(Node1D(referenceCoordinates=[0.0]))
                self.mbs.AddObject(Mass1D(nodeNumber=spin, mass=p.wheelset.inertia_spin))
                spin_at = self._coordinate(spin, 0)
                high = -g.bogie_height + g.primary_height
                self._primary(p.primary_suspension, frame, axle, (x, high))
                self.axles.append(node)
                spins.append(spin)
                for where in (self._coordinate(node, 1), self._coordinate(node, 5), spin_at):
                    hold = CoordinateConstraint(markerNumbers=[self.ground, where])
                    self.held.append(self.mbs.AddObject(hold))
        self.contact = self._contact([*self.axles, *spins])
        self.mbs.Assemble()

    def _body(self, known, place, *, turns_about_y: bool = True) -> tuple[int, int]:
        """Number and node of a body that travels with the track's frame."""
        about_y = known.inertia_pitch if turns_about_y else known.inertia_spin
        node = self.mbs.AddNode(NodeRigidBodyRxyz(referenceCoordinates=[*place, 0.0, 0.0, 0.0]))
        inertia = [known.inertia_roll, about_y, known.inertia_yaw, 0.0, 0.0, 0.0]
        body = RigidBody(physicsMass=known.mass, physicsInertia=inertia, nodeNumber=node)
        number = self.mbs.AddObject(body)
        # An axle turns in its boxes: its spin is a coordinate of its own.
        for k in (0,) if turns_about_y else (0, 4):
            held = [self.ground, self._coordinate(node, k)]
            self.mbs.AddObject(CoordinateConstraint(markerNumbers=held))
        return number, node

    def _coordinate(self, node: int, k: int) -> int:
        return self.mbs.AddMarker(MarkerNodeCoordinate(nodeNumber=node, coordinate=k))

    def _spring(self, a: int, b: int, point, k, c) -> None:
        ends = []
        for body in (a, b):
            node = self.mbs.GetObject(body)["nodeNumber"]
            centre = np.array(self.mbs.GetNode(node)["referenceCoordinates"][:3])
            at = MarkerBodyPosition(bodyNumber=body, localPosition=(np.array(point) - centre))
            ends.append(self.mbs.AddMarker(at))
        self.mbs.AddObject(CartesianSpringDamper(markerNumbers=ends, stiffness=k, damping=c))

    def _primary(self, s: PrimarySuspension, frame: int, axle: int, at) -> None:
        for side in (-1, 1):
            self._spring(frame, axle, (at[0], side * s.half_span, at[1]),
                         [s.stiffness_x, s.stiffness_y, s.stiffness],
                         [s.damping_x, s.damping_y, s.damping])  # fmt: skip

    def _secondary(self, s: SecondarySuspension, car: int, frame: int, x: float) -> None:
        for side in (-1, 1):
            self._spring(car, frame, (x, side * s.half_span, 0.0),
                         [s.stiffness_x, s.stiffness_y, s.stiffness],
                         [s.damping_x, s.damping_y, s.damping])  # fmt: skip
            if s.yaw_damper:
                self._spring(car, frame, (x, side * s.yaw_damper_half_span, 0.0),
                             [0.0, 0.0, 0.0], [s.yaw_damper, 0.0, 0.0])  # fmt: skip

    def _contact(self, nodes: list[int]) -> int:
        """All wheels on their rails as one object: exudyn wants to know its tangents."""

        def force(mbs, t, number, q, v):
            on_axles, self.on_rails = self._balance(*self._of_contacts(q, v))
            return self._to_nodes(on_axles)

        def tangents(mbs, t, number, q, v, by_q, by_v):
            q_c, v_c = self._of_contacts(q, v)
            steps = np.eye(MOVES)[:, None, :] * np.ones((1, 8, 1))
            here, _ = self._balance(q_c, v_c)
            found = np.zeros((28, 28))
            for nudge, factor, to in ((NUDGE_Q, by_q, 0), (NUDGE_V, by_v, 1)):
                moved = [q_c, v_c]
                moved[to] = moved[to] + nudge * steps
                there, _ = self._balance(*np.broadcast_arrays(*moved))
                slopes = (there - here) / nudge  # (5, 8, 5): by a motion of the contact's wheelset
                for i in range(4):
                    at = self._places(i)
                    both = slopes[:, i] + slopes[:, i + 4]
                    found[np.ix_(at, at)] -= factor * both.T
            return found

        zero = np.zeros((28, 28))
        return self.mbs.AddObject(
            ObjectGenericODE2(
                nodeNumbers=nodes, massMatrix=zero, stiffnessMatrix=zero, dampingMatrix=zero,
                forceUserFunction=force, jacobianUserFunction=tangents,
            )
        )  # fmt: skip

    @staticmethod
    def _places(i: int) -> list[int]:
        """Of a wheelset's `MOVES` among the coordinates of the nodes."""
        return [6 * i + 1, 6 * i + 2, 6 * i + 3, 6 * i + 5, 24 + i]

    def _of_contacts(self, q, v) -> list[np.ndarray]:
        places = [self._places(i) for i in (0, 1, 2, 3)]
        return [np.tile(np.asarray(x)[places], (2, 1)) for x in (q, v)]

    def _to_nodes(self, on_axles: np.ndarray) -> np.ndarray:
        found = np.zeros(28)
        for i in range(4):
            found[self._places(i)] += on_axles[i] + on_axles[i + 4]
            found[6 * i + 2] += 2 * self.load  # what stands on the wheelset, and itself
        return found

    def _balance(self, q: np.ndarray, v: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Forces on axles and rails that agree with the rails' motion under them, by Newton."""
        rails = self.rails

        def law(force: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
            moved = rails.q + rails.uneven + np.einsum("nij,...nj->...ni", rails.q_by_force, force)
            moving = rails.v + np.einsum("nij,...nj->...ni", rails.v_by_force, force)
            return self.wheels.forces(q, v, moved, moving)

        shape = (*q.shape[:-1], 3)
        force = np.broadcast_to(self.on_rails, shape).copy()
        on_axles, found = law(force)
        for _ in range(30):
            wrong = found - force
            if np.abs(wrong).max() < SETTLED or not rails.q_by_force.any():
                break
            columns = []
            for k in range(3):
                nudged = force.copy()
                nudged[..., k] += 1.0
                columns.append(law(nudged)[1] - found)
            by = np.stack(columns, axis=-1)
            force = force + np.linalg.solve(np.eye(3) - by, wrong[..., None])[..., 0]
            on_axles, found = law(force)
        return on_axles, found

    def moves(self) -> np.ndarray:
        """y, z, roll and yaw of the wheelsets, shape (4, 4)."""
        kind = exudyn.OutputVariableType.Coordinates
        return np.array(
            [np.array(self.mbs.GetNodeOutput(n, kind))[[1, 2, 3, 5]] for n in self.axles]
        )

    def settle(self) -> None:
        """Come to rest on the rails: in their middle, held where nothing but creep holds wheels."""
        # The search begins pressed in: an open contact has no stiffness.
        low = (self.rails.q + self.rails.uneven)[:, 1].reshape(2, 4).mean(axis=0) + PRESSED_IN
        for node, z in zip(self.axles, low.tolist(), strict=True):
            self.mbs.SetNodeParameter(node, "initialCoordinates", [0, 0, z, 0, 0, 0])
        for hold in self.held:
            self.mbs.SetObjectParameter(hold, "activeConnector", True)
        self.mbs.Assemble()
        settle(self.mbs, BALANCE)
        for hold in self.held:
            self.mbs.SetObjectParameter(hold, "activeConnector", False)
