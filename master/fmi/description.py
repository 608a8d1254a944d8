"""What an FMU says of itself: identity, interface, parameters, capabilities."""

from __future__ import annotations

import hashlib
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from railcosim.master.component import Type, Variable
from railcosim.master.fmi.archive import FmuError, description_of
from railcosim.master.fmi.flaws import read_raw

HOLD_PARAMETER = "input_hold"
"""Integer parameter by which an FMU lets its master choose a `Hold`."""


_ORDER = {"Real": 0, "Integer": 1, "Enumeration": 1, "Boolean": 2}


@dataclass(frozen=True, kw_only=True)
class Parameter:
    """One parameter of an FMU.

    Attributes
    ----------
    name, unit, description : str
        As in the model description.
    type : str
        FMI type: ``Real``, ``Integer``, ``Boolean``, ``Enumeration`` or ``String``.
    variability : str
        ``fixed`` (settable until initialisation ends), ``tunable`` or ``constant``.
    start : str
        The default, as written.
    reference : int
        FMI value reference.
    items : tuple of (str, int)
        Of an enumeration: its names, and their numbers.
    """

    name: str
    type: str
    variability: str
    start: str
    unit: str
    description: str
    reference: int
    items: tuple[tuple[str, int], ...] = ()


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
    inputs, outputs : tuple of Variable
        Inputs and outputs by type: Real ones, those that FMI 2 takes for Integers (enumerations
        as well), Boolean ones. Strings take no part in coupling.
    input_references, output_references : tuple of int
        Their FMI value references.
    feedthrough : array of bool, shape (n_outputs, n_inputs)
        Direct dependence, from the model structure.
    states_dependence : array of bool, shape (n_outputs,)
        Whether it lists what an output depends on; if not, that may be everything.
    parameters : dict of str to Parameter
        All parameters by name.
    initials : dict of str to Parameter
        What else can be given a value before the initialisation: its own start values, by name,
        and inputs that are Strings.
    other_names : dict of str to str
        The causality of every variable that is not a parameter.
    can_get_and_set_state, can_serialize_state : bool
        Capabilities.
    takes_any_step : bool
        Whether steps may differ in length (``canHandleVariableCommunicationStepSize``).
    can_interpolate_inputs, has_directional_derivatives, has_output_rates : bool
        Likewise.
    default_step : float or None
        Communication step (s) that suits it, if it names one.
    default_tolerance : float or None
        Relative error that it is made for, likewise.
    """

    path: Path
    sha256: str
    model_name: str
    guid: str
    version: str
    generation_tool: str
    model_identifier: str
    inputs: tuple[Variable, ...]
    outputs: tuple[Variable, ...]
    input_references: tuple[int, ...]
    output_references: tuple[int, ...]
    feedthrough: NDArray[np.bool_]
    states_dependence: NDArray[np.bool_]
    parameters: dict[str, Parameter]
    initials: dict[str, Parameter]
    other_names: dict[str, str]
    can_get_and_set_state: bool
    can_serialize_state: bool
    takes_any_step: bool
    can_interpolate_inputs: bool
    has_directional_derivatives: bool
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
            and parameter.variability in {"fixed", "tunable"}
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


def read_description(path: Path, folder: Path) -> FmuDescription:
    """Read an unpacked FMU's model description.

    Parameters
    ----------
    path : Path
        The FMU file.
    folder : Path
        Where it was unpacked.

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
    return describe(path, raw, raw.coSimulation)


def describe_file(path: Path) -> FmuDescription:
    """Read an FMU's model description, and unpack nothing else.

    Raises
    ------
    FmuError
        As `unpack` and `read_description`.
    """
    with description_of(path) as folder:
        return read_description(path, folder)


def describe(path: Path, raw: Any, kind: Any) -> FmuDescription:
    """What FMPy has read, for one kind of FMU: ``raw.coSimulation`` or ``raw.modelExchange``."""
    try:
        return _describe(path, raw, kind)
    except FmuError:
        raise
    except ValueError as error:  # a number that is none, in a flawed description
        wrong = f"modelDescription.xml is not valid FMI 2.0: {error}"
        raise FmuError(f"{path}: {wrong}") from None


