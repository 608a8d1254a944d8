"""What an FMU says of itself: identity, interface, parameters, capabilities."""

from __future__ import annotations

import hashlib
from collections import Counter
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from itertools import groupby
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from railcosim.master.component import Type, Variable
from railcosim.master.fmi.archive import FmuError, description_of
from railcosim.master.fmi.flaws import read_raw
from railcosim.master.fmi.kinds import KINDS, Kind, Passed
from railcosim.master.fmi.variables import (
    MOST,
    Parameter,
    Sizes,
    parameters_of,
    read,
    scalars_of,
    size_of,
)

HOLD_PARAMETER = "input_hold"
"""Integer parameter by which an FMU lets its master choose a `Hold`."""

OF_STEP_PARAMETER = "derivatives_of_step"
"""Boolean parameter by which an FMU tells directional derivatives of its last step, not of the
communication point, where FMI 2.0 has them."""


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


@dataclass(frozen=True, kw_only=True)
class FmuDescription:
    """The part of a model description that coupling needs.

    Attributes
    ----------
    path : Path
        The FMU file.
    sha256 : str
        Digest of the file, to tell in a result which build was run.
    model_name, guid, version, generation_tool : str
        As in the model description; empty if not stated.
    model_identifier : str
        Stem of the shared library.
    fmi : int
        Major version of FMI.
    inputs, outputs : tuple of Variable
        Inputs and outputs by type: Real ones, whole numbers (enumerations as well), Boolean
        ones; of an array all elements. Texts and bytes take no part in coupling.
    passed_in, passed_out : tuple of Passed
        How they are set and got, in their order.
    clocks : tuple of Clock
        Its input clocks.
    feedthrough : array of bool, shape (n_outputs, n_inputs)
        Direct dependence, from the model structure.
    states_dependence : array of bool, shape (n_outputs,)
        Whether it lists what an output depends on; if not, that may be everything.
    parameters : dict of str to Parameter
        All parameters by name.
    texts_in, texts_out : dict of str to Parameter
        Inputs and outputs that are texts or bytes, by name; no arrays of them.
    initials : dict of str to Parameter
        What else can be given a value before the initialisation: its own start values, by name,
        and inputs that are Strings.
    other_names : dict of str to str
        The causality of every variable that is not a parameter.
    can_get_and_set_state, can_serialize_state : bool
        Capabilities.
    takes_any_step : bool
        Whether steps may differ in length (``canHandleVariableCommunicationStepSize``).
    can_interpolate_inputs : bool
        Whether Real inputs can go along polynomials over a step: by their derivatives, or set anew
        where the FMU asks for them within it.
    has_directional_derivatives, has_adjoint_derivatives, has_output_rates : bool
        Likewise.
    default_step : float or None
        Communication step (s) that suits it, if it names one.
    default_tolerance : float or None
        Relative error that it is made for, likewise.
    """

    path: Path
    fmi: int
    sha256: str
    model_name: str
    guid: str
    version: str
    generation_tool: str
    model_identifier: str
    inputs: tuple[Variable, ...]
    outputs: tuple[Variable, ...]
    passed_in: tuple[Passed, ...]
    passed_out: tuple[Passed, ...]
    clocks: tuple[Clock, ...]
    feedthrough: NDArray[np.bool_]
    states_dependence: NDArray[np.bool_]
    parameters: dict[str, Parameter]
    texts_in: dict[str, Parameter]
    texts_out: dict[str, Parameter]
    initials: dict[str, Parameter]
    other_names: dict[str, str]
    can_get_and_set_state: bool
    can_serialize_state: bool
    takes_any_step: bool
    can_interpolate_inputs: bool
    has_directional_derivatives: bool
    has_adjoint_derivatives: bool
    has_output_rates: bool
    default_step: float | None
    default_tolerance: float | None

    @property
    def real_inputs(self) -> int:
        """How many of the inputs are Real ones; they are the first."""
        return sum(v.type is Type.REAL for v in self.inputs)

    @property
    def real_outputs(self) -> int:
        """Likewise of the outputs."""
        return sum(v.type is Type.REAL for v in self.outputs)

    @property
    def has_hold_parameter(self) -> bool:
        """Whether the FMU can extrapolate and interpolate its inputs by itself."""
        parameter = self.parameters.get(HOLD_PARAMETER)
        return (
            parameter is not None
            and parameter.type == "Integer"
            and parameter.size == 1
            and parameter.variability in {"fixed", "tunable"}
        )

    @property
    def tells_step_derivatives(self) -> bool:
        """Whether the FMU can tell how outputs answer to inputs over a step."""
        parameter = self.parameters.get(OF_STEP_PARAMETER)
        return (
            self.has_directional_derivatives
            and parameter is not None
            and (parameter.type, parameter.variability) == ("Boolean", "tunable")
        )

    def as_attributes(self) -> dict[str, str]:
        """Identity of the FMU as flat strings, for the attributes of a result."""
        return {
            "file": self.path.name,
            "sha256": self.sha256,
            "model_name": self.model_name,
            "guid": self.guid,
            "version": self.version,
            "generation_tool": self.generation_tool,
        }


def read_description(path: Path, folder: Path, sizes: Sizes | None = None) -> FmuDescription:
    """Read an unpacked FMU's model description.

    Parameters
    ----------
    path : Path
        The FMU file.
    folder : Path
        Where it was unpacked.
    sizes : mapping of str to int, optional
        Structural parameters that do not keep their defaults.

    Returns
    -------
    FmuDescription
        Its content.

    Raises
    ------
    FmuError
        If it breaks the FMI schema, or the FMU offers no co-simulation.
    """
    raw = read_raw(path, folder)
    if raw.coSimulation is None:
        raise FmuError(f"{path}: no Co-Simulation in it; export it as FMI 2.0 Co-Simulation")
    return describe(path, raw, raw.coSimulation, sizes)


