"""Our vehicle and track as FMUs, and an SSP file that wires them, at rest."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path

from railcosim.fmus.at_rest import heights_at_rest
from railcosim.fmus.content import Content, contents
from railcosim.fmus.description.about import Description
from railcosim.fmus.export import NATIVE, Runtime, packed
from railcosim.master.connections import Connection
from railcosim.master.fmi.description import describe_file
from railcosim.master.ssp import Part, write_ssp
from railcosim.track.closed_line import ClosedLine
from railcosim.track.local import LocalChange
from railcosim.track.parameters import Track
from railcosim.vehicle.parameters import Vehicle
from railcosim.vehicle.train import Train

from .numbering import through, vehicle_name

PAIR = "Pair.ssp"


def export_pair(
    vehicle: Vehicle | Train,
    track: Track,
    out: str | Path,
    progress: Callable[[str], None] = lambda text: None,
    *,
    runtime: Runtime = NATIVE,
    separate: bool = False,
    dimension: str = "vertical",
    changes: Sequence[LocalChange] = (),
    line: ClosedLine | None = None,
) -> dict[str, Path]:
    """Write our four FMUs, and Pair.ssp with Vehicle and TrackWithContact in it.

    The SSP is left out for FMI 3.0, as version 1.0 of SSP knows FMI 2.0, and where no track owns
    the contact: `railcosim.fmus.content.contents` says when there is none. Irregularity is no
    connector in it; it stays an input of the track's FMU, 0 unless set there.

    Parameters
    ----------
    vehicle, track, out, progress, runtime
        See `railcosim.fmus.export.export`.
    separate : bool
        Each vehicle of a train as FMUs of its own, Vehicle1 and VehicleWithContact1 and so on, and
        as a component of Pair.ssp; only the track joins them.
    dimension : str
        vertical or spatial, see `railcosim.mechanics.ports.OF_WHEELS`.
    changes : sequence of LocalChange
        What is different at single places of the track, see
        `railcosim.track.local_modes.with_changes`.
    line : ClosedLine or None
        Kinds of track that follow, the first of which is `track`.

    Returns
    -------
    dict
        FMU name to file.

    Raises
    ------
    CompilerMissing, CompilationFailed, CacheRefused, MixedExport
        See `railcosim.fmus.export.export`.
    """
    folder = Path(out)
    runtime.prepare(progress)
    made = contents(
        vehicle, track, progress, separate=separate, dimension=dimension, changes=changes, line=line
    )
    with packed(made, folder, progress, runtime=runtime) as files:
        if runtime.fmi == 2 and any(one.has_contact for one in made if one.name in files):
            progress("wiring the pair")
            _wire(made, files, folder / PAIR)
        return files


def _wire(made: Sequence[Content], files: dict[str, Path], target: Path) -> None:
    """Write vehicles and track, at rest."""
    vehicles = [one for one in made if one.model == "vehicle" and not one.has_contact]
    (track,) = [one for one in made if one.model == "track" and one.has_contact]
    rails = Part(name="track", description=describe_file(files[track.name]))
    cars, connections, ahead = [], list[Connection](), 0
    for number, (one, starts) in enumerate(
        zip(vehicles, heights_at_rest(vehicles, track), strict=True), start=1
    ):
        name = "vehicle" if len(vehicles) == 1 else vehicle_name(number)
        cars.append(Part(name=name, description=describe_file(files[one.name]), starts=starts))
        connections += _by_name(cars[-1], rails, number, ahead)
        ahead += one.body.layout.wheelsets
    write_ssp(target, [*cars, rails], connections, step=Description.step, stop=Description.stop)


def _by_name(vehicle: Part, track: Part, number: int, ahead: int) -> list[Connection]:
    """Outputs to inputs of their names, both ways; wheelsets behind others are numbered through."""
    ours, theirs = (
        {side: [v.name for v in getattr(part.description, side)] for side in ("inputs", "outputs")}
        for part in (vehicle, track)
    )
    to_track = [
        Connection(vehicle.name, name, track.name, there)
        for name in ours["outputs"]
        if (there := through(name, number, ahead)) in theirs["inputs"]
    ]
    to_vehicle = {through(name, number, ahead): name for name in ours["inputs"]}
    return to_track + [
        Connection(track.name, name, vehicle.name, to_vehicle[name])
        for name in theirs["outputs"]
        if name in to_vehicle
    ]
