"""railcosim plot."""

from __future__ import annotations

from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from .options import UsageError
from .results import Suffixes, draw

if TYPE_CHECKING:
    import xarray as xr

PICTURE = Suffixes("--out", (".png", ".svg", ".pdf"))
RESULTS = (".nc", ".csv")


class Way(StrEnum):
    """What is made of the curves; see `railcosim.analysis.overlay.WAYS`."""

    ITSELF = "itself"
    SPECTRUM = "spectrum"
    THIRD_OCTAVES = "third-octaves"
    DIFFERENCE = "difference"
    RATIO = "ratio"


def plot(
    results: Annotated[
        list[Path], typer.Argument(help="What commands wrote: .nc or .csv.", metavar="RESULT...")
    ],
    output: Annotated[
        list[str],
        typer.Option(
            "--output", help="Variable that all have. Repeat it for more.", metavar="NAME"
        ),
    ],
    out: Annotated[
        Path, typer.Option("--out", help="Picture: .png, .svg or .pdf.", metavar="FILE")
    ],
    as_: Annotated[
        list[Way] | None,
        typer.Option(
            "--as",
            metavar="WAY",
            help=f"What is made of them: {', '.join(Way)}. spectrum: densities by Welch; "
            "third-octaves: RMS, of responses their quadratic mean; difference: less the first "
            "result; ratio: over it, dB. Of several, one after the other.",
        ),
    ] = None,
    title: Annotated[str, typer.Option("--title", help="Above the picture.")] = "",
) -> None:
    """Draw variables of several results together: as they are, spectra, third octaves, differences.

    Complex responses are drawn as magnitude and phase, sweeps as a curve for each point. Results
    at other places than the first's are interpolated to them for a difference, which is said.
    """
    from railcosim.analysis.overlay import WAYS, lines_of

    from .overlay_chart import overlay_chart

    PICTURE.check(out)
    lines = lines_of(_read(results), list(dict.fromkeys(output)))
    for way in as_ or ():
        lines = WAYS[way](lines)
    draw(overlay_chart(lines, title), out)


def _read(paths: list[Path]) -> dict[str, xr.Dataset]:
    """Results by the shortest of their names that tell them apart."""
    from railcosim.master.files import load

    for k in (1, 2, 3):
        names = ["/".join(path.absolute().parts[-k:]) for path in paths]
        if len(set(names)) == len(paths):
            break
    else:
        names = list(map(str, paths))
    if len(set(names)) < len(paths):
        raise UsageError(f"{' '.join(map(str, paths))}: a result is given twice")
    found = {}
    for name, path in zip(names, paths, strict=True):
        if path.suffix not in RESULTS:
            raise UsageError(f"{path}: must end in {' or '.join(RESULTS)}")
        try:
            found[name] = load(path)
        except (OSError, ValueError) as error:
            raise UsageError(
                f"{path}: cannot be read: {getattr(error, 'strerror', None) or error}"
            ) from error
    return found
