"""The variables of every FMU: time, and how a step is made."""

from __future__ import annotations

from .roles import Role
from .scalar import Scalar

LEAST_SPEED = 0.1
"""Of wheels that creep, m/s. Creepages are velocities over the speed: standing wheels do not creep,
they hold."""
CREEPING_SPEED = (
    "speed of the wheels at the moment, forward; creepages are velocities over it, and axles turn "
    "as fast as wheels roll at it"
)


def time() -> Scalar:
    """The independent variable."""
    return Scalar(
        name="time",
        unit="s",
        description="simulation time",
        role=Role.TIME,
        causality="independent",
    )


def input_hold() -> Scalar:
    """How inputs go on over a step."""
    return Scalar(
        name="input_hold",
        role=Role.HOLD,
        unit="",
        type="Integer",
        causality="parameter",
        variability="tunable",
        start=0,
        minimum=0,
        maximum=2,
        description="inputs over a step: 0 held; 1 on the line through the last two values set; "
        "2 on the line to the value set, which is that at the end of the step",
    )


def derivatives_of_step() -> Scalar:
    """What directional derivatives in Co-Simulation are of.

    FMI 2.0 has them at the communication point, by what ModelStructure lists; a master that solves
    for forces at the end of a step needs to know what the step makes of them.
    """
    return Scalar(
        name="derivatives_of_step",
        role=Role.DERIVATIVES_OF_STEP,
        unit="",
        type="Boolean",
        causality="parameter",
        variability="tunable",
        start=False,
        description="directional derivatives in Co-Simulation: false: of outputs by inputs at "
        "once, at the communication point; true: of outputs at the end of the last step by the "
        "inputs over it",
    )


def internal_step() -> Scalar:
    """Of the stepping inside.

    At 250 km/h a wheel passes a tenth of an element in 0.1 ms, which costs 1e-4 of the swing of the
    rail's deflection (measured against 6 microseconds), a thirtieth of what coupling costs at that
    step. A contact inside costs 1e-3 of the swing of its force.
    """
    return Scalar(
        name="internal_step",
        role=Role.INTERNAL_STEP,
        unit="s",
        display_unit="ms",
        causality="parameter",
        variability="fixed",
        start=1e-4,
        minimum=1e-7,
        nominal=1e-4,
        description="longest internal step while wheels move or a contact force is solved for",
    )
