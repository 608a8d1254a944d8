"""A track with single places that are different, under a vehicle, in the frequency domain.

The FMU's receptance at the wheels, and what the changes add to it by the finite elements of the
same ring: exact, without a model that is made anew.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike

from railcosim.fmus.sensor_variables import sensor_name
from railcosim.master.component import FloatArray, Variable
from railcosim.master.connections import CouplingError
from railcosim.master.linear.linear_form import LinearForm
from railcosim.master.linear.realisation import ComplexArray
from railcosim.mechanics.ports import FORCE, RAIL, SIDES, Layout, Z
from railcosim.track.cell import EVEN, build_cell
from railcosim.track.local import LocalChange
from railcosim.track.parameters import Track
from railcosim.track.receptance import Point, direct_receptance, ring_receptance
from railcosim.track.sensor_quantities import told_by
from railcosim.track.sensor_rows import PartAt, weighed

from .models import Models


@dataclass(frozen=True)
class ChangedTrack:
    """A linear model of a track, changed at single places; a `LinearForm`.

    Attributes
    ----------
    model : LinearForm
        Of the track that is equal everywhere.
    local : Local
        What is different.
    positions : array, shape (wheelsets,)
        Where the wheelsets stand, m.
    """

    model: LinearForm
    local: Local
    positions: FloatArray

    @property
    def name(self) -> str:
        """See `LinearForm`."""
        return self.model.name

    @property
    def inputs(self) -> tuple[Variable, ...]:
        """See `LinearForm`."""
        return self.model.inputs

    @property
    def outputs(self) -> tuple[Variable, ...]:
        """See `LinearForm`."""
        return self.model.outputs

    @property
    def standing(self) -> Mapping[str, float]:
        """See `LinearForm`."""
        return self.model.standing

    @property
    def rougher(self) -> ChangedTrack | None:
        """See `LinearForm`."""
        rougher = self.model.rougher
        return None if rougher is None else replace(self, model=rougher)

    @property
    def error_floor(self) -> FloatArray:
        """See `LinearForm`."""
        return self.model.error_floor

    def frequency_response(self, omega: ArrayLike) -> ComplexArray:
        """See `LinearForm`."""
        omega = np.atleast_1d(np.asarray(omega, dtype=np.float64))
        return self.model.frequency_response(omega) + self._added(omega)

    def _added(self, omega: FloatArray) -> ComplexArray:
        layout, local = Layout(len(self.positions)).down, self.local
        wheels = [
            Point(x=float(self.positions[port.wheelset - 1]), side=2 * SIDES.index(port.side) - 1)
            for port in layout.ports
        ]
        added = _seen(local.track, omega, wheels, local.changes)
        added -= _seen(local.track, omega, wheels, ())
        sensors = [f"{sensor_name(one.sensor)}.{one.name}" for one in told_by(local.track, (Z,))]
        rows, columns = (
            [names.index(v.name) for v in variables]
            for names, variables in (
                ([*layout.names(RAIL.motion), *sensors], self.outputs),
                (layout.names(FORCE), self.inputs),
            )
        )
        picked: ComplexArray = added[:, rows][:, :, columns]
        return picked


def _seen(
    track: Track, omega: FloatArray, wheels: list[Point], changes: Sequence[LocalChange]
) -> ComplexArray:
    """Motions of rails under wheels, and what sensors tell, by forces of the wheels."""
    told, cell = told_by(track, (Z,), changes), build_cell(track, EVEN)
    s: ComplexArray = (1j * omega).astype(complex)
    parts = [
        (one, weights, PartAt(one.row, k, one.row.place.on(track)))
        for one in told for k, (weights, _) in enumerate(one.row.parts(cell))
    ]  # fmt: skip
    H = ring_receptance(track, omega, wheels, [*wheels, *(at for *_, at in parts)], changes)
    seen = np.zeros((omega.size, len(told), len(wheels)), dtype=complex)
    for (one, weights, _), moved in zip(parts, np.moveaxis(H[:, len(wheels) :], 1, 0), strict=True):
        of = weighed(one.weights, s) * weighed(weights, s)
        seen[:, told.index(one)] += of[:, None] * moved
    return np.concatenate([H[:, : len(wheels)], seen], axis=1)


@dataclass(frozen=True)
class Local:
    """Single places of a track.

    Attributes
    ----------
    track : Track
        Parameters that the track FMU was made of.
    changes : sequence of LocalChange
        See `railcosim.analysis.response.track_words.change_of`.

    Raises
    ------
    ParameterError
        If there is nothing to change at a place.
    """

    track: Track
    changes: Sequence[LocalChange]

    def __post_init__(self) -> None:
        """Ask for a receptance at one frequency: what cannot be is refused before anything else."""
        here = [Point(x=0.0)]
        direct_receptance(self.track, np.array([1.0]), here, here, changes=self.changes)

    def under(self, models: Models) -> Models:
        """The same vehicle on the changed track.

        Raises
        ------
        CouplingError
            If the wheels meet the rails aside, too.
        """
        rails = models.track
        if rails is None:
            return models
        known = {*Layout(len(models.positions)).names(FORCE)}
        if any(v.name not in known for v in rails.inputs):
            raise CouplingError(
                f"{rails.name}: single places change in the vertical model only, for wheels that "
                "meet the rails downwards"
            )
        told = {**models.attributes, "local": " ".join(map(str, self.changes))}
        track = ChangedTrack(rails, self, models.positions)
        return replace(models, track=track, attributes=told)
