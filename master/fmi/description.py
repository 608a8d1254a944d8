"""What an FMU says of itself: identity, interface, parameters, capabilities."""

from __future__ import annotations

import hashlib
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from railcosim.master.component import Variable
from railcosim.master.fmi.archive import FmuError, description_of
from railcosim.master.fmi.flaws import read_raw
from railcosim.master.fmi.from_raw import (
    Clock,
    can_interpolate,
    clocks_of,
    default_of,
    exchanged_of,
    feedthrough_of,
    named_of,
    passed_of,
    scalars_of_all,
    texts_of,
)
from railcosim.master.fmi.kinds import KINDS, Passed
from railcosim.master.fmi.variables import MOST, Parameter, Sizes, size_of

HOLD_PARAMETER = "input_hold"
"""Integer parameter by which an FMU lets its master choose a `Hold`."""

OF_STEP_PARAMETER = "derivatives_of_step"
"""Boolean parameter by which an FMU tells directional derivatives of its last step, not of the
communication point, where FMI 2.0 has them."""


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
    inputs, outputs = (exchanged_of(raw.modelVariables, way, kinds) for way in ("input", "output"))
    if sum(size_of(v, sizes) for v in raw.modelVariables) > MOST:
        raise ValueError(f"its variables have more than {MOST} elements")
    feedthrough, stated = feedthrough_of(raw.outputs, inputs, outputs, sizes)
    parameters, initials, others = named_of(raw.modelVariables, kinds, sizes)
    return FmuDescription(
        path=path,
        fmi=raw.fmiMajorVersion,
        sha256=hashlib.sha256(path.read_bytes()).hexdigest(),
        model_name=raw.modelName,
        guid=raw.guid,
        version=raw.version or "",
        generation_tool=raw.generationTool or "",
        model_identifier=kind.modelIdentifier,
        inputs=scalars_of_all(inputs, kinds, sizes),
        outputs=scalars_of_all(outputs, kinds, sizes),
        passed_in=passed_of(inputs, kinds, sizes),
        passed_out=passed_of(outputs, kinds, sizes),
        clocks=clocks_of(raw.modelVariables),
        feedthrough=feedthrough,
        states_dependence=stated,
        parameters=parameters,
        texts_in=texts_of(raw.modelVariables, "input", kinds),
        texts_out=texts_of(raw.modelVariables, "output", kinds),
        initials=initials,
        other_names=others,
        can_get_and_set_state=kind.canGetAndSetFMUstate,
        can_serialize_state=kind.canSerializeFMUstate,
        takes_any_step=getattr(kind, "canHandleVariableCommunicationStepSize", True),
        can_interpolate_inputs=can_interpolate(kind, inputs),
        has_directional_derivatives=kind.providesDirectionalDerivative,
        has_adjoint_derivatives=kind.providesAdjointDerivatives,
        has_output_rates=getattr(kind, "maxOutputDerivativeOrder", 0) >= 1,  # Co-Simulation's
        default_step=default_of(raw.defaultExperiment, "stepSize"),
        default_tolerance=default_of(raw.defaultExperiment, "tolerance"),
    )
