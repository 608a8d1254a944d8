"""Our vehicle and track as FMUs, and an SSP file that wires them, at rest."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from railcosim.fmus.at_rest import heights_at_rest
from railcosim.fmus.content import Content, contents
from railcosim.fmus.description.about import Description
from railcosim.fmus.export import NATIVE, Runtime, packed
from railcosim.master.connections import Connection
from railcosim.master.fmi.description import describe_file
from railcosim.master.ssp import Part, write_ssp
from railcosim.track.parameters import Track
from railcosim.vehicle.parameters import Vehicle
from railcosim.vehicle.train import Train

PAIR = "Pair.ssp"


def export_pair(
    vehicle: Vehicle | Train,
    track: Track,
    out: str | Path,
    progress: Callable[[str], None] = lambda text: None,
    *,
    runtime: Runtime = NATIVE,
) -> dict[str, Path]:
    """Write our four FMUs, and Pair.ssp with Vehicle and TrackWithContact in it.

    The SSP is left out for FMI 3.0: version 1.0 of SSP knows FMI 2.0. Irregularity is no connector
    in it; it stays an input of the track's FMU, 0 unless set there.

    Parameters
    ----------
    vehicle, track, out, progress, runtime
        See `railcosim.fmus.export.export`.

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
    made = {content.name: content for content in contents(vehicle, track, progress)}
    with packed(made.values(), folder, progress, runtime=runtime) as files:
        if runtime.fmi == 2:
            progress("wiring the pair")
            _wire(made, files, folder / PAIR)
        return files


def _wire(made: dict[str, Content], files: dict[str, Path], target: Path) -> None:
    """Write the pair, at rest."""
    cars = Part(
        name="vehicle",
        description=describe_file(files["Vehicle"]),
        starts=heights_at_rest(made["Vehicle"], made["TrackWithContact"]),
    )
    rails = Part(name="track", description=describe_file(files["TrackWithContact"]))
    connections = [*_by_name(cars, rails), *_by_name(rails, cars)]
    write_ssp(target, [cars, rails], connections, step=Description.step, stop=Description.stop)


def _by_name(source: Part, target: Part) -> list[Connection]:
    """Every output to the input of its name."""
    inputs = {v.name for v in target.description.inputs}
    names = [v.name for v in source.description.outputs if v.name in inputs]
    return [Connection(source.name, name, target.name, name) for name in names]
