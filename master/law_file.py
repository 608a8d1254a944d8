"""A law between FMUs that are not connected, from a small TOML file: springs and dampers.

[[contact]]
stiffness = 50.0                                  # N/m, or any unit of force over one of motion
damping = 0.5                                     # by rates; left out where there is none
motion = { "left.z" = 1, "right.z" = -1 }         # outputs that add up to the compression
rate = { "left.vz" = 1, "right.vz" = -1 }         # the same of their rates, in the same order
force = { "left.force" = -1, "right.force" = 1 }  # inputs that get the force, times a factor
"""

from __future__ import annotations

import math
import tomllib
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from railcosim.master.component import Component, Type, Variable
from railcosim.master.connections import Connection, CouplingError
from railcosim.master.law import Law, Tangents
from railcosim.master.suggest import suggest

NAME = "law"
KEYS = ("stiffness", "damping", "motion", "rate", "force")
LARGEST = 1_000_000
"""Bytes of such a file."""


def read_law(path: Path, components: Sequence[Component]) -> tuple[Law, tuple[Connection, ...]]:
    """Read a law, and how it is connected to components.

    Parameters
    ----------
    path : Path
        The file.
    components : sequence of Component
        Whose outputs are its motions, and whose inputs its forces.

    Raises
    ------
    CouplingError
        Saying what is wrong with it.
    """
    contacts = [_Contact(path, k, table) for k, table in enumerate(_tables(path), start=1)]
    widths = {(len(one.force), bool(one.rate)) for one in contacts}
    if len(widths) != 1:
        raise CouplingError(
            f"{path}: all contacts must give as many forces, and all have a damping or none"
        )
    motions = list(dict.fromkeys(name for one in contacts for name in one.motion))
    rates = {b: a for one in contacts for a, b in zip(one.motion, one.rate, strict=bool(one.rate))}
    given = [*motions, *rates]
    rows = np.zeros((len(contacts), 2 if rates else 1, len(given)))
    for of_contact, one in zip(rows, contacts, strict=True):
        for row, part in zip(of_contact, (one.motion, one.rate), strict=False):
            for name, factor in part.items():
                row[given.index(name)] += factor
    by = np.array([np.outer(list(one.force.values()), one.numbers) for one in contacts])
    targets = [name for one in contacts for name in one.force]
    if len(set(targets)) < len(targets):
        twice = next(name for name in targets if targets.count(name) > 1)
        raise CouplingError(f"{path}: {twice} gets two forces; add them up in one contact")
    known = {c.name: c for c in components}
    outputs = {f"{c.name}.{v.name}": v for c in components for v in c.outputs}
    inputs = {f"{c.name}.{v.name}": v for c in components for v in c.inputs}
    law = Law(
        NAME,
        Tangents(by),
        [_like(path, name, outputs, "output") for name in given],
        [_like(path, name, inputs, "input") for name in targets],
        rows.reshape(-1, len(given)),
        contacts=len(contacts),
        rate_of=rates,
    )
    to_law = [Connection(*_apart(name, known), NAME, name) for name in given]
    from_law = [Connection(NAME, name, *_apart(name, known)) for name in targets]
    return law, (*to_law, *from_law)


class _Contact:
    """One table of the file, checked."""

    def __init__(self, path: Path, number: int, table: Any) -> None:
        where = f"{path}: contact {number}"
        if not isinstance(table, dict):
            raise CouplingError(f"{where}: must be a table, [[contact]]")
        for key in table:
            if key not in KEYS:
                raise CouplingError(f"{where}: no key {key!r}{suggest(key, KEYS)}")
        self.motion, self.rate, self.force = (
            _factors(f"{where}: {key}", table.get(key, {})) for key in ("motion", "rate", "force")
        )
        stiffness, damping = (
            _number(f"{where}: {key}", table.get(key, 0.0)) for key in ("stiffness", "damping")
        )
        if not self.motion or not self.force:
            raise CouplingError(f"{where}: needs motion and force, such as {{ 'a.z' = 1 }}")
        if stiffness == damping == 0.0:
            raise CouplingError(f"{where}: needs a stiffness or a damping, such as stiffness = 1e5")
        if damping and not self.rate:
            raise CouplingError(f"{where}: has a damping, and no rate")
        if self.rate and list(self.rate.values()) != list(self.motion.values()):
            raise CouplingError(f"{where}: rate must have the factors of motion, in their order")
        self.numbers = [stiffness, damping] if self.rate else [stiffness]


def _tables(path: Path) -> Sequence[Any]:
    if not path.is_file():
        raise CouplingError(f"{path}: no such file; give the path of a .toml file")
    try:
        if path.stat().st_size > LARGEST:
            raise CouplingError(f"{path}: has more than {LARGEST / 1e6:g} MB; refused")
        read = tomllib.loads(path.read_text(encoding="utf-8"))
    except (OSError, UnicodeDecodeError, tomllib.TOMLDecodeError) as error:
        raise CouplingError(f"{path}: cannot be read as TOML: {error}") from None
    tables = read.get("contact")
    if list(read) != ["contact"] or not isinstance(tables, list) or not tables:
        raise CouplingError(f"{path}: must hold tables [[contact]] and nothing else")
    return tables


def _factors(where: str, table: Any) -> dict[str, float]:
    if not isinstance(table, dict):
        raise CouplingError(f"{where} must be a table of factors, such as {{ 'a.z' = 1 }}")
    found = {str(name): _number(f"{where}, {name}", value) for name, value in table.items()}
    for name, value in found.items():
        if value == 0.0:
            raise CouplingError(f"{where}, {name} = 0: must be another number; or leave it out")
    return found


def _number(where: str, value: Any) -> float:
    if isinstance(value, bool) or not isinstance(value, int | float) or not math.isfinite(value):
        raise CouplingError(f"{where} = {value!r}: must be a finite number")
    return float(value)


def _like(path: Path, name: str, known: Mapping[str, Variable], kind: str) -> Variable:
    """A variable of the law, as the one it is connected to."""
    found = known.get(name)
    if found is None or found.type is not Type.REAL:
        raise CouplingError(f"{path}: there is no Real {kind} {name!r}{suggest(name, known)}")
    return Variable(name=name, unit=found.unit, nominal=found.nominal)


def _apart(name: str, components: Mapping[str, Component]) -> tuple[str, str]:
    """Component and variable; a component of a system in a system has dots in its name."""
    owner = max((c for c in components if name.startswith(f"{c}.")), key=len)
    return owner, name.removeprefix(f"{owner}.")
