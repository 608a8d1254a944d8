"""All that travels in an FMU beside its description, binaries and resources."""

from __future__ import annotations

from collections.abc import Sequence

from railcosim.mechanics.contact.profiled import Profiled
from railcosim.mechanics.modal import ModalBody

from ..interface import Scalar
from .about import Description
from .build import build_description
from .drawing import signs, wheel_icon
from .kind import Kind
from .licences import licences
from .page import page, result_plot
from .reference import csv, reference_run, scheme
from .terminals import ICON, WHEEL, terminals_and_icons

EXECUTION_TOOL = """This FMU needs a Python 3 with numpy where it is imported, no railcosim.

The first python3 on the PATH must be the one with numpy. On Linux an importer that is not itself a
Python program must have Python's library loaded first, for instance
LD_PRELOAD=/usr/lib/x86_64-linux-gnu/libpython3.11.so.1.0, of the same version.
"""


def extras(
    about: Description,
    kind: Kind,
    table: Sequence[Scalar],
    body: ModalBody,
    *,
    fmi: int,
    parameters: str,
    model_exchange: bool = False,
    sources: Sequence[str] = (),
    profiles: Profiled | None = None,
) -> dict[str, bytes]:
    """Documentation, licences, reference data, terminals, icons, and how to build the sources.

    Parameters
    ----------
    about : Description
        Of the FMU.
    kind : Kind
        Of what it is one.
    table : sequence of Scalar
        Its interface.
    body : ModalBody
        Its model.
    fmi : int
        Version of FMI, 2 or 3.
    parameters : str
        Of the model inside, as text for people.
    model_exchange : bool
        Whether it shows its states.
    sources : sequence of str
        C files to be compiled, relative to ``sources/``; the packer adds them.
    profiles : Profiled, optional
        Of its wheels and rails.

    Returns
    -------
    dict
        Path in the archive to content.
    """
    run = reference_run(body, table, profiles)
    icon = kind.icon(table, body)
    found = {
        "terminalsAndIcons/terminalsAndIcons.xml": terminals_and_icons(
            table, below=kind.terminals_below
        ),
        f"documentation/{about.name}_in.csv": csv(run.time, run.inputs),
        f"documentation/{about.name}_ref.csv": csv(run.time, run.outputs),
        f"documentation/{about.name}_ref.txt": scheme(about.name, run, table).encode(),
        "documentation/index.html": page(
            about, kind, table, body, run, fmi=fmi, parameters=parameters,
            model_exchange=model_exchange, with_sources=bool(sources),
        ),
    }  # fmt: skip
    pictures = {
        f"terminalsAndIcons/{ICON}": icon,
        f"terminalsAndIcons/{WHEEL}": wheel_icon(),
        "documentation/diagram": signs(),
        "documentation/result": result_plot(run, table, body.layout),
    }
    for place, drawing in pictures.items():
        found |= {f"{place}.{ending}": content for ending, content in drawing.items()}
    if fmi == 2:  # where FMI 2.0 itself has the icon
        found["model.png"] = icon["png"]
    if about.capabilities.needs_execution_tool:
        found["documentation/externalDependencies.txt"] = EXECUTION_TOOL.encode()
    if sources:
        found["sources/buildDescription.xml"] = build_description(about.name, sources)
    texts = licences(about.capabilities, with_sources=bool(sources))
    return found | {f"documentation/licenses/{name}": text for name, text in texts.items()}