def _describe(path: Path, raw: Any, kind: Any) -> FmuDescription:
    """As `describe`; ValueError for numbers that are none."""
    inputs, outputs = (_exchanged(raw.modelVariables, way) for way in ("input", "output"))
    feedthrough, stated = _feedthrough(raw.outputs, inputs, outputs)
    return FmuDescription(
        path=path,
        sha256=hashlib.sha256(path.read_bytes()).hexdigest(),
        model_name=raw.modelName,
        guid=raw.guid,
        version=raw.version or "",
        generation_tool=raw.generationTool or "",
        model_identifier=kind.modelIdentifier,
        inputs=tuple(coupling_variable(v) for v in inputs),
        outputs=tuple(coupling_variable(v) for v in outputs),
        input_references=tuple(v.valueReference for v in inputs),
        output_references=tuple(v.valueReference for v in outputs),
        feedthrough=feedthrough,
        states_dependence=stated,
        parameters={
            v.name: _parameter(v) for v in raw.modelVariables if v.causality == "parameter"
        },
        initials={v.name: _parameter(v) for v in raw.modelVariables if _is_initial(v)},
        other_names={v.name: v.causality for v in raw.modelVariables if v.causality != "parameter"},
        can_get_and_set_state=kind.canGetAndSetFMUstate,
        can_serialize_state=kind.canSerializeFMUstate,
        takes_any_step=getattr(kind, "canHandleVariableCommunicationStepSize", True),
        can_interpolate_inputs=getattr(kind, "canInterpolateInputs", False),  # Co-Simulation's
        has_directional_derivatives=kind.providesDirectionalDerivative,
        has_output_rates=getattr(kind, "maxOutputDerivativeOrder", 0) >= 1,  # likewise
        default_step=_default(raw.defaultExperiment, "stepSize"),
        default_tolerance=_default(raw.defaultExperiment, "tolerance"),
    )


def _exchanged(variables: Iterable[Any], causality: str) -> list[Any]:
    """Inputs or outputs that take part in coupling, by what FMI function passes them."""
    found = [v for v in variables if v.causality == causality and v.type in _ORDER]
    return sorted(found, key=lambda v: _ORDER[v.type])


def _is_initial(variable: Any) -> bool:
    """Tell whether a variable that is no parameter may be set before the initialisation."""
    if variable.causality in {"parameter", "independent"} or variable.variability == "constant":
        return False
    if variable.causality == "input":
        return bool(variable.type not in _ORDER)
    return variable.initial in {"exact", "approx"}


def _default(experiment: Any, name: str) -> float | None:
    """Step or tolerance that a default experiment names, if it is one."""
    text = getattr(experiment, name, None)
    if text is None:
        return None
    value = _read(text, f"{name} of the default experiment")
    return value if 0.0 < value < np.inf else None


def _feedthrough(
    unknowns: Iterable[Any], inputs: list[Any], outputs: list[Any]
) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
    """Direct dependence of outputs on inputs, (n_outputs, n_inputs), and of which it is stated."""
    # FMI: a missing list of dependencies means "may depend on everything".
    matrix = np.ones((len(outputs), len(inputs)), dtype=bool)
    stated = np.zeros(len(outputs), dtype=bool)
    column = {v.name: j for j, v in enumerate(inputs)}
    row = {v.name: i for i, v in enumerate(outputs)}
    for unknown in unknowns:
        i = row.get(unknown.variable.name)
        if i is None or unknown.dependencies is None:
            continue
        matrix[i], stated[i] = False, True
        matrix[i, [column[v.name] for v in unknown.dependencies if v.name in column]] = True
    matrix.flags.writeable = stated.flags.writeable = False
    return matrix, stated


def _declared(variable: Any, attribute: str) -> str | None:
    """Look up an attribute of a variable, or of its declared type if the variable leaves it out."""
    value: str | None = getattr(variable, attribute)
    if value is None and variable.declaredType is not None:
        value = getattr(variable.declaredType, attribute)
    return value


def coupling_variable(variable: Any) -> Variable:
    """Real input or output of a model description as FMPy reads it, as a `Variable`."""
    # The schema asks for a start value of every input; 0 is for outputs, where it is not used.
    nominal = abs(_read(_declared(variable, "nominal") or 0.0, f"nominal of {variable.name}"))
    kind = Type(variable.type)
    return Variable(
        name=variable.name,
        unit=(_declared(variable, "unit") or "") if kind is Type.REAL else "",
        description=variable.description or "",
        nominal=nominal or 1.0,
        has_nominal=bool(nominal),
        start=_number(variable),
        type=kind,
        items=_items(variable),
    )


def _number(variable: Any) -> float:
    """A start value as written, as a number."""
    words, start = {"true": 1.0, "false": 0.0}, variable.start
    if start in words:
        return words[start]
    whole = variable.type in {"Integer", "Enumeration"}
    return _read(start or 0.0, f"start of {variable.name}", int if whole else float)


def _read(text: str | float, what: str, kind: type[int] | type[float] = float) -> float:
    """A number as written; ValueError, which says of what it is, if it is none."""
    try:
        return float(kind(text))
    except ValueError:
        number = "whole number" if kind is int else "number"
        raise ValueError(f"{what} is {text!r}, which is no {number}") from None


def _items(variable: Any) -> tuple[tuple[str, int], ...]:
    """Names and numbers of an enumeration."""
    kind = variable.declaredType
    return tuple((i.name, int(i.value)) for i in (kind.items if kind is not None else None) or ())


def _parameter(variable: Any) -> Parameter:
    """Convert a parameter."""
    is_real = variable.type == "Real"
    return Parameter(
        name=variable.name,
        type=variable.type,
        variability=variable.variability,
        start=variable.start or "",
        unit=(_declared(variable, "unit") or "") if is_real else "",
        description=variable.description or "",
        reference=variable.valueReference,
        items=_items(variable),
    )
