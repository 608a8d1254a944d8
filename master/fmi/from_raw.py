"""What coupling needs of a model description, from what FMPy has read of it."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from itertools import groupby
from typing import Any

import numpy as np
from numpy.typing import NDArray

from railcosim.master.component import Variable
from railcosim.master.fmi.kinds import Kind, Passed
from railcosim.master.fmi.variables import (
    Parameter,
    Sizes,
    parameters_of,
    read,
    scalars_of,
    size_of,
)


@dataclass(frozen=True)
class Clock:
    """A clock that an FMU wants to be told to tick.

    Attributes
    ----------
    name : str
        As in the model description.
    reference : int
        FMI value reference.
    variability : str
        What of its interval may change, as FMI calls it.
    interval : float or None
        s, if the description says it.
    shift : float
        First tick after the start, s.
    """

    name: str
    reference: int
    variability: str
    interval: float | None
    shift: float


def exchanged_of(variables: Iterable[Any], causality: str, kinds: Mapping[str, Kind]) -> list[Any]:
    """Inputs or outputs that take part in coupling, by what FMI function passes them."""
    order = {name: k for k, name in enumerate({kind.function: 0 for kind in kinds.values()})}
    numbers = {name: kind for name, kind in kinds.items() if kind.type is not None}
    found = [v for v in variables if v.causality == causality and v.type in numbers and not v.alias]
    return sorted(found, key=lambda v: order[numbers[v.type].function])


def scalars_of_all(
    variables: Iterable[Any], kinds: Mapping[str, Kind], sizes: Sizes
) -> tuple[Variable, ...]:
    """Variables as a system has them; an array is its elements."""
    scalars = tuple(s for v in variables for s in scalars_of(v, kinds[v.type], sizes))
    if len({s.name for s in scalars}) < len(scalars):
        name, _ = Counter(s.name for s in scalars).most_common(1)[0]
        raise ValueError(f"several variables are called {name!r}")
    return scalars


def passed_of(
    variables: Iterable[Any], kinds: Mapping[str, Kind], sizes: Sizes
) -> tuple[Passed, ...]:
    """What functions pass them; each once."""
    found, first = [], 0
    for function, group in groupby(variables, lambda v: kinds[v.type].function):
        some = [v for v in group if size_of(v, sizes)]
        lengths = tuple(size_of(v, sizes) for v in some)
        count = sum(lengths)
        if count:
            references = tuple(v.valueReference for v in some)
            c_type = kinds[some[0].type].c_type
            jumps = any(v.variability != "continuous" for v in some)
            found.append(Passed(function, c_type, references, lengths, first, count, jumps))
        first += count
    return tuple(found)


def named_of(
    variables: Iterable[Any], kinds: Mapping[str, Kind], sizes: Sizes
) -> tuple[dict[str, Parameter], dict[str, Parameter], dict[str, str]]:
    """Parameters, other variables that can be given a value, and causalities of all others."""
    parameters: dict[str, Parameter] = {}
    initials: dict[str, Parameter] = {}
    others: dict[str, str] = {}
    for v in variables:
        is_parameter = v.causality in {"parameter", "structuralParameter"}
        if not is_parameter:
            others[v.name] = v.causality
        if v.type not in kinds or not (is_parameter or _is_initial(v, kinds[v.type])):
            continue
        table = parameters if is_parameter else initials
        table |= {p.name: p for p in parameters_of(v, kinds[v.type], sizes)}
    return parameters, initials, others


def texts_of(
    variables: Iterable[Any], causality: str, kinds: Mapping[str, Kind]
) -> dict[str, Parameter]:
    """Inputs or outputs that are no numbers."""
    return {
        v.name: parameters_of(v, kinds[v.type], {})[0]
        for v in variables
        if v.causality == causality
        and v.type in kinds
        and kinds[v.type].type is None
        and not v.dimensions
        and not v.alias
    }


def _is_initial(variable: Any, kind: Kind) -> bool:
    """Tell whether a variable that is no parameter may be set before the initialisation."""
    if variable.causality == "independent" or variable.variability == "constant":
        return False
    if variable.causality == "input":
        return kind.type is None
    return variable.initial in {"exact", "approx"}


def can_interpolate(kind: Any, inputs: Iterable[Any]) -> bool:
    """Whether the inputs of a Co-Simulation FMU can change within a step.

    In FMI 3.0 those that one call sets: what is discrete among them may change at events only.
    """
    if getattr(kind, "providesIntermediateUpdate", False):
        reals = [v for v in inputs if v.type == "Float64"]
        return bool(reals) and all(
            v.intermediateUpdate and v.variability == "continuous" for v in reals
        )
    return bool(getattr(kind, "canInterpolateInputs", False))


def clocks_of(variables: Iterable[Any]) -> tuple[Clock, ...]:
    """The input clocks."""
    return tuple(
        Clock(v.name, v.valueReference, v.intervalVariability or "", v.intervalDecimal,
              v.shiftDecimal or 0.0)
        for v in variables
        if v.type == "Clock" and v.causality == "input" and not v.alias
    )  # fmt: skip


def default_of(experiment: Any, name: str) -> float | None:
    """Step or tolerance that a default experiment names, if it is one."""
    text = getattr(experiment, name, None)
    if text is None:
        return None
    value = read(text, f"{name} of the default experiment")
    return value if 0.0 < value < np.inf else None


def feedthrough_of(
    unknowns: Iterable[Any], inputs: list[Any], outputs: list[Any], sizes: Sizes
) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
    """Direct dependence of outputs on inputs, (n_outputs, n_inputs), and of which it is stated.

    Of an array all elements depend on what any of them does.
    """
    column, n_inputs = _places(inputs, sizes)
    row, n_outputs = _places(outputs, sizes)
    # FMI: a missing list of dependencies means "may depend on everything".
    matrix = np.ones((n_outputs, n_inputs), dtype=bool)
    stated = np.zeros(n_outputs, dtype=bool)
    for unknown in unknowns:
        i = row.get(unknown.variable.name)
        if i is None or unknown.dependencies is None:
            continue
        matrix[i], stated[i] = False, True
        for v in unknown.dependencies:
            if v.name in column:
                matrix[i, column[v.name]] = True
    matrix.flags.writeable = stated.flags.writeable = False
    return matrix, stated


def _places(variables: Iterable[Any], sizes: Sizes) -> tuple[dict[str, slice], int]:
    """Where the elements of each variable are among those of all, and how many there are."""
    places, end = {}, 0
    for v in variables:
        begin, end = end, end + size_of(v, sizes)
        places[v.name] = slice(begin, end)
    return places, end
