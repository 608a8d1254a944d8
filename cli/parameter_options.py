"""Parameters of vehicle and track as commands take them: files, built-in ones, numbers changed."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from railcosim.parameters import changed, keys_of, value_of
from railcosim.parameters.change import meant
from railcosim.track.names import BUILT_IN as TRACKS
from railcosim.vehicle.names import BUILT_IN, PAPER

from .fmus import FreshOption, fmus_of
from .option_types import TrackFmu, VehicleFmus
from .options import UsageError

if TYPE_CHECKING:
    from railcosim.track.closed_line import ClosedLine
    from railcosim.track.local import LocalChange
    from railcosim.track.parameters import Track
    from railcosim.vehicle.parameters import Vehicle
    from railcosim.vehicle.train import Train

VEHICLE, TRACK = "vehicle", "track"
VehicleFile = Annotated[
    Path | None,
    typer.Option(
        "--vehicle",
        help=f"Parameters of a vehicle or a train, TOML, or a built-in one: {', '.join(BUILT_IN)}.",
        metavar="F.toml",
    ),
]
Vehicles = Annotated[
    int, typer.Option("--vehicles", help="How many of it, one behind the other, coupled.")
]
TrackFile = Annotated[
    Path | None,
    typer.Option(
        "--track",
        help=f"Parameters of a track, TOML, or a built-in one: {', '.join(TRACKS)}.",
        metavar="F.toml",
    ),
]
SetOption = Annotated[
    list[str] | None,
    typer.Option(
        "--set",
        help="Change a number of vehicle or track, such as fastening.stiffness=6e7; repeat it for "
        "more.",
        metavar="KEY=VALUE",
    ),
]


@dataclass(frozen=True, kw_only=True)
class VehicleOptions:
    """Options of a command that takes a vehicle's parameters."""

    vehicle: VehicleFile = None
    vehicles: Vehicles = 1
    set_: SetOption = None

    def stock(self) -> Vehicle | Train:
        """The vehicle or train of a file, or the paper's vehicle; several of it; changed."""
        stock: Vehicle | Train = self._read[VEHICLE]
        return changed(stock, self._changes[VEHICLE])

    @cached_property
    def _read(self) -> dict[str, Any]:
        """As it is without changes."""
        return {VEHICLE: _vehicle_of(self.vehicle, self.vehicles)}

    @cached_property
    def _changes(self) -> dict[str, dict[str, object]]:
        return changes_of(self.set_, self._read)

    @property
    def tells_vehicle(self) -> str:
        """The option that says which vehicle, or something of it; empty if none does."""
        if self.vehicle is not None:
            return "--vehicle"
        return "--vehicles" if self.vehicles != 1 else _first(self._changes[VEHICLE])

    def check_wheels(self) -> None:
        """Refuse to say something of the wheels of a vehicle FMU, and not which vehicle it is."""
        if self.vehicle is None and self.tells_vehicle:
            raise UsageError(
                f"{self.tells_vehicle}: would change the paper's vehicle, not --vehicle-fmu; give "
                "the parameters of that with --vehicle as well, or leave it away"
            )


@dataclass(frozen=True, kw_only=True)
class TrackOptions:
    """Options of a command that takes a track's parameters."""

    track: TrackFile = None
    set_: SetOption = None

    def rails(self, span: float = 0.0) -> Track:
        """The track of a file, or the paper's, changed; its ring holds wheelsets so far apart, m.

        Its cells are as many as they need, and no fewer than usual, if nothing says how many.
        """
        from railcosim.track.decay import long_enough
        from railcosim.track.files import tells_cells

        read: Track = self._read[TRACK]
        track = changed(read, self._changes[TRACK])
        told = self.track is not None and tells_cells(self.track)
        if span == 0.0 or told or "mesh.cells" in self._changes[TRACK]:
            return track
        return long_enough(track, span)

    @cached_property
    def _read(self) -> dict[str, Any]:
        """As it is without changes."""
        return {TRACK: _track_of(self.track)}

    @cached_property
    def _changes(self) -> dict[str, dict[str, object]]:
        return changes_of(self.set_, self._read)

    def line(self, track: Track | None, then: Sequence[str] | None) -> ClosedLine | None:
        """A track and the kinds that follow it, as ``--then`` says, on a ring."""
        if not then or track is None:
            return None
        from railcosim.analysis.response.track_words import line_of
        from railcosim.track.closed_line import ClosedLine

        return ClosedLine(line=line_of(track, str(self.track or PAPER), then))

    @property
    def tells_track(self) -> str:
        """The option that says which track, or something of it; empty if none does."""
        return "--track" if self.track is not None else _first(self._changes[TRACK])


