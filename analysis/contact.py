"""The contact of wheel and rail, owned by the master."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from railcosim.fmus.content import contact_defaults
from railcosim.master.component import Variable
from railcosim.master.law import Law
from railcosim.vehicle.contact import ContactLaw, HertzContact, LinearContact
from railcosim.vehicle.parameters import Vehicle

WHEELSETS = [f"wheelset[{i}]" for i in (1, 2, 3, 4)]
WHEELS = [f"{w}.{side}" for side in ("left", "right") for w in WHEELSETS]
FORCES = [f"{wheel}.force_z" for wheel in WHEELS]
# With what sign a motion (downwards) adds to the compression. Where the rail's surface is low, by
# the irregularity, it is farther from the wheel.
MOTIONS = {"wheel_z": 1.0, "rail_z": -1.0, "irregularity_z": -1.0}


def law_of(parameters: Mapping[str, float | bool]) -> ContactLaw:
    """The law that the parameters of an FMU with contact describe; defaults as in our FMUs."""
    default = contact_defaults(Vehicle())
    if parameters.get("contact.nonlinear", True):
        return HertzContact(C=float(parameters.get("contact.hertz_coefficient", default.C)))
    return LinearContact(k_H=float(parameters.get("contact.stiffness", default.k_H)))


def contact_law(parameters: Mapping[str, float | bool]) -> Law:
    """Eight contacts as a component named ``contact``: motions of wheel and rail to forces."""
    motions = [
        Variable(name=f"{wheel}.{motion}", unit="m", nominal=1e-3)
        for wheel in WHEELS
        for motion in MOTIONS
    ]
    load = Vehicle().wheel_load
    forces = [
        Variable(
            name=name, unit="N", description="contact force, compression positive", nominal=load
        )
        for name in FORCES
    ]
    compression = np.kron(np.eye(len(WHEELS)), list(MOTIONS.values()))
    return Law("contact", law_of(parameters), motions, forces, compression)
