"""A measured curve as a file has it: columns by their names, each with its unit."""

from __future__ import annotations

import csv
import math
import re
from collections.abc import Collection, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import xarray as xr

from railcosim.master.component import FloatArray
from railcosim.master.files import load
from railcosim.master.linear.realisation import ComplexArray
from railcosim.parameters import ParameterError

FREQUENCY = ("frequency", "freq", "f", "third octave")
COHERENCE = ("coherence", "coh", "gamma2")
REAL, IMAGINARY = ("re", "real"), ("im", "imag", "imaginary")
MAGNITUDE = ("magnitude", "mag", "abs", "modulus", "amplitude")
PHASE = ("phase", "arg", "angle")
DECAY = "dB/m"
HEADER = (
    "its first line must name the columns with their units, such as frequency (Hz), real (m/N), "
    "imag (m/N), coherence (1); or magnitude (dB re 1 m/N), phase (deg); or vertical (dB/m)"
)
MOST_BYTES, MOST_ROWS = 50_000_000, 200_000
RESPONSE = re.compile(
    r"(?:dB re (?P<db>[0-9.eE+-]+) ?)?\(?(?P<of>m|mm|um|µm|nm|g)(?P<per>/s(?:2|\^2|²)?)?\)?/"
    r"(?P<by>N|kN)"
)
LENGTHS = {"m": 1.0, "mm": 1e-3, "um": 1e-6, "µm": 1e-6, "nm": 1e-9, "g": 9.80665}
FORCES = {"N": 1.0, "kN": 1e3}


@dataclass(frozen=True)
class Unit:
    """Of a frequency response.

    Attributes
    ----------
    order : int
        How often the motion is differentiated: 0 receptance, 1 mobility, 2 accelerance.
    factor : float
        In m, m/s, m/s2 per N.
    decibels : bool
        20 log10 of it, the factor being what it is relative to.
    """

    order: int
    factor: float
    decibels: bool

    @classmethod
    def of(cls, text: str) -> Unit | None:
        """Read ``m/N``, ``mm/s/kN``, ``(m/s2)/N``, ``g/N``, ``dB re 1e-6 m/N``; else None."""
        found = RESPONSE.fullmatch(text.strip())
        if found is None or (found["of"] == "g" and found["per"]):
            return None
        order = 2 if found["of"] == "g" else {None: 0, "/s": 1}.get(found["per"], 2)
        factor = LENGTHS[found["of"]] / FORCES[found["by"]]
        try:
            factor *= float(found["db"] or 1)
        except ValueError:
            return None
        return cls(order, factor, found["db"] is not None) if 0 < factor < math.inf else None


@dataclass(frozen=True, kw_only=True)
class Table:
    """Columns of numbers.

    Attributes
    ----------
    source : Path
        The file.
    columns : dict
        Numbers by name.
    units : dict
        By name; empty where the file has none.
    about : dict or None
        What a file of ours says besides, nothing if it is CSV; None: it is not ours.
    """

    source: Path
    columns: dict[str, FloatArray]
    units: dict[str, str]
    about: dict[str, object] | None = None

    def named(self, names: Collection[str]) -> str | None:
        """The column whose name, or its last part, is one of some; ParameterError if two are."""
        found = [
            name
            for name in self.columns
            if name.lower() in names or name.lower().rpartition(".")[2] in names
        ]
        if len(found) > 1:
            raise ParameterError(
                f"{self.source}: {' and '.join(found)}: which one? Leave the others out"
            )
        return found[0] if found else None

    def wrong(self, text: str) -> ParameterError:
        """What is said of the file."""
        return ParameterError(f"{self.source}: {text}")


def read_table(source: Path) -> Table:
    """Read a file of columns: ours, or anyone's CSV with commas, semicolons or tabs.

    Raises
    ------
    ParameterError
        With the file, the line and what is allowed.
    """
    try:
        if source.stat().st_size > MOST_BYTES:
            raise ParameterError(f"{source}: over {MOST_BYTES / 1e6:g} MB")
        if source.suffix == ".nc":
            return _ours(source)
        text = source.read_text(encoding="utf-8-sig")
    except (OSError, UnicodeDecodeError, ValueError) as error:
        if isinstance(error, ParameterError):
            raise
        raise ParameterError(
            f"{source}: cannot be read ({getattr(error, 'strerror', None) or error})"
        ) from error
    if text.startswith("# units: "):
        return _ours(source)
    return _anyones(source, [line for line in text.splitlines() if line.strip()])


def _ours(source: Path) -> Table:
    """What `railcosim.master.files.save` wrote; a complex variable as its parts."""
    try:
        found = load(source)
    except (OSError, ValueError, KeyError, StopIteration) as error:
        raise ParameterError(
            f"{source}: cannot be read ({getattr(error, 'strerror', None) or error})"
        ) from error
    if "frequency" not in found.coords:
        raise ParameterError(f"{source}: is of {', '.join(map(str, found.dims))}, not of frequency")
    columns = {"frequency": np.asarray(found["frequency"].values, float)}
    units = {"frequency": "Hz"}
    for name, variable in found.data_vars.items():
        if variable.dims == ("frequency",):
            for part, values in _parts(variable).items():
                columns[f"{name}{part}"] = values
                units[f"{name}{part}"] = str(variable.attrs.get("units", ""))
    about = {str(key): value for key, value in found.attrs.items()}
    return Table(source=source, columns=columns, units=units, about=about)


