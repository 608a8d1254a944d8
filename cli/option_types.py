"""Options that several commands have: how each is spelt, and what its help says."""

from __future__ import annotations

from enum import StrEnum
from pathlib import Path
from typing import Annotated

import typer

VehicleFmus = Annotated[
    list[Path] | None,
    typer.Option(
        "--vehicle-fmu",
        help="Vehicle FMU; ours if not given. Several, from the front, if given again.",
        metavar="F",
    ),
]
TrackFmu = Annotated[
    Path | None,
    typer.Option("--track-fmu", help="Track FMU; ours if not given.", metavar="F"),
]
Out = Annotated[Path, typer.Option("--out", help="Result: .nc or .csv.", metavar="FILE")]
OutFile = Annotated[
    Path | None, typer.Option("--out", help="Result as well: .nc or .csv.", metavar="FILE")
]
PlotFile = Annotated[
    Path | None, typer.Option("--plot", help="Picture as well: .png, .svg or .pdf.", metavar="FILE")
]
Frequencies = Annotated[
    str,
    typer.Option(
        "--frequencies", help="start:stop:step in Hz, stop included, or start:stop:N@log."
    ),
]
ContactStiffness = Annotated[
    str, typer.Option("--contact-stiffness", help="Linear contact stiffness k_H, N/m.")
]
PositionOption = Annotated[
    float | None,
    typer.Option(
        "--position", help="Where the last wheelset stands, m; as the FMU has it if not given."
    ),
]
PositionsOption = Annotated[
    str | None,
    typer.Option(
        "--position",
        help="Where the last wheelset stands, m, or at a railseat or midspan of our track; of "
        "several vehicles that of each, such as 25.1,0.3. As the FMU has it if not given.",
        metavar="PLACE",
    ),
]
LocalOption = Annotated[
    list[str] | None,
    typer.Option(
        "--local",
        help="What is different at one place: how much of a fastening or a layer is left (0: "
        "it hangs), fastening@railseat+1=0, kg more on a rail, mass@1.2=15, or a gap in m that "
        "closes, in time, sleeper@railseat=gap:1e-3. PLACE is in m along the track, as --position. "
        "Repeat it for more.",
        metavar="CHANGE",
    ),
]
ThenOption = Annotated[
    list[str] | None,
    typer.Option(
        "--then",
        help="Another kind of track from X on, m: a file or a built-in one, such as "
        "ballasted@30, where a cell of the one before ends. Repeat it for more.",
        metavar="TRACK@X",
    ),
]
LawOption = Annotated[
    Path | None,
    typer.Option(
        "--law",
        help="Springs and dampers between the system's FMUs, in the master: a TOML file.",
        metavar="F.toml",
    ),
]
SystemOption = Annotated[
    Path | None,
    typer.Option("--system", help="Any system of FMUs instead, an SSP file.", metavar="F.ssp"),
]
SchedulerOption = Annotated[
    str | None,
    typer.Option(
        "--scheduler",
        help="Run on the workers of this dask scheduler, such as tcp://host:8786; on the cores "
        "of this machine if not given.",
        metavar="ADDRESS",
    ),
]
Speed = Annotated[float, typer.Option("--speed", help="km/h")]


class DimensionName(StrEnum):
    """How dimensions are spelt."""

    VERTICAL = "vertical"
    SPATIAL = "spatial"


DimensionOption = Annotated[
    DimensionName,
    typer.Option(
        "--dimension",
        metavar="NAME",
        help="Of our FMUs: spatial, where wheels roll on rails that move aside and turn as well; "
        "with --vehicle-fmu or --track-fmu theirs counts.",
    ),
]
