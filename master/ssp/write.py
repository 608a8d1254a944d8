"""Writing a system of FMUs as one SSP file.

Any importer of SSP runs it as it is. What several of them do not bear is left out: libcosim and
ecos refuse connectors of the system itself, and FMPy feeds an input connector that nothing is
connected to from a wrong source. So inputs that nothing feeds have no connector.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path

from railcosim.master.connections import Connection, CouplingError
from railcosim.master.ssp.structure import MAIN
from railcosim.master.ssp.structure_xml import Experiment, Part, structure_xml
from railcosim.master.suggest import suggest
from railcosim.master.units import IDENTITY, Linear
from railcosim.storage.archive import write_archive


def write_ssp(
    target: Path,
    parts: Sequence[Part],
    connections: Iterable[Connection],
    maps: Mapping[Connection, Linear] | None = None,
    *,
    start: float = 0.0,
    stop: float | None = None,
    step: float | None = None,
    version: str = "1.0",
) -> Path:
    """Write a system with its FMUs in it.

    Parameters
    ----------
    target : Path
        The ``.ssp`` file, replaced if it is there.
    parts : sequence of Part
        With different names.
    connections : iterable of Connection
        From part to part.
    maps : mapping of Connection to Linear, optional
        What connections do to a value, conversions of units included.
    start, stop : float, optional
        Default experiment, s.
    step : float, optional
        Communication step, s. SSP has no place for it; it goes to annotations of libcosim's and
        OMSimulator's.
    version : str, optional
        Of SSP: ``1.0``, which all tools read, or ``2.0``, whose types are those of FMI 3.0.

    Returns
    -------
    Path
        `target`.

    Raises
    ------
    CouplingError
        If a connection or a start value is of something that no part has.
    """
    wiring = {c: (maps or {}).get(c, IDENTITY) for c in connections}
    _check(parts, wiring)
    sources = _sources(parts)
    experiment = Experiment(start=start, stop=stop, step=step)
    text = structure_xml(target.stem, parts, wiring, sources, experiment, version)
    fmus = {source: path.read_bytes() for path, source in sources.items()}
    write_archive(target, {MAIN: text, **fmus})
    return target


def _check(parts: Sequence[Part], connections: Iterable[Connection]) -> None:
    """Refuse what an importer would refuse later."""
    if len({part.name for part in parts}) < len(parts):
        raise CouplingError(f"component names must differ, got {', '.join(p.name for p in parts)}")
    outputs = {p.name: [v.name for v in p.description.outputs] for p in parts}
    inputs = {p.name: [v.name for v in p.description.inputs] for p in parts}
    for c in connections:
        _check_end(c, "output", c.source, c.output, outputs)
        _check_end(c, "input", c.target, c.input, inputs)
    for part in parts:
        known = [*inputs[part.name], *part.description.parameters, *part.description.initials]
        for name in part.starts:
            if name not in known:
                raise CouplingError(
                    f"{part.name} has no parameter or input {name!r}{suggest(name, known)}"
                )
            if isinstance(part.starts[name], str) and part.types()[name] == "Real":
                raise CouplingError(f"{part.name}.{name} is a Real; {part.starts[name]!r} is none")


def _check_end(
    c: Connection, kind: str, owner: str, name: str, known: Mapping[str, Sequence[str]]
) -> None:
    """Refuse a connection with an end that no part has."""
    if owner not in known:
        hint = suggest(owner, known)
        raise CouplingError(f"{c}: {owner} is no FMU of this system; SSP holds FMUs only{hint}")
    if name not in known[owner]:
        hint = suggest(name, known[owner])
        raise CouplingError(f"{c}: {owner} has no {kind} {name!r}{hint}")


def _sources(parts: Sequence[Part]) -> dict[Path, str]:
    """Where each FMU goes; a file keeps its name unless another one has it."""
    sources: dict[Path, str] = {}
    for part in parts:
        path = part.description.path
        if path not in sources:
            name = f"resources/{path.name}"
            taken = name in sources.values()
            sources[path] = f"resources/{len(sources)}/{path.name}" if taken else name
    return sources
