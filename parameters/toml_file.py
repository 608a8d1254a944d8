"""A dataclass of parameter sets as a TOML file: one table a set, units and sources as comments."""

from __future__ import annotations

import difflib
import tomllib
import warnings
from collections.abc import Iterator, Mapping
from dataclasses import fields
from pathlib import Path
from typing import Any, TypeVar, get_type_hints

from .quantity import ParameterError, ParameterSet, check, quantity_of
from .usual import UnusualWarning

T = TypeVar("T")
SIZE_LIMIT = 1_000_000  # bytes; the files we write have a few thousand


def read_toml(kind: type[T], path: Path) -> T:
    """Read a file of parameters; what the file leaves out keeps its default.

    Parameters
    ----------
    kind : type
        A dataclass whose fields are all `ParameterSet`s.
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
    try:
        if path.exists() and not path.is_file():  # a device or a pipe may never end
            raise ParameterError(f"{path}: is no file; give a parameter file, TOML")
        if path.stat().st_size > SIZE_LIMIT:
            raise ParameterError(f"{path}: larger than {SIZE_LIMIT} bytes, not a parameter file")
        # Editors of some systems begin a file with a byte order mark.
        content = tomllib.loads(path.read_text(encoding="utf-8-sig"))
    except OSError as error:
        raise ParameterError(f"{path}: cannot be read: {error.strerror}") from error
    except (ValueError, RecursionError) as error:  # not UTF-8, not TOML, endless digits or brackets
        if isinstance(error, ParameterError):
            raise
        raise ParameterError(f"{path}: not a TOML file: {error}") from error
    try:
        read = from_tables(kind, content)
    except ParameterError as error:
        raise ParameterError(f"{path}: {error}") from error
    for doubt in _doubts(read, content):
        warnings.warn(f"{path}: {doubt}", UnusualWarning, stacklevel=2)
    return read


def _doubts(read: object, content: Mapping[str, Any]) -> Iterator[str]:
    """What is unusual among the numbers that the tables give."""
    for name, table in content.items():
        chosen = getattr(read, name)
        for declared in fields(chosen):
            known, value = quantity_of(declared), getattr(chosen, declared.name)
            if known.usual is not None and declared.name in table:
                doubt = known.usual.doubt(f"[{name}] {declared.name}", value, known.unit)
                if doubt is not None:
                    yield doubt


def from_tables(kind: type[T], content: Mapping[str, object]) -> T:
    """Build `kind` from tables of values, as `read_toml` does from a file."""
    hints = get_type_hints(kind)
    sets: dict[str, ParameterSet] = {}
    for name, table in content.items():
        if name not in hints:
            raise ParameterError(f"unknown table or key [{name}]{_meant(name, list(hints))}")
        if not isinstance(table, Mapping):
            raise ParameterError(f"{name} = {table!r}: must be a table, [{name}]")
        sets[name] = _parameter_set(hints[name], name, table)
    return kind(**sets)


def _parameter_set(kind: type[Any], name: str, table: Mapping[str, object]) -> Any:
    declared = {f.name: f for f in fields(kind)}
    for key, value in table.items():
        if key not in declared:
            raise ParameterError(f"[{name}] unknown key {key!r}{_meant(key, list(declared))}")
        try:
            check(declared[key], value)
        except ParameterError as error:
            raise ParameterError(f"[{name}] {error}") from error
    return kind(**table)


def _meant(word: str, allowed: list[str]) -> str:
    close = difflib.get_close_matches(word, allowed, n=1)
    return f"; did you mean {close[0]!r}?" if close else f"; allowed: {', '.join(allowed)}"


def write_toml(parameters: object, title: str) -> str:
    """Return the text of a parameter file, every key with its unit, range and source.

    Parameters
    ----------
    parameters : dataclass instance
        Its fields are all `ParameterSet`s.
    title : str
        First line, a comment.
    """
    lines = [f"# {title}", "# SI units. A key left out keeps the value printed here."]
    for section in fields(parameters):  # type: ignore[arg-type]  # any dataclass instance
        chosen = getattr(parameters, section.name)
        lines += ["", f"[{section.name}]"]
        for declared in fields(chosen):
            known = quantity_of(declared)
            value = getattr(chosen, declared.name)
            text = str(value).lower() if isinstance(value, bool) else repr(value)
            about = "true or false"
            if known.usual is not None:
                usual = f"usually {known.usual.low:g} to {known.usual.high:g}"
                about = f"{known.unit}, {known.allowed}, {usual}"
            lines += [
                f"# {known.description} ({about}; {known.source})",
                f"{declared.name} = {text}",
            ]
    return "\n".join(lines) + "\n"
