"""Wheels that roll in space: responses to irregularities down and aside."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import ClassVar

import numpy as np

from railcosim.analysis.pair.contact import Parameters
from railcosim.analysis.response.excitation import loads_of
from railcosim.analysis.response.frequency import coupled, response
from railcosim.analysis.response.models import Models
from railcosim.analysis.response.rolling_pair import rolling_of
from railcosim.master.component import FloatArray
from railcosim.master.linear.realisation import ComplexArray
from railcosim.master.linear.receptance import Response
from railcosim.master.progress import Progress
from railcosim.mechanics.contact.geometry import LEFT, RIGHT, Geometry
from railcosim.mechanics.ports import FORCE, IRREGULARITY, RAIL, ROUGH, WHEEL, Layout
from railcosim.parameters import ArgumentError
from railcosim.reference.contacts import Contacts, LinearRolling, Rolling
from railcosim.reference.frequency import Linearised, frequency_response, linearised
from railcosim.reference.monolithic import Monolithic
from railcosim.track.irregularity.quantities import QUANTITIES
from railcosim.vehicle.bodies import SPIN
from railcosim.vehicle.multibody import SPATIAL, Dimension, Multibody
from railcosim.vehicle.on_rails import Contacts as OnRails
from railcosim.vehicle.on_rails import rolling
from railcosim.vehicle.parameters import Vehicle
from railcosim.vehicle.rolling import geometry_of, rolling_law
from railcosim.vehicle.train import Train, train_of

from .held import FINE, Errors, apart


@dataclass(frozen=True)
class RollingWheels:
    """See `Held`: they creep at a speed and stay where they are.

    Attributes
    ----------
    stock : Vehicle or Train
        Whose wheels, all alike.
    speed : float
        m/s, above 0.
    fmu : Path
        The vehicle's, without contacts.

    Raises
    ------
    ArgumentError
        If vehicles of a train have other wheels than the first one.
    """

    stock: Vehicle | Train
    speed: float
    fmu: Path
    dimension: ClassVar[Dimension] = SPATIAL
    efforts: ClassVar[tuple[str, ...]] = ("force_z", "force_y")
    parameters: ClassVar[Parameters] = {}

    def __post_init__(self) -> None:
        for one in train_of(self.stock).vehicles:
            if _wheels(one.vehicle) != _wheels(self._first):
                raise ArgumentError(
                    "vehicle", None,
                    "its vehicles have different wheels; in space one system is made of "
                    "vehicles whose [wheelset] radius, [contact] and [rolling] are alike",
                )  # fmt: skip

    @property
    def title(self) -> str:
        """See `Held`."""
        return f"{3.6 * self.speed:g} km/h"

    @property
    def _first(self) -> Vehicle:
        return train_of(self.stock).vehicles[0].vehicle

    def contacts(self, mono: Monolithic) -> Contacts:
        """See `Held`."""
        vehicle, body = self._first, mono.body
        law = rolling_law(
            vehicle.rolling, vehicle.contact, radius=vehicle.wheelset.radius,
            side=np.repeat([LEFT, RIGHT], len(body.axles)), speed=self.speed,
        )  # fmt: skip
        return Rolling(replace(law, axle_inertia=_turning(body)))

    def errors(
        self, models: Models, mono: Monolithic, frequency: FloatArray, progress: Progress
    ) -> Errors:
        """See `Held`."""
        fine = np.geomspace(frequency[0], frequency[-1], FINE)
        contact = rolling_of(self.stock, [self.fmu], models.vehicle).at(self.speed)
        system, dense = (coupled(models, 2 * np.pi * f, contact) for f in (frequency, fine))
        linear = linearised(mono, LinearRolling(self._linear(mono.body)), models.positions)
        rough = np.stack([self._rough(system, models.positions, what) for what in QUANTITIES], -1)
        omega = 2 * np.pi * frequency
        x = frequency_response(mono, omega, linear, linear.loads @ rough, progress)
        errors: Errors = {}
        for column, excitation in enumerate(QUANTITIES):
            seen = observed(
                mono, linear, models.positions, omega, x[..., column], rough[..., column]
            )
            rows = system.rows(list(seen))
            ours, curve = (
                response(one, excitation, models.positions, self.speed) for one in (system, dense)
            )
            errors[excitation] = apart(seen, rows, (frequency, ours), (fine, curve))
        return errors

    def _linear(self, body: Multibody) -> OnRails:
        vehicle = self._first
        geometry: Geometry = geometry_of(
            vehicle.rolling, vehicle.contact, radius=vehicle.wheelset.radius
        )
        return rolling(body, (geometry,) * len(body.axles))(self.speed)

    def _rough(self, system: Response, positions: FloatArray, excitation: str) -> ComplexArray:
        """Irregularities of each contact, down and to the right, (n, contacts x 2)."""
        inputs, amplitudes = loads_of(system, excitation, positions, self.speed)
        order = Layout(len(positions), directions=ROUGH).names(IRREGULARITY)
        rough = np.zeros((len(amplitudes), len(order)), complex)
        rough[:, [order.index(name) for name in inputs]] = amplitudes
        return rough


def _wheels(vehicle: Vehicle) -> tuple[object, ...]:
    return vehicle.wheelset.radius, vehicle.contact, vehicle.rolling


def _turning(body: Multibody) -> FloatArray:
    """Inertia of the axles about themselves, of each contact, kg m2."""
    spins = [body.at(axle, SPIN) for axle in body.axles]
    return np.tile(np.diag(body.M)[spins], 2)


def observed(
    mono: Monolithic,
    linear: Linearised,
    positions: FloatArray,
    omega: FloatArray,
    x: ComplexArray,
    rough: ComplexArray,
) -> dict[str, ComplexArray]:
    """Outputs of the coupled FMUs by the unknowns x: bodies, first and last left wheel and rail."""
    names = [c for c in mono.body.coordinates if c.endswith((".z", ".y"))]
    bodies = [name for name in names if not name.startswith("wheelset")]
    found = {f"vehicle.{name}": x[:, mono.coordinate(name)] for name in bodies}
    layout = Layout(len(positions), directions=mono.directions)
    resting = linear.pushes @ linear.K @ linear.lowered
    force = linear.forces(omega, x[..., None])[..., 0] - (resting @ rough.T).T
    told = {
        "vehicle": (layout.names(WHEEL.motion), x @ mono.wheels.toarray().T),
        "track": (layout.names(RAIL.motion), x @ mono.rails(positions).toarray().T),
        "": (layout.names(FORCE), force),
    }
    wanted = {f"wheelset[{i}].left" for i in (1, len(positions))}
    for component, (ports, values) in told.items():
        for name, column in zip(ports, values.T, strict=True):
            wheel, _, what = name.rpartition(".")
            if wheel in wanted and what.endswith(("_z", "_y")):
                found[f"{component}.{name}".removeprefix(".")] = column
    return found
