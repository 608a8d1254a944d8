"""Tables of wheel and rail profiles that FMUs bring along, for whoever owns the contact."""

from __future__ import annotations

import json
import zipfile
from collections.abc import Sequence
from pathlib import Path

from railcosim.fmus.roles import PROFILES, Role
from railcosim.master.connections import CouplingError
from railcosim.master.fmi.description import describe_file
from railcosim.mechanics.contact.profiled import Profiled
from railcosim.mechanics.contact.profiles import ProfileError
from railcosim.mechanics.ports import wheelset_name

from .contact import ROLLING

LARGEST = 100_000_000  # bytes of a table


def profiles_told(fmu: Path) -> Profiled | None:
    """The table that an FMU tells or owns; None if its wheels are cones, or it tells nothing.

    Raises
    ------
    CouplingError
        If it is no table.
    """
    place = f"resources/{PROFILES}"
    with zipfile.ZipFile(fmu) as archive:
        if place not in archive.namelist():
            return None
        if archive.getinfo(place).file_size > LARGEST:
            raise CouplingError(f"{fmu}: {place} must be of at most {LARGEST} bytes")
        text = archive.read(place)
    try:
        return Profiled.of(json.loads(text))
    except (ProfileError, ValueError) as error:
        raise CouplingError(f"{fmu}: {place}: {error}") from error


def profiles_of(vehicles: Sequence[Path], track: Path | None = None) -> Profiled | None:
    """The one that FMUs of vehicles tell, and the track, if it owns the contact.

    Raises
    ------
    CouplingError
        If they differ: wheels of one law are alike.
    """
    found = {file: profiles_told(file) for file in (*vehicles, *([track] if track else []))}
    first = next((file for file, table in found.items() if table), None)
    if first is None:
        return None
    for file, table in found.items():
        others = table is not None and table.told() != found[first].told()  # type: ignore[union-attr]
        if others or (table is None and _tells_cones(file)):
            raise CouplingError(
                f"{file}: its wheels roll on other profiles than those of {first.name}; one law is "
                "of wheels that are alike: export them from the same parameters"
            )
    return found[first]


def _tells_cones(fmu: Path) -> bool:
    conicity = ROLLING[Role.CONICITY]
    return not {conicity, f"{wheelset_name(1)}.{conicity}"}.isdisjoint(
        describe_file(fmu).parameters
    )