def _parts(variable: xr.DataArray) -> dict[str, FloatArray]:
    values = variable.values
    if np.iscomplexobj(values):
        return {".re": values.real, ".im": values.imag}
    return {"": np.asarray(values, float)}


def _anyones(source: Path, lines: Sequence[str]) -> Table:
    if len(lines) < 2 or len(lines) > MOST_ROWS:
        raise ParameterError(f"{source}: {len(lines)} lines; {HEADER}")
    between = next((one for one in ";\t," if one in lines[0]), ",")
    header = next(csv.reader([lines[0]], delimiter=between))
    cells = [_cell(text) for text in header]
    if any(_is_number(name) for name, _ in cells):
        raise ParameterError(f"{source}: {HEADER}")
    if len({name for name, _ in cells}) < len(cells):
        raise ParameterError(f"{source}: two columns have one name: {', '.join(header)}")
    rows = []
    for k, row in enumerate(csv.reader(lines[1:], delimiter=between), 2):
        # A comma is the decimal point of many, where it does not separate columns.
        texts = [cell.strip().replace(",", ".") if between != "," else cell for cell in row]
        if len(row) != len(cells) or not all(map(_is_number, texts)):
            raise ParameterError(
                f"{source}: line {k}: must be {len(cells)} finite numbers: {between.join(row)[:80]}"
            )
        rows.append([float(text) for text in texts])
    columns = dict(zip([name for name, _ in cells], np.array(rows).T, strict=True))
    return Table(source=source, columns=columns, units=dict(cells))


def _cell(text: str) -> tuple[str, str]:
    """Name and unit of ``name (unit)`` or ``name [unit]``."""
    found = re.fullmatch(r"\s*(.*?)\s*(?:\((.*)\)|\[(.*)\])?\s*", text)
    assert found is not None  # anything matches
    return found[1], (found[2] or found[3] or "").strip()


def _is_number(text: str) -> bool:
    try:
        return math.isfinite(float(text))
    except ValueError:
        return False


def response_of(table: Table, unit: str | None) -> ComplexArray | FloatArray:
    """Receptance in m/N that a table has: complex, or its magnitude alone.

    Parameters
    ----------
    table : Table
        Real and imaginary part; or magnitude and phase; or magnitude.
    unit : str, optional
        Of the response, where the file has none.

    Raises
    ------
    ParameterError
        If there is no such thing, or no unit.
    """
    real, imaginary = table.named(REAL), table.named(IMAGINARY)
    size, phase = table.named(MAGNITUDE), table.named(PHASE)
    omega = 2 * np.pi * frequency_of(table)
    if real and imaginary:
        known = _unit(table, real, unit)
        if known.decibels:
            raise table.wrong(f"{real}: parts of a complex number are in no decibels")
        values = table.columns[real] + 1j * table.columns[imaginary]
        found: ComplexArray = known.factor * values / (1j * omega) ** known.order
        return found
    if size is None:  # a single column, called as the field calls it
        others = [name for name in table.columns if Unit.of(table.units[name])]
        if len(others) != 1 or real or imaginary:
            raise table.wrong(f"no receptance and no decay rate found; {HEADER}")
        size = others[0]
    known = _unit(table, size, unit)
    given = table.columns[size]
    magnitude = known.factor * (10 ** (given / 20) if known.decibels else given)
    if phase is None:
        return np.asarray(magnitude / omega**known.order, float)
    in_radians = table.units[phase] == "rad"
    angle = table.columns[phase] if in_radians else np.deg2rad(table.columns[phase])
    turned: ComplexArray = magnitude * np.exp(1j * angle) / (1j * omega) ** known.order
    return turned


def _unit(table: Table, name: str, given: str | None) -> Unit:
    text = table.units[name] or given or ""
    known = Unit.of(text)
    if known is None:
        raise table.wrong(
            f"{name}: unit {text!r}: must be one such as m/N (receptance), m/s/N or mm/s/kN "
            "(mobility), m/s2/N or g/N (accelerance), dB re 1e-6 m/N; in the header, (m/N) behind "
            "the name, or by --unit"
        )
    return known


def frequency_of(table: Table) -> FloatArray:
    """Its frequencies, Hz; ParameterError if there are none."""
    name = table.named(FREQUENCY)
    if name is None:
        raise table.wrong(f"no column is called frequency; {HEADER}")
    factor = {"": 1.0, "Hz": 1.0, "kHz": 1e3}.get(table.units[name])
    if factor is None:
        raise table.wrong(f"{name}: unit {table.units[name]!r}: must be Hz or kHz")
    return factor * table.columns[name]