@dataclass(frozen=True, kw_only=True)
class PairOptions(TrackOptions, VehicleOptions):
    """Options of a command that takes both."""

    @cached_property
    def _read(self) -> dict[str, Any]:
        return {
            VEHICLE: _vehicle_of(self.vehicle, self.vehicles),
            TRACK: _track_of(self.track),
        }

    def pair(self) -> tuple[Vehicle | Train, Track]:
        """Vehicle, and the track with a ring that holds it."""
        from railcosim.vehicle.multibody import build_multibody

        stock = self.stock()
        places = build_multibody(stock).wheelset_x
        return stock, self.rails(float(places.max() - places.min()))


@dataclass(frozen=True, kw_only=True)
class FmuOptions(PairOptions):
    """Options of a command that takes FMUs, or parameters that ours are made of."""

    vehicle_fmu: VehicleFmus = None
    track_fmu: TrackFmu = None
    fresh: FreshOption = False

    @contextmanager
    def fmus(
        self,
        *names: str,
        dimension: str = "vertical",
        told: bool = False,
        local: Sequence[str] | None = None,
        then: Sequence[str] | None = None,
    ) -> Iterator[tuple[tuple[Path, ...], Path]]:
        """Vehicle and track FMUs, the user's or ours.

        Parameters
        ----------
        *names : str
            Of ours: of the vehicle's and the track's, if not Vehicle and Track.
        dimension : str
            Of ours.
        told : bool
            Whether the vehicle's parameters say something about a vehicle FMU as well.
        local : sequence of str
            What is different at single places of our track.
        then : sequence of str
            Kinds that follow it.
        """
        fmus = {
            "--vehicle-fmu": self.tells_vehicle if self.vehicle_fmu and not told else "",
            "--track-fmu": self._tells_rails(local, then) if self.track_fmu else "",
        }
        for fmu, option in fmus.items():
            if option:
                raise UsageError(f"{option}: is of parameters; {fmu} has its own. Leave one out")
        stock, rails = (None, None) if self.vehicle_fmu and self.track_fmu else self.pair()
        with fmus_of(
            self.vehicle_fmu, self.track_fmu, *names, stock=stock, rails=rails,
            dimension=dimension, fresh=self.fresh, changes=changes_at(rails, local),
            line=self.line(rails, then),
        ) as found:  # fmt: skip
            yield found

    def _tells_rails(self, local: Sequence[str] | None, then: Sequence[str] | None) -> str:
        others = {"--local": local, "--then": then}
        return self.tells_track or next((name for name, told in others.items() if told), "")


def changes_at(track: Track | None, texts: Sequence[str] | None) -> list[LocalChange]:
    """What ``--local`` says is different at single places of a track."""
    if not texts or track is None:
        return []
    from railcosim.analysis.response.track_words import change_of

    return [change_of(track, text) for text in texts]


def _vehicle_of(file: Path | None, count: int) -> Vehicle | Train:
    from railcosim.vehicle.files import read_stock

    return read_stock(file or Path(PAPER), count)


def _track_of(file: Path | None) -> Track:
    from railcosim.track.files import read_track

    return read_track(file or Path(PAPER))


def _first(changes: dict[str, object]) -> str:
    return next((f"--set {key}" for key in changes), "")


def changes_of(texts: Sequence[str] | None, of: dict[str, Any]) -> dict[str, dict[str, object]]:
    """Numbers of vehicle and track to change, from KEY=VALUE.

    A key may have ``vehicle.`` or ``track.`` in front, as it must where both have it.
    """
    known = {what: keys_of(one) for what, one in of.items()}
    found: dict[str, dict[str, object]] = {what: {} for what in of}
    for text in texts or ():
        key, equals, value = text.partition("=")
        key = key.strip()
        if not equals or not value.strip():
            raise UsageError(f"--set {text}: must be KEY=VALUE, such as fastening.stiffness=6e7")
        first, _, rest = key.partition(".")
        places = {first: rest} if first in known else dict.fromkeys(known, key)
        having = [what for what, name in places.items() if name in known[what]]
        if not having:
            every = [one for what in places for one in known[what]]
            name = next(iter(places.values()))
            raise UsageError(f"--set {text}: no such number{meant(name, every)}")
        if len(having) > 1:
            raise UsageError(
                f"--set {text}: vehicle and track both have it; say vehicle.{key} or track.{key}"
            )
        found[having[0]][places[having[0]]] = value_of(value.strip())
    return found
