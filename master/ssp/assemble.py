"""What an SSP says, held against what its FMUs are."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from railcosim.master.component import Component, Type, Variable
from railcosim.master.connections import Connection, CouplingError, check_types, element_pairs
from railcosim.master.fmi.archive import FmuError
from railcosim.master.fmi.fmu_parameters import Scalar
from railcosim.master.fmi.loaded_fmu import LoadedFmu
from railcosim.master.mapped_inputs import MappedInputs
from railcosim.master.ssp.structure import Start, Structure, Wire
from railcosim.master.suggest import suggest
from railcosim.master.units import IDENTITY, Linear, Table, UnitError, Units, fmu_units

_LARGEST = 2**31 - 1  # Integer


@dataclass(frozen=True, kw_only=True)
class LoadedSystem:
    """A system read from an SSP file, its parameters set.

    Attributes
    ----------
    name : str
        Of the system.
    fmus : tuple of LoadedFmu
        The FMUs, instantiated.
    components : tuple of Component
        The same for a `System`: where units differ or a connection has a factor, seen through
        `MappedInputs`; behind them a law in the master, if there is one.
    connections : tuple of Connection
        Between them.
    maps : dict of Connection to Linear
        What those connections do to a value that do anything.
    starts : dict of str to dict
        Component to values by variable, in the FMU's units: parameters, and inputs that start
        elsewhere than the FMU says.
    start, stop, step : float or None
        Default experiment, s; None where the file does not say.
    notes : tuple of str
        What of the file is not in the system, in sentences for the user.
    """

    name: str
    fmus: tuple[LoadedFmu, ...]
    components: tuple[Component, ...]
    connections: tuple[Connection, ...]
    maps: dict[Connection, Linear]
    starts: dict[str, dict[str, Scalar]]
    start: float | None
    stop: float | None
    step: float | None
    notes: tuple[str, ...]

    def joined_by(self, law: Component, connections: Sequence[Connection]) -> LoadedSystem:
        """The same with a law in the master."""
        return replace(
            self,
            components=(*self.components, law),
            connections=(*self.connections, *connections),
        )


def assemble(path: Path, structure: Structure, fmus: dict[str, LoadedFmu]) -> LoadedSystem:
    """Sort out connections and values by what the FMUs are, and set parameters.

    Parameters
    ----------
    path : Path
        The SSP, for messages.
    structure : Structure
        What it says.
    fmus : dict of str to LoadedFmu
        The components, instantiated.

    Raises
    ------
    FmuError
        For variables that are not there or of another kind, and units that do not fit.
    """
    units = {name: fmu_units(file) for name, file in structure.fmus.items()}
    for name, fmu in fmus.items():
        known = fmu.description.parameters
        lengths = {
            k: start.value
            for k, start in structure.starts[name].items()
            if k in known and known[k].is_structural and not isinstance(start.value, bytes)
        }
        if lengths:
            fmu.set_parameters(lengths)
    outputs = {name: {v.name: v for v in fmu.outputs} for name, fmu in fmus.items()}
    inputs = {name: {v.name: v for v in fmu.inputs} for name, fmu in fmus.items()}
    notes = list(structure.notes)
    maps: dict[Connection, Linear] = {}
    tables: dict[Connection, dict[float, float]] = {}
    for wire in _element_wise(path, structure.wires, outputs, inputs):
        output, input_ = outputs[wire.source].get(wire.output), inputs[wire.target].get(wire.input)
        if _is_text(wire, fmus):
            maps[Connection(wire.source, wire.output, wire.target, wire.input)] = IDENTITY
            continue
        if output is None:
            _check_other(path, wire, fmus[wire.source], wire.output, "output")
        if input_ is None:
            _check_other(path, wire, fmus[wire.target], wire.input, "input")
        if output is None or input_ is None:
            raise FmuError(f"{path}: {wire}: texts feed texts only; take the connection out")
        ends = units[wire.source], units[wire.target]
        changed = _changed(path, wire, output, input_, ends)
        connection = Connection(wire.source, wire.output, wire.target, wire.input)
        maps[connection] = changed if isinstance(changed, Linear) else IDENTITY
        if not isinstance(changed, Linear):
            tables[connection] = changed
    starts: dict[str, dict[str, Scalar]] = {name: {} for name in fmus}
    for name, fmu in fmus.items():
        starts[name] = _starts(path, structure, fmu, units[name], notes)
        known = {**fmu.description.parameters, **fmu.description.initials}
        fmu.set_parameters({k: v for k, v in starts[name].items() if k in known})
    return LoadedSystem(
        name=structure.name,
        fmus=tuple(fmus.values()),
        components=tuple(
            _seen(fmu, maps, tables, outputs, starts[fmu.name]) for fmu in fmus.values()
        ),
        connections=tuple(maps),
        maps={c: linear for c, linear in maps.items() if linear != IDENTITY},
        starts=starts,
        start=structure.start,
        stop=structure.stop,
        step=structure.step,
        notes=tuple(notes),
    )


def _changed(
    path: Path, wire: Wire, output: Variable, input_: Variable, units: tuple[Units, Units]
) -> Linear | dict[float, float]:
    """What becomes of a value on a wire: a function of Reals, or a table of other numbers."""
    try:
        linear = wire.way.linear(output.unit, units[0], input_.unit, units[1])
    except UnitError as error:
        raise FmuError(
            f"{path}: {wire}: {error}; define it in both, or suppress the conversion"
        ) from None
    if isinstance(linear, Table):
        try:
            return _table(linear, output, input_)
        except ValueError as error:
            raise FmuError(f"{path}: {wire}: {error}") from None
    try:
        check_types(str(wire), output, input_)
    except CouplingError as error:
        raise FmuError(f"{path}: {error}") from None
    if linear != IDENTITY and input_.type is not Type.REAL:
        raise FmuError(
            f"{path}: {wire}: a transformation or a conversion of units is for Real inputs; "
            f"this one is of type {input_.type.value}"
        )
    return linear


def _is_text(wire: Wire, fmus: Mapping[str, LoadedFmu]) -> bool:
    """Tell whether both ends are texts, or both bytes."""
    kind = fmus[wire.source].texts_out.get(wire.output)
    return kind is not None and kind == fmus[wire.target].texts_in.get(wire.input)


def _element_wise(
    path: Path,
    wires: Iterable[Wire],
    outputs: Mapping[str, Mapping[str, Variable]],
    inputs: Mapping[str, Mapping[str, Variable]],
) -> list[Wire]:
    """Wires with those of whole arrays as wires of their elements."""
    try:
        return [
            replace(wire, output=output, input=input_)
            for wire in wires
            for output, input_ in element_pairs(
                str(wire), (wire.output, outputs[wire.source]), (wire.input, inputs[wire.target])
            )
        ]
    except CouplingError as error:
        raise FmuError(f"{path}: {error}") from None


def _check_other(path: Path, wire: Wire, fmu: LoadedFmu, name: str, kind: str) -> None:
    """Refuse an end of a wire that is no Real one, unless it is an end of another type."""
    description = fmu.description
    causalities = description.other_names | dict.fromkeys(description.parameters, "parameter")
    if name not in causalities:
        raise FmuError(
            f"{path}: {wire}: the FMU of {fmu.name} has no {kind} {name!r}"
            f"{suggest(name, causalities)}"
        )
    if causalities[name] != kind:
        raise FmuError(
            f"{path}: {wire}: in the FMU of {fmu.name}, {name} is of causality "
            f"{causalities[name]}, not an {kind}"
        )


def _starts(
    path: Path, structure: Structure, fmu: LoadedFmu, units: Units, notes: list[str]
) -> dict[str, Scalar]:
    """Values for an FMU, in its own units, that it can be given."""
    description = fmu.description
    settable = {**description.parameters, **description.initials}
    known = {name: p.unit for name, p in settable.items()}
    inputs = {v.name: v.unit for v in fmu.inputs}
    starts: dict[str, Scalar] = {}
    for name, start in structure.starts[fmu.name].items():
        full = f"{fmu.name}.{name}"
        if name not in known and name not in inputs:
            causality = description.other_names.get(name)
            if causality is not None:
                raise FmuError(
                    f"{path}: {full} cannot be set: only parameters, inputs and variables with a "
                    f"start value of their own can be, and it is of causality {causality}"
                )
            hint = suggest(name, [*known, *inputs])
            notes.append(f"{full} is not set: its FMU has no such variable{hint}")
            continue
        unit = known.get(name, inputs.get(name, ""))
        try:
            linear = start.way.linear(start.way.unit, start.way.units, unit, units)
        except UnitError as error:
            raise FmuError(f"{path}: {full}: {error}") from None
        try:
            kind = settable[name].kind.name if name in settable else ""
            starts[name] = _converted(start, linear, kind)
            if name in inputs:
                _number(starts[name], next(v for v in fmu.inputs if v.name == name))
        except ValueError as error:
            raise FmuError(f"{path}: {full}: {error}") from None
    return starts


def _table(linear: Table, output: Variable, input_: Variable) -> dict[float, float]:
    """What a mapping makes of numbers; ValueError if it does not fit."""
    whole = {Type.INTEGER, Type.ENUMERATION}
    ends = {
        "Boolean": {Type.BOOLEAN}, "Integer": whole, "Enumeration": {Type.ENUMERATION},
    }[linear.kind]  # fmt: skip
    for variable in (output, input_):
        if variable.type not in ends:
            raise ValueError(
                f"a mapping of {linear.kind} values, and {variable.name} is {variable.type.value}"
            )
    found = linear.numbers(dict(output.items), dict(input_.items))
    for value in found.values():
        _number(value, input_)
    return found


def _converted(start: Start, linear: Linear | Table, kind: str) -> Scalar:
    """A value in the unit of its variable, whose kind is empty if it is an input."""
    if isinstance(start.value, bytes):
        if kind != "Binary" or linear != IDENTITY:
            raise ValueError(
                f"{start.value.hex()[:40]} is Binary, which only Binary takes as it is"
            )
        return start.value.hex()
    if isinstance(linear, Table):
        return linear.of(start.value)
    # A function that does nothing leaves whole numbers whole and Booleans Booleans.
    if linear == IDENTITY:
        return start.value
    if isinstance(start.value, str):
        raise ValueError(f"{start.value!r} is a text; nothing can be done to it on its way")
    return linear(start.value)


def _number(value: Scalar, variable: Variable) -> float:
    """Start value of an input as a system has it; ValueError if it cannot be."""
    kind, items = variable.type, dict(variable.items)
    if isinstance(value, str) and kind is Type.ENUMERATION:
        if value not in items:
            raise ValueError(f"has no item {value!r}; it has {', '.join(items)}")
        return float(items[value])
    if isinstance(value, str) or (isinstance(value, bool) and Type.BOOLEAN not in {kind}):
        raise ValueError(f"{value!r} is no {kind.value}")
    number = float(value)
    fits = {
        Type.REAL: math.isfinite(number),
        Type.INTEGER: number.is_integer() and abs(number) <= _LARGEST,
        Type.BOOLEAN: number in {0.0, 1.0},
        Type.ENUMERATION: number.is_integer() and (not items or number in items.values()),
    }
    if not fits[kind]:
        known = ", ".join(f"{name} = {of}" for name, of in items.items())
        raise ValueError(f"{value!r} is no {kind.value}" + (f"; it has {known}" if known else ""))
    return number


def _seen(
    fmu: LoadedFmu,
    maps: dict[Connection, Linear],
    tables: dict[Connection, dict[float, float]],
    outputs: dict[str, dict[str, Variable]],
    starts: dict[str, Scalar],
) -> Component:
    """An FMU as its neighbours see it."""
    sources = {c.input: c for c in maps if c.target == fmu.name}
    seen, linears = [], list[Linear | dict[float, float]]()
    for variable in fmu.inputs:
        connection = sources.get(variable.name)
        given = starts.get(variable.name)
        start = variable.start if given is None else _number(given, variable)
        if connection is None:
            seen.append(replace(variable, start=start))
            linears.append(IDENTITY)
        else:
            source = outputs[connection.source][connection.output]
            unit = variable.unit and (source.unit or variable.unit)
            seen.append(replace(variable, unit=unit, start=start))
            linears.append(tables.get(connection, maps[connection]))
    plain = all(linear == IDENTITY for linear in linears)
    if plain and [(v.unit, v.start) for v in seen] == [(v.unit, v.start) for v in fmu.inputs]:
        return fmu
    return MappedInputs(fmu, seen, linears)
