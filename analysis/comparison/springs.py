"""Wheels on linear springs, down and up alone: responses to forces on a wheelset and on rails."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from railcosim.analysis.pair.contact import Parameters, Stiffness, contact_of
from railcosim.analysis.response.frequency import coupled, response
from railcosim.analysis.response.models import Models
from railcosim.master.component import FloatArray
from railcosim.master.linear.realisation import ComplexArray
from railcosim.master.progress import Progress
from railcosim.mechanics.law import LinearContact
from railcosim.reference.contacts import Contacts, Pressing
from railcosim.reference.frequency import frequency_response, linearised
from railcosim.reference.monolithic import Monolithic
from railcosim.vehicle.multibody import VERTICAL, Dimension

from .held import FINE, Errors, apart


@dataclass(frozen=True)
class Springs:
    """See `Held`.

    Attributes
    ----------
    k_H : float
        Stiffness, N/m.
    """

    k_H: float
    dimension: ClassVar[Dimension] = VERTICAL
    efforts: ClassVar[tuple[str, ...]] = ("force_z",)

    @property
    def parameters(self) -> Parameters:
        """See `Held`."""
        return contact_of(self.k_H)

    @property
    def title(self) -> str:
        """See `Held`."""
        return f"k_H = {self.k_H / 1e9:g} GN/m"

    def contacts(self, mono: Monolithic) -> Contacts:
        """See `Held`."""
        return Pressing(LinearContact(k_H=self.k_H))

    def errors(
        self, models: Models, mono: Monolithic, frequency: FloatArray, progress: Progress
    ) -> Errors:
        """See `Held`."""
        return frequency_errors(models, mono, self.k_H, frequency, progress)


def frequency_errors(
    models: Models, mono: Monolithic, k_H: Stiffness, frequency: FloatArray, progress: Progress
) -> Errors:
    """Relative errors, NaN within 1 % of an antiresonance, and where the response is not weak."""
    fine = np.geomspace(frequency[0], frequency[-1], FINE)
    stiffness = np.resize(k_H, len(mono.load))
    rails, positions = mono.rails(models.positions), models.positions
    last = len(positions)
    on_wheelset = np.asarray(mono.wheels[[last - 1]].toarray().T)
    on_rails = np.asarray(rails[[last - 1, 2 * last - 1]].sum(axis=0))[:, None]
    solved = frequency_response(
        mono,
        2 * np.pi * frequency,
        linearised(mono, Pressing(LinearContact(k_H=stiffness)), positions),
        np.hstack([on_wheelset, on_rails]),
        progress,
    )
    compression = (mono.wheels - rails).toarray()
    found: Errors = {}
    for column, what in enumerate(("force_z", "rail_force_z")):
        excitation = f"wheelset[{last}].{what}"
        system, dense = (coupled(models, 2 * np.pi * f, k_H) for f in (frequency, fine))
        ours, curve = (response(s, excitation, positions, 1.0) for s in (system, dense))
        direct = solved[:, :, column]
        references: dict[str, ComplexArray] = {
            output: direct[:, mono.coordinate(name)]
            for output, name in _observed(mono, last).items()
        }
        rail_z = direct @ rails.toarray().T
        force = stiffness * (direct @ compression.T)
        for i in sorted({1, last}):
            references[f"track.wheelset[{i}].left.rail_z"] = rail_z[:, i - 1]
            references[f"wheelset[{i}].left.force_z"] = force[:, i - 1]
        rows = system.rows(list(references))
        found[excitation] = apart(references, rows, (frequency, ours), (fine, curve))
    return found


def _observed(mono: Monolithic, last: int) -> dict[str, str]:
    """Outputs of the coupled FMUs, and the monolithic coordinates that are the same."""
    names = mono.body.coordinates
    bodies = [c for c in names if c.endswith(".z") and not c.startswith("wheelset")]
    wheels = {f"vehicle.wheelset[{i}].left.wheel_z": f"wheelset[{i}].z" for i in (1, last)}
    return {**{f"vehicle.{name}": name for name in bodies}, **wheels}
