"""FMUs from anybody.c: one library, compiled once a session; what they do is asked for by mode."""

from __future__ import annotations

import subprocess
import tempfile
import zipfile
from functools import cache
from pathlib import Path

import fmpy

from ..c_compiler import c_compiler

_PARAMETER = 'causality="parameter" variability="fixed"'
_JUMPS = 'variability="discrete"'
TYPES = """
  <TypeDefinitions>
    <SimpleType name="gear"><Enumeration>
      <Item name="low" value="1"/><Item name="mid" value="2"/><Item name="top" value="7"/>
    </Enumeration></SimpleType>
  </TypeDefinitions>"""
VARIABLES = {
    "u": ("Real", 0, 'causality="input"', 'start="0.5"'),
    "x": ("Real", 1, 'causality="output"', ""),
    "z": ("Real", 2, 'causality="output"', ""),
    "k": ("Real", 3, _PARAMETER, 'start="1"'),
    "x0": ("Real", 4, 'causality="local" variability="continuous" initial="exact"', 'start="0"'),
    "start": ("Real", 5, 'causality="output"', ""),
    "stop": ("Real", 6, 'causality="output"', ""),
    "tolerance": ("Real", 7, 'causality="output"', ""),
    "final": ("Real", 8, 'causality="output"', ""),
    "length_of_step": ("Real", 9, 'causality="output"', ""),
    "n": ("Integer", 0, f'causality="input" {_JUMPS}', 'start="3"'),
    "twice": ("Integer", 1, f'causality="output" {_JUMPS}', ""),
    "choice": (
        "Enumeration", 2, f'causality="input" {_JUMPS}', 'start="1" declaredType="gear"',
    ),
    "chosen": ("Enumeration", 3, f'causality="output" {_JUMPS}', 'declaredType="gear"'),
    "length": ("Integer", 5, f'causality="output" {_JUMPS}', ""),
    "b": ("Boolean", 0, f'causality="input" {_JUMPS}', 'start="false"'),
    "not_b": ("Boolean", 1, f'causality="output" {_JUMPS}', ""),
    "label": ("String", 0, _PARAMETER, 'start="none"'),
}  # fmt: skip
"""Type, value reference, attributes of the variable and of its type."""
OUTPUTS = ("x", "z", "start", "stop", "tolerance", "final", "length_of_step", "twice", "chosen",
           "length", "not_b")  # fmt: skip
DEPENDS = {"z": "u", "twice": "n", "chosen": "choice", "not_b": "b"}


@cache
def library() -> bytes:
    """The compiled anybody.c."""
    with tempfile.TemporaryDirectory() as folder:
        out, source = Path(folder) / "anybody.so", Path(__file__).with_suffix(".c")
        headers = Path(fmpy.__file__).with_name("c-code")
        command = [*c_compiler(), "-shared", "-fPIC", f"-I{headers}", "-o", out, source]
        subprocess.run(command, check=True)
        return out.read_bytes()


def description(
    mode: str = "plain",
    variables: str = " ".join(VARIABLES),
    *,
    able: str = 'canHandleVariableCommunicationStepSize="true"',
    before: str = "",
    types: str = TYPES,
    stated: bool = True,
    **changed: tuple[str, str],
) -> str:
    """Its model description, with these variables; `changed` replaces text in a variable's line."""
    names = variables.split()
    lines = []
    for name in names:
        kind, reference, attributes, of_type = VARIABLES[name]
        line = (
            f'<ScalarVariable name="{name}" valueReference="{reference}" {attributes}>'
            f"<{kind} {of_type}/></ScalarVariable>"
        )
        lines.append(line.replace(*changed[name]) if name in changed else line)
    index = {name: i for i, name in enumerate(names, start=1)}
    unknowns = "".join(
        f'<Unknown index="{index[name]}"'
        + (f' dependencies="{index.get(DEPENDS.get(name, ""), "")}"' if stated else "")
        + "/>"
        for name in names
        if name in OUTPUTS
    )
    lists = ("Outputs", "InitialUnknowns") if unknowns else ()
    structure = "".join(f"<{name}>{unknowns}</{name}>" for name in lists)
    return f"""<?xml version="1.0" encoding="UTF-8"?>
<fmiModelDescription fmiVersion="2.0" modelName="Anybody" guid="{mode}">
  <CoSimulation modelIdentifier="anybody" {able}/>{types}{before}
  <ModelVariables>{"".join(lines)}</ModelVariables>
  <ModelStructure>{structure}</ModelStructure>
</fmiModelDescription>"""


def make_fmu(path: Path, mode: str = "plain", text: str | None = None, **about) -> Path:
    """Write an FMU; what it says of itself as in `description`, or as given."""
    binary = f"binaries/{fmpy.platform}/anybody{fmpy.sharedLibraryExtension}"
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("modelDescription.xml", text or description(mode, **about))
        archive.writestr(binary, library())
    return path
