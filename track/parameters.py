"""A track: its parts, and what must fit together."""

from __future__ import annotations

from dataclasses import dataclass, field, fields

from railcosim.parameters import ParameterError

from .layers import CONTINUOUS, SLEEPER, Layer, check_layers
from .properties import MOST_CELLS, Fastening, Foundation, Mesh, Rail, Slab
from .sensors import Sensor, check_sensors

__all__ = [
    "MOST_CELLS",
    "Fastening",
    "Foundation",
    "Layer",
    "Mesh",
    "Rail",
    "Sensor",
    "Slab",
    "Track",
]


@dataclass(frozen=True, kw_only=True)
class Track:
    """Everything about a track: two rails on fastenings, layers, slabs and their foundation.

    Attributes
    ----------
    rail, fastening, slab, foundation, mesh
        Properties, see each.
    layers : tuple of Layer
        From the top, between the fastenings and the slab, or the ground if there is none.
    sensor : tuple of Sensor
        Where something is seen of it in time and frequency, see `railcosim.track.sensors`.

    Raises
    ------
    ParameterError
        If railseats do not fit the cell, a slab carries no two rails, or nothing is where a sensor
        is. Whether the ring is long
        enough is known with the vehicle: see `railcosim.track.decay.check_ring`.

    References
    ----------
    Xu, L. & Lu, T. (2021), Int. J. Rail Transportation 9(4), 342-367,
    doi 10.1080/23248378.2020.1811170.
    """

    rail: Rail = field(default_factory=Rail)
    fastening: Fastening = field(default_factory=Fastening)
    slab: Slab = field(default_factory=Slab)
    foundation: Foundation = field(default_factory=Foundation)
    mesh: Mesh = field(default_factory=Mesh)
    layers: tuple[Layer, ...] = ()
    sensor: tuple[Sensor, ...] = ()

    def __post_init__(self) -> None:
        tables = [declared.name for declared in fields(self)]
        check_layers(self.layers, tables, self.rail.lateral_distance)
        self._check_lying()
        bays = self.cell_length / self.fastening.spacing
        if abs(bays - round(bays)) > 1e-6 or round(bays) < 1:
            raise ParameterError(
                f"[fastening] spacing = {self.fastening.spacing:g} m: must divide the cell, "
                f"slab.length + slab.joint = {self.cell_length:g} m (so {self.cell_length:g} m "
                "divided by 1, 2, 3, ...)"
            )
        if self.slab.present and self.rail.lateral_distance >= self.slab.width:
            raise ParameterError(
                f"[rail] lateral_distance = {self.rail.lateral_distance:g} m: must be < slab.width "
                f"= {self.slab.width:g} m"
            )
        if self.slab.present and self.slab.joint >= self.fastening.spacing:
            raise ParameterError(
                f"[slab] joint = {self.slab.joint:g} m: must be < fastening.spacing = "
                f"{self.fastening.spacing:g} m, or a railseat would hang over the joint"
            )
        for name in ("cells", "elements_per_bay"):
            if getattr(self.mesh, name) % 2:
                raise ParameterError(
                    f"[mesh] {name} = {getattr(self.mesh, name)}: must be an even number"
                )
        check_sensors(self)

    def _check_lying(self) -> None:
        """Whether all lies on something."""
        top = self.layers[0] if self.layers else None
        if self.fastening.continuous and top and top.kind != CONTINUOUS:
            raise ParameterError(
                f"[fastening] continuous: what is continuous cannot lie on {top.called}, a "
                f"{top.kind}; list something continuous above it, or set it to false"
            )
        if self.slab.present and not (self.foundation.stiffness or self.foundation.mounts):
            raise ParameterError(
                "[foundation] stiffness = 0 N/m3 and mounts = 0: a slab must lie on something"
            )
        if self.slab.present and not self.foundation.stiffness and self.foundation.mounts == 1:
            raise ParameterError(
                "[foundation] stiffness = 0 N/m3 and mounts = 1: a slab on one pair tips; at least "
                "2"
            )
        across = [(layer.called, layer.length) for layer in self.layers if layer.kind == SLEEPER]
        if self.foundation.mounts:
            across.append(("[foundation] mount_distance", self.foundation.mount_distance))
        for what, width in across:
            if self.slab.present and width > self.slab.width:
                raise ParameterError(
                    f"{what} = {width:g} m across: must be within slab.width = "
                    f"{self.slab.width:g} m"
                )

    @property
    def called(self) -> str:
        """What it is, in a word or two."""
        return "Slab track" if self.slab.present else "Track"

    @property
    def rails_tilt(self) -> bool:
        """Whether rails roll with slabs that bend, so that down and aside know of each other."""
        return self.slab.present and self.slab.tilts_rails

    @property
    def cell_length(self) -> float:
        """One slab with its joint, m; a bay where there are no slabs but layers."""
        if not self.slab.present and (self.layers or self.fastening.continuous):
            return self.fastening.spacing
        return self.slab.length + self.slab.joint

    @property
    def bays(self) -> int:
        """Railseats of one rail in one cell."""
        return round(self.cell_length / self.fastening.spacing)

    @property
    def length(self) -> float:
        """Length of the ring, m."""
        return self.cell_length * self.mesh.cells
