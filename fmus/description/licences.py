"""documentation/licenses: under which conditions what is in an FMU may be used."""

from __future__ import annotations

from importlib.metadata import distribution
from importlib.resources import files

from .about import Capabilities


def licences(can: Capabilities, *, with_sources: bool) -> dict[str, bytes]:
    """Licence texts by file name; ``license.txt`` is where FMI says to begin."""
    here = files(__package__)
    texts = {"MIT.txt": here.joinpath("licence_mit.txt").read_bytes()}
    parts = ["This FMU is made by railcosim. All that is in it is under the MIT licence: MIT.txt"]
    if with_sources:
        texts["BSD-2-Clause.txt"] = here.joinpath("licence_fmi.txt").read_bytes()
        parts.append("sources/fmi*.h are FMI's, under the 2-clause BSD licence: BSD-2-Clause.txt")
    if can.needs_execution_tool:
        texts["pythonfmu.txt"] = _licence_of("pythonfmu").encode()
        parts.append("resources/pythonfmu and binaries are pythonfmu's: pythonfmu.txt")
    heads = [f"{parts[0]}, except that", *parts[1:]] if len(parts) > 1 else parts
    return {"license.txt": ("\n".join(heads) + "\n").encode(), **texts}


def _licence_of(package: str) -> str:
    """The licence file that a package was installed with."""
    found = [f for f in distribution(package).files or [] if f.name.upper().startswith("LICENSE")]
    return found[0].read_text() if found else f"See the licence of {package}.\n"
