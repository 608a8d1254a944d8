"""What an SSP file says, with its nested systems made flat."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from railcosim.master.fmi.fmu_parameters import Scalar
from railcosim.master.units import IDENTITY, Linear, Table, UnitError, Units, conversion

NAMESPACE = "http://ssp-standard.org/SSP1/SystemStructure"
SSC = f"{{{NAMESPACE}Common}}"
SSD = f"{{{NAMESPACE}Description}}"
SSV = f"{{{NAMESPACE}ParameterValues}}"
SSM = f"{{{NAMESPACE}ParameterMapping}}"
SSB = f"{{{NAMESPACE}SignalDictionary}}"

MAIN = "SystemStructure.ssd"
FMU = "application/x-fmu-sharedlibrary"


@dataclass(frozen=True)
class Hop:
    """One connection on the way from an output, or from a value, to an input.

    Attributes
    ----------
    linear : Linear or Table
        Applied to what comes, after any conversion.
    unit : str
        Of the connector it leads to; empty if not stated.
    converts : bool
        Whether what comes is converted to that unit.
    """

    linear: Linear | Table
    unit: str
    converts: bool


@dataclass(frozen=True, kw_only=True)
class Way:
    """How a value changes on its way.

    Attributes
    ----------
    unit : str
        At its beginning; empty if not stated.
    units : Units
        Definitions for that one, and for those of the hops.
    hops : tuple of Hop
        First to last.
    """

    unit: str
    units: Units
    hops: tuple[Hop, ...] = ()

    def linear(
        self, source: str, source_units: Units, target: str, target_units: Units
    ) -> Linear | Table:
        """Compose everything, from a variable in one unit to a variable in another.

        A mapping of other values than Reals stands alone.

        Raises
        ------
        UnitError
            If units on the way do not fit.
        """
        tables = [hop.linear for hop in self.hops if isinstance(hop.linear, Table)]
        if tables:
            if len(tables) > 1 or any(h.linear not in (tables[0], IDENTITY) for h in self.hops):
                raise UnitError("a mapping comes together with another transformation")
            return tables[0]
        total = conversion(source, source_units, self.unit, self.units)
        unit, units = (self.unit, self.units) if self.unit else (source, source_units)
        for hop in self.hops:
            # A last connector that states no unit has that of its variable.
            is_open = hop is self.hops[-1] and not hop.unit
            goal, goal_units = (target, target_units) if is_open else (hop.unit, self.units)
            if hop.converts:
                total = total.then(conversion(unit, units, goal, goal_units))
            assert isinstance(hop.linear, Linear)
            total = total.then(hop.linear)
            if goal or not hop.converts:
                unit, units = goal, goal_units
        return total.then(conversion(unit, units, target, target_units))


@dataclass(frozen=True)
class Start:
    """A parameter or a start value as the file gives it.

    Attributes
    ----------
    value : float, int, bool, str or bytes
        The number, text, or name of an enumeration's item.
    way : Way
        To the variable.
    """

    value: Scalar | bytes
    way: Way


@dataclass(frozen=True, kw_only=True)
class Wire:
    """One output to one input.

    Attributes
    ----------
    source, output, target, input : str
        Component and variable, twice.
    way : Way
        Between them.
    """

    source: str
    output: str
    target: str
    input: str
    way: Way

    def __str__(self) -> str:
        return f"{self.source}.{self.output} -> {self.target}.{self.input}"


@dataclass(frozen=True, kw_only=True)
class Structure:
    """A system of FMUs.

    Attributes
    ----------
    name : str
        Of the system.
    fmus : dict of str to Path
        The unpacked SSP's FMU files by the name of the component.
    starts : dict of str to dict of str to Start
        Component to variable to start value.
    wires : tuple of Wire
        Connections, whatever the type of their variables.
    start, stop, step : float or None
        Default experiment, s; None where the file does not say.
    notes : tuple of str
        What was left out, in sentences for the user.
    """

    name: str
    fmus: dict[str, Path]
    starts: dict[str, dict[str, Start]]
    wires: tuple[Wire, ...]
    start: float | None
    stop: float | None
    step: float | None
    notes: tuple[str, ...]
