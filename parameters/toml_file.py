"""A dataclass of parameter sets as a TOML file: one table a set, units and sources as comments."""

from __future__ import annotations

import difflib
import tomllib
import warnings
import zipfile
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import fields, replace
from pathlib import Path
from typing import Any, TypeVar, get_args, get_origin, get_type_hints

from .quantity import (
    MOST_NUMBERS,
    ParameterError,
    ParameterSet,
    check,
    quantities,
    quantity_of,
)
from .usual import UnusualWarning

T = TypeVar("T")
SI_UNITS = "# SI units. A key left out keeps the value printed here."
SIZE_LIMIT = 1_000_000  # bytes; the files we write have a few thousand


def read_named(kind: type[T], source: Path, names: Sequence[str], folder: Path) -> T:
    """Read a file of parameters, or what is built in by name; see `read_toml`.

    Parameters
    ----------
    kind : type
        See `read_toml`; its name in small letters is what messages call it.
    source : Path
        A file, or one of the names.
    names : sequence of str
        Of what is built in: the first is all defaults, the others are files.
    folder : Path
        Where these are.
    """
    name = str(source)
    if name == names[0]:
        return kind()
    if name in names:
        return read_toml(kind, folder / f"{name}.toml")
    if source.suffix == "" and not source.exists():
        raise ParameterError(
            f"{source}: no such file, and no built-in {kind.__name__.lower()}; these are "
            f"{', '.join(names)}"
        )
    return read_toml(kind, source)


def read_toml(kind: type[T], path: Path) -> T:
    """Read a file of parameters; what the file leaves out keeps its default.

    Parameters
    ----------
    kind : type
        A dataclass whose fields are `ParameterSet`s, each a table of the file, or tuples of them,
        each an array of tables.
    path : Path
        The file.

    Returns
    -------
    object
        An instance of `kind`.

    Raises
    ------
    ParameterError
        One line with the file, the key, its value and what is allowed.

    Warns
    -----
    UnusualWarning
        For every number of the file that is not a usual one, with the unit it may be in.
    """
    content = tables_of(path)
    try:
        read = from_tables(kind, content)
    except ParameterError as error:
        raise ParameterError(f"{path}: {error}") from error
    for doubt in doubts(read, content):
        warnings.warn(f"{path}: {doubt}", UnusualWarning, stacklevel=2)
    return read


def tables_of(path: Path) -> dict[str, Any]:
    """Read a TOML file of bounded size.

    Raises
    ------
    ParameterError
        One line with the file and what is wrong with it.
    """
    try:
        if path.exists() and not path.is_file():  # a device or a pipe may never end
            raise ParameterError(f"{path}: is no file; give a parameter file, TOML")
        if path.stat().st_size > SIZE_LIMIT:
            raise ParameterError(f"{path}: larger than {SIZE_LIMIT} bytes, not a parameter file")
        if zipfile.is_zipfile(path):
            raise ParameterError(
                f"{path}: is a zip archive, such as an FMU; give the parameters it is made of, TOML"
            )
        # Editors of some systems begin a file with a byte order mark.
        return tomllib.loads(path.read_text(encoding="utf-8-sig"))
    except OSError as error:
        raise ParameterError(f"{path}: cannot be read: {error.strerror}") from error
    except (ValueError, RecursionError) as error:  # not UTF-8, not TOML, endless digits or brackets
        if isinstance(error, ParameterError):
            raise
        raise ParameterError(f"{path}: not a TOML file: {error}") from error


def doubts(read: object, content: Mapping[str, Any]) -> Iterator[str]:
    """What is unusual among the numbers that tables gave, one line each."""
    for name, given in content.items():
        chosen = getattr(read, name)
        if isinstance(chosen, tuple):
            for one, table in zip(chosen, given, strict=True):
                yield from _doubts_of_set(f"[[{name}]]", one, table)
        else:
            yield from _doubts_of_set(f"[{name}]", chosen, given)


def _doubts_of_set(place: str, chosen: ParameterSet, table: Mapping[str, Any]) -> Iterator[str]:
    for declared in fields(chosen):
        value = getattr(chosen, declared.name)
        if declared.name not in table:
            continue
        if isinstance(value, ParameterSet):
            yield from _doubts_of_set(f"{place} {declared.name}", value, table[declared.name])
            continue
        known = quantity_of(declared)
        for number in value if isinstance(value, tuple) else (value,):
            doubt = known.usual and known.usual.doubt(
                f"{place} {declared.name}", number, known.unit
            )
            if doubt:
                yield doubt


