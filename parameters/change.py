"""Numbers of parameters changed by their names, such as ``fastening.stiffness``."""

from __future__ import annotations

import difflib
import math
import tomllib
import warnings
from collections.abc import Iterator, Mapping
from dataclasses import Field, dataclass, fields, is_dataclass, replace
from typing import Any, TypeAlias, TypeVar

from .quantity import ParameterError, ParameterSet, Value, check, quantities, quantity_of
from .usual import UnusualWarning

T = TypeVar("T")
Path: TypeAlias = tuple[str | int, ...]


@dataclass(frozen=True)
class _Key:
    """What a key names: one number, of one set or of several that are alike."""

    declared: Field[Any]
    paths: list[Path]


def changed(parameters: T, changes: Mapping[str, object]) -> T:
    """Parameters with some numbers changed.

    Parameters
    ----------
    parameters : Vehicle, Train, Track or another dataclass instance
        Its fields are `ParameterSet`s, or tuples of them. It stays as it is.
    changes : mapping
        Value by key: ``table.name`` as in a file; of an array ``table[2].name``, counted from 1, or
        ``NAME.name`` of the one that is called so. In a train ``vehicles[2].table.name``;
        ``table.name`` is of all its vehicles.

    Returns
    -------
    object
        Of the same class. What must fit together is checked after all changes.

    Raises
    ------
    ParameterError
        Naming the key, the value and what is allowed.

    Warns
    -----
    UnusualWarning
        For every number that is not a usual one.
    """
    known = _keys(parameters)
    new: dict[Path, dict[str, Any]] = {}
    for key, value in changes.items():
        if key not in known:
            raise ParameterError(f"{key} = {value}: no such number{meant(key, list(known))}")
        declared = known[key].declared
        try:
            found = check(declared, value)
        except ParameterError as error:
            raise ParameterError(f"{key.rpartition('.')[0]}.{error}") from error
        for path in known[key].paths:
            new.setdefault(path, {})[declared.name] = found
        about = quantity_of(declared)
        for number in found if isinstance(found, tuple) else (found,):
            doubt = about.usual and about.usual.doubt(key, float(number), about.unit)
            if doubt:
                warnings.warn(doubt, UnusualWarning, stacklevel=2)
    whole: T = _rebuilt(parameters, (), new)
    return whole


def keys_of(parameters: object) -> list[str]:
    """All keys that `changed` takes."""
    return list(_keys(parameters))


def numbers_of(parameters: object) -> list[str]:
    """Keys of all that can be a little more or less: no whole numbers, switches, names, zeros.

    Each number once, by name where it has one and a number; what names several of a train is
    another one.
    """
    found: dict[tuple[Path, ...], str] = {}
    for key, one in _keys(parameters).items():
        values = [_at(parameters, (*path, one.declared.name)) for path in one.paths]
        if all(isinstance(value, float) and value for value in values):
            found[tuple((*path, one.declared.name) for path in one.paths)] = key
    return list(found.values())


def value_at(parameters: object, key: str) -> Value:
    """The number that a key names; ParameterError if there is none, or it names several."""
    known = _key(parameters, key)
    values: set[Value] = {_at(parameters, (*path, known.declared.name)) for path in known.paths}
    if len(values) > 1:
        raise ParameterError(f"{key}: names {len(values)} numbers; give one of them")
    return next(iter(values))


def unit_of(parameters: object, key: str) -> str:
    """Unit of the number that a key names, empty of a pure one."""
    unit = quantity_of(_key(parameters, key).declared).unit
    return "" if unit == "1" else unit


def limits_of(parameters: object, key: str) -> tuple[float, float]:
    """Between what the number that a key names may be; infinite where nothing bounds it."""
    about = quantity_of(_key(parameters, key).declared)
    low = [end for end in (about.above, about.minimum) if end is not None]
    return max(low, default=-math.inf), math.inf if about.maximum is None else about.maximum


def value_of(text: str) -> object:
    """A value as it is written in a file; what is not TOML is a name that lacks its quotes."""
    try:
        read = tomllib.loads(f"value = {text}")
    except tomllib.TOMLDecodeError:
        return text
    return read["value"] if list(read) == ["value"] else text


def meant(key: str, known: list[str]) -> str:
    """What a wrong key may mean: a key like it, those of its table, or of one of the tables."""
    table, _, name = key.rpartition(".")
    begun = [one for one in known if table and one.startswith(table) and one.endswith(f".{name}")]
    if len(begun) == 1:  # primary.stiffness_vertical
        return f"; did you mean {begun[0]}?"
    if close := difflib.get_close_matches(key, known, n=1, cutoff=0.8):
        return f"; did you mean {close[0]}?"
    if beside := [one for one in known if one.rpartition(".")[0] == table]:
        return f"; allowed: {', '.join(beside)}"
    tables = dict.fromkeys(one.rpartition(".")[0] for one in known)
    return f"; allowed: numbers of {', '.join(tables)}"


def _key(parameters: object, key: str) -> _Key:
    known = _keys(parameters)
    if key not in known:
        raise ParameterError(f"{key}: no such number{meant(key, list(known))}")
    return known[key]


def _at(of: Any, path: Path) -> Any:
    """What is at the end of a path."""
    for step in path:
        of = of[step] if isinstance(step, int) else getattr(of, step)
    return of


def _keys(parameters: object) -> dict[str, _Key]:
    known: dict[str, _Key] = {}
    for place, path, one in _sets(parameters, "", ()):
        for declared in quantities(one):
            key = known.setdefault(f"{place}.{declared.name}", _Key(declared, []))
            key.paths.append(path)
    return known


def _sets(of: object, within: str, path: Path) -> Iterator[tuple[str, Path, ParameterSet]]:
    """Sets of numbers by their places; those of an array by number and, if they have one, name."""
    for field in fields(of):  # type: ignore[arg-type]  # any dataclass instance
        chosen, here = getattr(of, field.name), (*path, field.name)
        if isinstance(chosen, tuple):
            for i, one in enumerate(chosen):
                names = (f"{field.name}[{i + 1}]", getattr(one, "name", ""))
                for name in filter(None, names):
                    yield from _inside(one, f"{within}{name}", (*here, i))
                if is_dataclass(one) and not isinstance(one, ParameterSet):
                    yield from _inside(one, within.rstrip("."), (*here, i))  # of all of them
        else:
            yield from _inside(chosen, f"{within}{field.name}", here)


def _inside(one: object, place: str, path: Path) -> Iterator[tuple[str, Path, ParameterSet]]:
    if isinstance(one, ParameterSet):
        yield place, path, one
        yield from _sets(one, f"{place}.", path)
    elif is_dataclass(one):  # a vehicle of a train: its place is that of the train
        for field in fields(one):
            inner = getattr(one, field.name)
            if is_dataclass(inner):
                yield from _sets(inner, f"{place}." if place else "", (*path, field.name))


def _rebuilt(of: Any, path: Path, new: Mapping[Path, dict[str, Any]]) -> Any:
    """The same with new values by the path of their set; what has none is not made again."""
    if isinstance(of, tuple):
        return tuple(_rebuilt(one, (*path, i), new) for i, one in enumerate(of))
    if not is_dataclass(of) or not any(place[: len(path)] == path for place in new):
        return of
    inner = {f.name: _rebuilt(getattr(of, f.name), (*path, f.name), new) for f in fields(of)}
    return replace(of, **inner | new.get(path, {}))  # type: ignore[type-var]