def describe_file(path: Path) -> FmuDescription:
    """Read an FMU's model description, and unpack nothing else.

    Raises
    ------
    FmuError
        As `unpack` and `read_description`.
    """
    with description_of(path) as folder:
        return read_description(path, folder)


def describe(path: Path, raw: Any, kind: Any, sizes: Sizes | None = None) -> FmuDescription:
    """What FMPy has read, for one kind of FMU: ``raw.coSimulation`` or ``raw.modelExchange``."""
    try:
        return _describe(path, raw, kind, sizes or {})
    except FmuError:
        raise
    except (ValueError, TypeError, AttributeError) as error:  # in a flawed description
        wrong = f"modelDescription.xml is not valid FMI {raw.fmiVersion}: {error}"
        raise FmuError(f"{path}: {wrong}") from None


def _describe(path: Path, raw: Any, kind: Any, sizes: Sizes) -> FmuDescription:
    """As `describe`; ValueError for numbers that are none."""
    kinds = KINDS[raw.fmiMajorVersion]
    inputs, outputs = (_exchanged(raw.modelVariables, way, kinds) for way in ("input", "output"))
    if sum(size_of(v, sizes) for v in raw.modelVariables) > MOST:
        raise ValueError(f"its variables have more than {MOST} elements")
    feedthrough, stated = _feedthrough(raw.outputs, inputs, outputs, sizes)
    parameters, initials, others = _named(raw.modelVariables, kinds, sizes)
    return FmuDescription(
        path=path,
        fmi=raw.fmiMajorVersion,
        sha256=hashlib.sha256(path.read_bytes()).hexdigest(),
        model_name=raw.modelName,
        guid=raw.guid,
        version=raw.version or "",
        generation_tool=raw.generationTool or "",
        model_identifier=kind.modelIdentifier,
        inputs=_scalars(inputs, kinds, sizes),
        outputs=_scalars(outputs, kinds, sizes),
        passed_in=_passed(inputs, kinds, sizes),
        passed_out=_passed(outputs, kinds, sizes),
        clocks=_clocks(raw.modelVariables),
        feedthrough=feedthrough,
        states_dependence=stated,
        parameters=parameters,
        texts_in=_texts(raw.modelVariables, "input", kinds),
        texts_out=_texts(raw.modelVariables, "output", kinds),
        initials=initials,
        other_names=others,
        can_get_and_set_state=kind.canGetAndSetFMUstate,
        can_serialize_state=kind.canSerializeFMUstate,
        takes_any_step=getattr(kind, "canHandleVariableCommunicationStepSize", True),
        can_interpolate_inputs=_can_interpolate(kind, inputs),
        has_directional_derivatives=kind.providesDirectionalDerivative,
        has_adjoint_derivatives=kind.providesAdjointDerivatives,
        has_output_rates=getattr(kind, "maxOutputDerivativeOrder", 0) >= 1,  # Co-Simulation's
        default_step=_default(raw.defaultExperiment, "stepSize"),
        default_tolerance=_default(raw.defaultExperiment, "tolerance"),
    )


def _exchanged(variables: Iterable[Any], causality: str, kinds: Mapping[str, Kind]) -> list[Any]:
    """Inputs or outputs that take part in coupling, by what FMI function passes them."""
    order = {name: k for k, name in enumerate({kind.function: 0 for kind in kinds.values()})}
    numbers = {name: kind for name, kind in kinds.items() if kind.type is not None}
    found = [v for v in variables if v.causality == causality and v.type in numbers and not v.alias]
    return sorted(found, key=lambda v: order[numbers[v.type].function])


def _scalars(
    variables: Iterable[Any], kinds: Mapping[str, Kind], sizes: Sizes
) -> tuple[Variable, ...]:
    """Variables as a system has them; an array is its elements."""
    scalars = tuple(s for v in variables for s in scalars_of(v, kinds[v.type], sizes))
    if len({s.name for s in scalars}) < len(scalars):
        name, _ = Counter(s.name for s in scalars).most_common(1)[0]
        raise ValueError(f"several variables are called {name!r}")
    return scalars


def _passed(
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
            found.append(Passed(function, c_type, references, lengths, first, count))
        first += count
    return tuple(found)


def _named(
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


def _texts(
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


def _can_interpolate(kind: Any, inputs: Iterable[Any]) -> bool:
    """Whether the inputs of a Co-Simulation FMU can change within a step."""
    if getattr(kind, "providesIntermediateUpdate", False):
        reals = [v for v in inputs if v.variability == "continuous"]
        return bool(reals) and all(v.intermediateUpdate for v in reals)
    return bool(getattr(kind, "canInterpolateInputs", False))


def _clocks(variables: Iterable[Any]) -> tuple[Clock, ...]:
    """The input clocks."""
    return tuple(
        Clock(v.name, v.valueReference, v.intervalVariability or "", v.intervalDecimal,
              v.shiftDecimal or 0.0)
        for v in variables
        if v.type == "Clock" and v.causality == "input" and not v.alias
    )  # fmt: skip


def _default(experiment: Any, name: str) -> float | None:
    """Step or tolerance that a default experiment names, if it is one."""
    text = getattr(experiment, name, None)
    if text is None:
        return None
    value = read(text, f"{name} of the default experiment")
    return value if 0.0 < value < np.inf else None


def _feedthrough(
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
