"""Bonds between components: a force one way and a motion the other, whose product is a power."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from railcosim.master.connections import Connection, CouplingError
from railcosim.master.system import System

POWER = {("N", "m/s"), ("N.m", "rad/s"), ("V", "A"), ("Pa", "m3/s")}
"""Units of efforts and flows whose product is in W."""
WORK = {("N", "m"), ("N.m", "rad")}
"""Units of efforts and displacements whose product is in J."""

ABOUT = {"roll": "x", "pitch": "y", "yaw": "z"}
"""Axes of rotations."""


@dataclass(frozen=True)
class Bond:
    """A force one way and a motion the other between two components.

    Attributes
    ----------
    effort : Connection
        Of the force, torque, voltage or pressure.
    motion : Connection
        The other way: of its velocity, or else of its displacement.
    sign : int
        1 if a positive force drives the component it acts on towards positive motion; -1 if
        against it, as a contact force in compression drives a wheel up where z is down.
    """

    effort: Connection
    motion: Connection
    sign: int = 1

    @property
    def name(self) -> str:
        """Of the interface."""
        return f"{self.effort.source}.{self.effort.output}->{self.effort.target}"


def find_bonds(system: System, against: Sequence[str] = ()) -> tuple[Bond, ...]:
    """Find the bonds of a system, by units and names.

    A force from A to B is bound to the velocity from B to A of the same place: of the same name up
    to the last dot, and among several, of the same last letter, of rotations that of their axis
    (roll x, pitch y, yaw z); if there is none, to the displacement.

    Parameters
    ----------
    system : System
        With units.
    against : sequence of str, optional
        Components that positive forces drive towards negative motion; see `Bond.sign`.

    Returns
    -------
    tuple of Bond
        One for each force that has a motion.

    Raises
    ------
    CouplingError
        If several motions fit one force, or a component does not exist.
    """
    for name in against:
        system.index(name)
    bonds = []
    for effort in system.connections:
        sign = -1 if effort.target in against else 1
        back = [
            Bond(effort, motion, sign)
            for motion in system.connections
            if (motion.source, motion.target) == (effort.target, effort.source)
            and _place(motion) == _place(effort)
        ]
        for pairs in (POWER, WORK):
            fitting = [bond for bond in back if kind_of(system, bond) is pairs]
            like = [bond for bond in fitting if _axis(bond.motion.output) == effort.output[-1]]
            fitting = like if len(fitting) > 1 and like else fitting
            if len(fitting) > 1:
                motions = " or ".join(str(bond.motion) for bond in fitting)
                raise CouplingError(f"the motion of {effort} could be {motions}: give the bonds")
            if fitting:
                bonds.append(fitting[0])
                break
    return tuple(bonds)


def kind_of(system: System, bond: Bond) -> set[tuple[str, str]] | None:
    """Tell whether a bond is one of `POWER`, of `WORK`, or none."""
    units = units_of(system)
    pair = units[bond.effort], units[bond.motion]
    return POWER if pair in POWER else WORK if pair in WORK else None


def units_of(system: System) -> dict[Connection, str]:
    """Unit of each connection, from whichever end states one."""
    outputs = {(c.name, v.name): v.unit for c in system.components for v in c.outputs}
    inputs = {(c.name, v.name): v.unit for c in system.components for v in c.inputs}
    return {c: outputs[c.source, c.output] or inputs[c.target, c.input] for c in system.connections}


def _axis(motion: str) -> str:
    """Of a motion by its name."""
    return next((axis for name, axis in ABOUT.items() if motion.endswith(name)), motion[-1])


def _place(connection: Connection) -> str:
    """Name of an output up to its last dot."""
    return connection.output.rpartition(".")[0]
