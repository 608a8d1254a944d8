"""Vehicles and trains from files, and those that are built in."""

from __future__ import annotations

import warnings
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path

from railcosim.mechanics.ports import MOST_WHEELSETS
from railcosim.parameters import (
    ParameterError,
    ParameterSet,
    UnusualWarning,
    Usual,
    doubts,
    from_tables,
    quantity,
    read_named,
    switch,
    tables_of,
    word,
    write_toml,
)

from .names import BUILT_IN, FOLDER
from .parameters import Coupler, Vehicle
from .properties import FileName
from .train import Train, TrainVehicle, train_of


@dataclass(frozen=True, kw_only=True)
class Entry(ParameterSet):
    """One [[vehicle]] of a train file; without a file, its own tables say what it is."""

    file: str = word("", "a file of this folder, or a built-in vehicle", source="a train file")
    count: int = quantity(
        1, "1", "how many of these", minimum=1, maximum=MOST_WHEELSETS,
        usual=Usual(1, MOST_WHEELSETS, "one to a whole train"), source="a train file",
    )  # fmt: skip
    reversed: bool = switch(False, "true: the rear in front", source="a train file")


@dataclass(frozen=True, kw_only=True)
class _TrainFile:
    coupler: Coupler = field(default_factory=Coupler)


def read_stock(source: str | Path, count: int = 1) -> Vehicle | Train:
    """Read a vehicle or a train.

    Parameters
    ----------
    source : str or Path
        A parameter file, or the name of a built-in vehicle, one of `BUILT_IN`.
    count : int
        How many of it, one behind the other.

    Returns
    -------
    Vehicle or Train
        A train if the file has a [[vehicle]], or there are several.

    Raises
    ------
    ParameterError
        One line with the file, the key, its value and what is allowed.

    Warns
    -----
    UnusualWarning
        For every number of a file that is not a usual one.
    """
    one = _read(Path(source))
    if count == 1:
        return one
    if not 1 < count <= MOST_WHEELSETS:
        raise ParameterError(f"{count} vehicles: must be 1 to {MOST_WHEELSETS}")
    train = train_of(one)
    return replace(train, vehicles=count * train.vehicles)


def read_vehicle(source: Path) -> Vehicle:
    """Read a single vehicle; see `read_stock`."""
    vehicle = read_named(Vehicle, source, BUILT_IN, FOLDER)
    return vehicle if str(source) in BUILT_IN else _beside(vehicle, source)


def _beside(vehicle: Vehicle, source: Path) -> Vehicle:
    """A vehicle whose profiles are looked for beside the file that names them."""
    rolling, folder = vehicle.rolling, source.parent
    wheel, rail = (FileName(n, folder) for n in (rolling.wheel_profile, rolling.rail_profile))
    return replace(vehicle, rolling=replace(rolling, wheel_profile=wheel, rail_profile=rail))


def _read(source: Path) -> Vehicle | Train:
    tables = tables_of(source) if source.is_file() and str(source) not in BUILT_IN else {}
    if "vehicle" not in tables:
        return read_vehicle(source)
    entries = tables.pop("vehicle")
    try:
        if not isinstance(entries, list) or len(entries) > MOST_WHEELSETS:
            raise ParameterError("vehicle: must be at most 64 tables, each headed [[vehicle]]")
        whole = from_tables(_TrainFile, tables)
        for doubt in doubts(whole, tables):
            warnings.warn(f"{source}: {doubt}", UnusualWarning, stacklevel=3)
        vehicles = [one for entry in entries for one in _entry(entry, source)]
        return Train(vehicles=tuple(vehicles), coupler=whole.coupler)
    except ParameterError as error:
        raise ParameterError(f"{source}: {error}") from error


def _entry(entry: object, source: Path) -> list[TrainVehicle]:
    """The vehicles that one [[vehicle]] says."""
    if not isinstance(entry, Mapping):
        raise ParameterError(f"vehicle = {entry!r}: must be a table, [[vehicle]]")
    own = {key: value for key, value in entry.items() if not isinstance(value, (Mapping, list))}
    tables = {key: value for key, value in entry.items() if key not in own}
    known = from_tables(_Entries, {"vehicle": own}).vehicle
    if known.file and tables:
        raise ParameterError(
            f"[[vehicle]] file = {known.file!r}: the file says what it is; leave out "
            f"[vehicle.{next(iter(tables))}]"
        )
    vehicle = (
        _of_file(known.file, source)
        if known.file
        else _beside(from_tables(Vehicle, tables), source)
    )
    for doubt in doubts(vehicle, tables):
        warnings.warn(f"{source}: [[vehicle]] {doubt}", UnusualWarning, stacklevel=3)
    return known.count * [TrainVehicle(vehicle=vehicle, reversed=known.reversed)]


@dataclass(frozen=True, kw_only=True)
class _Entries:
    vehicle: Entry = field(default_factory=Entry)


def _of_file(name: str, source: Path) -> Vehicle:
    """A vehicle that a train file names: one of its own folder, or below."""
    path = Path(name)
    if name not in BUILT_IN:
        folder = source.resolve().parent
        path = (folder / name).resolve()
        if not path.is_relative_to(folder):
            raise ParameterError(f"[[vehicle]] file = {name!r}: must be in the train file's folder")
        if path.is_file() and "vehicle" in tables_of(path):
            raise ParameterError(
                f"[[vehicle]] file = {name!r}: is a train itself; list its vehicles"
            )
    return read_vehicle(path)


def write_stock(stock: Vehicle | Train) -> str:
    """The text of a file that says what a vehicle or a train is."""
    if isinstance(stock, Vehicle):
        return write_toml(stock, "Vehicle")
    text = write_toml(_TrainFile(coupler=stock.coupler), "Train, from the front")
    for one in stock.vehicles:
        text += f"\n[[vehicle]]\nreversed = {str(one.reversed).lower()}\n"
        text += write_toml(one.vehicle, "", within="vehicle")
    return text
