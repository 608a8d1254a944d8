"""One variable of an FMU, and what is said of it."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import asdict, dataclass, field, replace

from railcosim.mechanics.ports import Port

from .roles import Role, Slot


@dataclass(frozen=True, kw_only=True)
class Scalar:
    """One FMI variable.

    Attributes
    ----------
    name, unit, description : str
        Unit as the XML's UnitDefinitions name it.
    role : Role
        What it is to the model.
    causality : str
        input, output, parameter or independent.
    index : int
        Of which wheelset, port or coordinate of the model it is, from 0.
    port : Port or None
        What it is a variable of.
    terminal : str
        In what terminal it is, if not in that of its port.
    quantity : str
        Last part of its name.
    variability : str
        continuous, fixed or tunable.
    type : str
        Real, Integer or Boolean.
    start : float, int, bool or None
        Start value of inputs and parameters.
    display_unit : str
        What people read it in, if not in `unit`.
    nominal : float
        A typical magnitude.
    minimum, maximum : float or None
        Allowed range.
    depends_on : tuple of str
        Inputs, parameters and time that an output depends on at once, the state being what it is.
    starts_from : tuple of str
        Those that it depends on in initialisation, where the state is the one at rest.
    """

    name: str
    unit: str
    description: str
    role: Role
    causality: str
    index: int = 0
    port: Port | None = None
    terminal: str = ""
    variability: str = "continuous"
    type: str = "Real"
    start: float | int | bool | None = None
    display_unit: str = ""
    nominal: float = 1.0
    minimum: float | None = None
    maximum: float | None = None
    depends_on: tuple[str, ...] = field(default=())
    starts_from: tuple[str, ...] = field(default=())

    @property
    def quantity(self) -> str:
        """Last part of its name."""
        return self.name.rpartition(".")[2]

    @property
    def slot(self) -> Slot:
        """What it is to the model."""
        return Slot(self.causality, self.role, self.index)

    def as_dict(self) -> dict[str, object]:
        """For the runtime's own copy of the table."""
        known = asdict(replace(self, port=None))
        del known["terminal"]
        return known


def names(table: Iterable[Scalar]) -> tuple[str, ...]:
    """Names of rows."""
    return tuple(v.name for v in table)
