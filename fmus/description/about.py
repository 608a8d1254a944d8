"""What an FMU's description says besides its variables, and what its runtime can do."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

AUTHOR = "The railcosim authors"
COPYRIGHT = f"Copyright (c) 2026 {AUTHOR}"
LICENCE = "MIT"
LOG_CATEGORIES = {
    "logStatusError": "Why a call failed",
    "logStatusWarning": "What is odd about a call",
}
TOOL = "railcosim"  # whose annotations they are
TOLERANCE = 1e-6  # of a solver that brings none of its own: a hundredth of what data warrant


@dataclass(frozen=True, kw_only=True)
class Capabilities:
    """What a runtime can do.

    Attributes
    ----------
    needs_execution_tool : bool
        Whether the importing machine must bring a Python.
    directional_derivatives : bool
        Of outputs, and of the states' derivatives where there are states.
    interpolates_inputs : bool
        Whether time derivatives of the inputs can be set (FMI 2.0).
    output_derivatives : int
        Highest order of the outputs' time derivatives.
    """

    needs_execution_tool: bool
    directional_derivatives: bool
    interpolates_inputs: bool
    output_derivatives: int


PYTHON = Capabilities(
    needs_execution_tool=True,
    directional_derivatives=False,
    interpolates_inputs=False,
    output_derivatives=0,
)
NATIVE = Capabilities(
    needs_execution_tool=False,
    directional_derivatives=True,
    interpolates_inputs=True,
    output_derivatives=1,
)


@dataclass(frozen=True, kw_only=True)
class Description:
    """What modelDescription.xml says besides its variables.

    Attributes
    ----------
    name : str
        Model name and identifier.
    guid, version, text : str
        Identity of the content (FMI 3: instantiation token), of the software, and one sentence.
    capabilities : Capabilities
        Of the runtime.
    annotations : dict
        Of our own, by element and attribute.
    step, stop : float
        Default experiment, s.
    """

    name: str
    guid: str
    version: str
    text: str
    capabilities: Capabilities
    annotations: Mapping[str, Mapping[str, str]] = field(default_factory=dict)
    step: float = 1e-4
    stop: float = 1.0

    def attributes(self) -> dict[str, str]:
        """What the root element says in FMI 2.0 and 3.0 alike."""
        # No generationDateAndTime: the same parameters give the same file, whose digest tells a
        # checkpoint or a study that it is the same model.
        return {
            "modelName": self.name,
            "description": self.text,
            "author": AUTHOR,
            "version": self.version,
            "copyright": COPYRIGHT,
            "license": LICENCE,
            "generationTool": f"railcosim {self.version}",
            "variableNamingConvention": "structured",
        }
