"""A railway vehicle in exudyn, with its own wheel-rail contact; `exudyn_vehicle.py` runs it.

Made as a user of exudyn would make it: of bodies, springs, dampers and gravity. It has the numbers
of our vehicle and nothing else of ours.
"""

from collections.abc import Callable

import exudyn
import numpy as np
from exudyn.itemInterface import (
    CartesianSpringDamper,
    CoordinateConstraint,
    CoordinateSpringDamper,
    LoadMassProportional,
    MarkerBodyMass,
    MarkerBodyPosition,
    MarkerNodeCoordinate,
    MassPoint2D,
    NodePoint2D,
    NodePointGround,
    NodeRigidBody2D,
    RigidBody2D,
)

from railcosim.vehicle.parameters import PrimarySuspension, SecondarySuspension, Vehicle

PRESSED_IN = 10e-3  # m, where the search for rest begins: an open contact has no stiffness
BALANCE = 1e-3  # N, to which forces balance: a millionth of what the contact forces vary by
TINY = 1e-14  # relative tolerance, so that the absolute one counts


def hertz(C: float, overlap: float, gives: float) -> float:
    """Force F = C delta^1.5 of a contact that opens, with delta + gives F = overlap.

    Newton's method, from the side where it cannot overshoot.
    """
    if overlap <= 0:
        return 0.0
    delta, change = overlap, overlap
    while change > 1e-12 * overlap:
        root = delta**0.5
        change = (delta + gives * C * delta * root - overlap) / (1 + 1.5 * gives * C * root)
        delta -= change
    return C * delta**1.5