def from_tables(kind: type[T], content: Mapping[str, object]) -> T:
    """Build `kind` from tables of values, as `read_toml` does from a file."""
    hints = get_type_hints(kind)
    for name in content:
        if name not in hints:
            raise ParameterError(f"unknown table or key [{name}]{_meant(name, list(hints))}")
    whole = {  # first the sets: what an array's tables leave out is as they say
        name: _parameter_set(hint, f"[{name}]", content.get(name, {}), {})
        for name, hint in hints.items()
        if not _is_array(hint)
    }
    arrays = {
        name: _array(get_args(hints[name])[0], name, tables, whole)
        for name, tables in content.items()
        if _is_array(hints[name])
    }
    return kind(**whole, **arrays)


def _is_array(hint: object) -> bool:
    return get_origin(hint) is tuple


def _array(
    kind: type[Any], name: str, tables: object, whole: Mapping[str, ParameterSet]
) -> tuple[Any, ...]:
    if not isinstance(tables, list) or len(tables) > MOST_NUMBERS:
        raise ParameterError(
            f"{name}: must be an array of at most {MOST_NUMBERS} tables, each headed [[{name}]]"
        )
    return tuple(_parameter_set(kind, f"[[{name}]]", table, whole) for table in tables)


def _parameter_set(
    kind: type[Any], place: str, table: object, whole: Mapping[str, ParameterSet]
) -> Any:
    """A set from its table; a set within takes what its table leaves out from `whole`."""
    if not isinstance(table, Mapping):
        name = place.strip("[]")
        raise ParameterError(f"{name} = {table!r}: must be a table, {place}")
    declared = {f.name: f for f in quantities(kind)}
    within = {f.name: f for f in fields(kind) if f.name not in declared}
    values: dict[str, Any] = {}
    for key, value in table.items():
        if key in within:
            base = whole[key]
            inner = f"{place} {key}"
            changed = _parameter_set(type(base), inner, value, {})
            values[key] = replace(base, **{k: getattr(changed, k) for k in value})
            continue
        if key not in declared:
            allowed = [*declared, *within]
            raise ParameterError(f"{place} unknown key {key!r}{_meant(key, allowed)}")
        try:
            values[key] = check(declared[key], value)
        except ParameterError as error:
            raise ParameterError(f"{place} {error}") from error
    return kind(**values)


def _meant(word: str, allowed: list[str]) -> str:
    close = difflib.get_close_matches(word, allowed, n=1)
    return f"; did you mean {close[0]!r}?" if close else f"; allowed: {', '.join(allowed)}"


def write_toml(parameters: object, title: str, within: str = "") -> str:
    """Return the text of a parameter file, every key with its unit, range and source.

    A source is that of the default: beside another number the default is told as well.

    Parameters
    ----------
    parameters : dataclass instance
        Its fields are `ParameterSet`s, or tuples of them.
    title : str
        First line, a comment.
    within : str
        Name of the table that all tables are in; then there is no title.
    """
    lines = [] if within else [f"# {title}", SI_UNITS]
    for section in fields(parameters):  # type: ignore[arg-type]  # any dataclass instance
        chosen = getattr(parameters, section.name)
        name = f"{within}.{section.name}" if within else section.name
        if isinstance(chosen, tuple):
            for one in chosen:
                lines += _table(f"[[{name}]]", name, one)
        else:
            lines += _table(f"[{name}]", name, chosen)
    return "\n".join(lines) + "\n"


def _table(head: str, name: str, chosen: ParameterSet) -> list[str]:
    lines = ["", head]
    for declared in quantities(chosen):
        known, value = quantity_of(declared), getattr(chosen, declared.name)
        about = "a name" if isinstance(value, str) else "true or false"
        if isinstance(value, tuple):
            about = "names"
        if known.usual is not None:
            usual = f"usually {known.usual.low:g} to {known.usual.high:g}"
            about = f"{known.unit}, {known.allowed}, {usual}"
        source = known.source
        if value != declared.default and declared.default == declared.default:  # not if it is NaN
            source = f"{_text(declared.default)} if left out, {source}"
        lines += [
            f"# {known.description} ({about}; {source})",
            f"{declared.name} = {_text(value)}",
        ]
    within = {f.name: getattr(chosen, f.name) for f in fields(chosen)}
    for key, inner in within.items():
        if isinstance(inner, ParameterSet):
            lines += _table(f"[{name}.{key}]", f"{name}.{key}", inner)
    return lines


def _text(value: object) -> str:
    """As TOML has it."""
    if isinstance(value, tuple):
        return f"[{', '.join(map(_text, value))}]"
    return str(value).lower() if isinstance(value, bool) else repr(value)