class ExudynVehicle:
    """Seven bodies in exudyn's plane: x forward, y UP; turning about z lifts the front.

    At y = 0 the wheels just touch the unloaded track and the springs are unstretched: heights of
    bodies mean nothing to vertical springs.

    Parameters
    ----------
    p : Vehicle
        Masses, springs, dampers, distances.
    C : float
        Of the contact force C delta^1.5, N/m^1.5.
    """

    def __init__(self, p: Vehicle, C: float) -> None:
        exudyn.config.printToConsole = False  # what goes wrong is raised anyway
        self.container = exudyn.SystemContainer()  # the system lives no longer than it
        self.mbs = self.container.AddSystem()
        self.gravity = p.geometry.gravity
        self.ground = self._coordinate(self.mbs.AddNode(NodePointGround()), 0)
        L_c, L_t = p.geometry.bogie_half_distance, p.geometry.axle_half_distance
        self.carbody_node, carbody = self._frame(0.0, p.carbody.mass, p.carbody.inertia_pitch)
        wheelsets = []
        for x_bogie in (L_c, -L_c):
            _, bogie = self._frame(x_bogie, p.bogie.mass, p.bogie.inertia_pitch)
            self._suspend(carbody, x_bogie, bogie, p.secondary_suspension)
            for x_axle in (L_t, -L_t):
                node, wheelset = self._wheelset(x_bogie + x_axle, p.wheelset.mass)
                self._suspend(bogie, x_axle, wheelset, p.primary_suspension)
                wheelsets.append(node)
        self.rail_gives = [0.0] * 8
        self.contacts = [self._contact(node, k, C) for k, node in enumerate(2 * wheelsets)]
        self.mbs.Assemble()

    def _frame(self, x: float, mass: float, inertia: float) -> tuple[int, int]:
        """Node and number of a car body or bogie frame: it bounces and pitches."""
        at, low = [x, 0, 0], [0, -PRESSED_IN, 0]
        node = self.mbs.AddNode(NodeRigidBody2D(referenceCoordinates=at, initialCoordinates=low))
        return self._add(RigidBody2D(nodeNumber=node, mass=mass, inertia=inertia))

    def _wheelset(self, x: float, mass: float) -> tuple[int, int]:
        """Node and number of a wheelset: it bounces."""
        node = self.mbs.AddNode(
            NodePoint2D(referenceCoordinates=[x, 0], initialCoordinates=[0, -PRESSED_IN])
        )
        return self._add(MassPoint2D(nodeNumber=node, mass=mass))

    def _add(self, body: RigidBody2D | MassPoint2D) -> tuple[int, int]:
        """Give a body its weight, and hold it along the track, for we travel with the vehicle."""
        number = self.mbs.AddObject(body)
        weight = self.mbs.AddMarker(MarkerBodyMass(bodyNumber=number))
        g = [0, -self.gravity, 0]
        self.mbs.AddLoad(LoadMassProportional(markerNumber=weight, loadVector=g))
        along = self._coordinate(body.nodeNumber, 0)
        self.mbs.AddObject(CoordinateConstraint(markerNumbers=[self.ground, along]))
        return body.nodeNumber, number

    def _coordinate(self, node: int, k: int) -> int:
        return self.mbs.AddMarker(MarkerNodeCoordinate(nodeNumber=node, coordinate=k))

    def _suspend(
        self, frame: int, x: float, below: int, suspension: PrimarySuspension | SecondarySuspension
    ) -> None:
        """Spring and damper on either side, x ahead of the frame's centre, to the body below."""
        ends = [
            self.mbs.AddMarker(MarkerBodyPosition(bodyNumber=body, localPosition=[ahead, 0, 0]))
            for body, ahead in ((below, 0.0), (frame, x))
        ]
        for _ in ("left", "right"):
            self.mbs.AddObject(
                CartesianSpringDamper(
                    markerNumbers=ends,
                    stiffness=[0, suspension.stiffness, 0],
                    damping=[0, suspension.damping, 0],
                )
            )

    def _contact(self, wheelset: int, k: int, C: float) -> int:
        """Contact of wheel k; from wheel to ground, the spring's length is the wheel's way DOWN."""

        def force(mbs, t, number, wheel_z, wheel_vz, C, damping, surface_z) -> float:
            return hertz(C, wheel_z - surface_z, self.rail_gives[k])

        return self.mbs.AddObject(
            CoordinateSpringDamper(
                markerNumbers=[self._coordinate(wheelset, 1), self.ground],
                stiffness=C,
                springForceUserFunction=force,
            )
        )

    def put_rails(self, surface_z: np.ndarray, gives: np.ndarray) -> None:
        """Set the rails' surface under the wheels without contact forces: left 1..4, right 1..4.

        Parameters
        ----------
        surface_z : array, shape (8,)
            m, down.
        gives : array, shape (8,)
            How far a contact force moves it from there, m/N.
        """
        self.rail_gives[:] = gives.tolist()
        for contact, z in zip(self.contacts, surface_z.tolist(), strict=True):
            self.mbs.SetObjectParameter(contact, "offset", z)

    def forces(self) -> np.ndarray:
        """Contact forces, N, left 1..4, right 1..4."""
        kind = exudyn.OutputVariableType.Force
        return np.array([self.mbs.GetObjectOutput(c, kind) for c in self.contacts])

    def carbody(self) -> tuple[float, float, float]:
        """Acceleration (m/s2) and displacement (m) of the car body, turned to down; pitch (rad)."""
        kind = exudyn.OutputVariableType
        acceleration, moved, turned = (
            np.ravel(self.mbs.GetNodeOutput(self.carbody_node, k))
            for k in (kind.Acceleration, kind.Displacement, kind.Rotation)
        )
        return -acceleration[1], -moved[1], turned[-1]


def roll(
    mbs: exudyn.MainSystem,
    step: float,
    stop: float,
    before: Callable[[float], None],
    after: Callable[[float], None],
    balance: float = BALANCE,
) -> None:
    """Step by the trapezoidal rule; `before` and `after` each step get the time at its END."""
    settings = exudyn.SimulationSettings()
    settings.solution.file.write = False
    integration = settings.timeIntegration
    integration.endTime, integration.numberOfSteps = stop, round(stop / step)
    integration.adaptiveStep = False  # a step taken twice would move the track twice
    newton = integration.newton
    newton.useModifiedNewton = True
    newton.absoluteTolerance, newton.relativeTolerance = balance, TINY
    mbs.SetPreStepUserFunction(lambda mbs, t: before(t) is None)
    mbs.SetPostStepUserFunction(lambda mbs, t: after(t) is None)
    mbs.SolveDynamic(settings, solverType=exudyn.DynamicSolverType.TrapezoidalIndex2)


def settle(mbs: exudyn.MainSystem, balance: float = BALANCE) -> None:
    """Come to rest under gravity, and begin from there."""
    settings = exudyn.SimulationSettings()
    settings.solution.file.write = False
    newton = settings.staticSolver.newton
    newton.absoluteTolerance, newton.relativeTolerance = balance, TINY
    mbs.SolveStatic(settings, updateInitialValues=True)
