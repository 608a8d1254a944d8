"""FMUs from anybody3.c, FMI 3.0: one library, compiled once a session; a mode says what they do."""

from __future__ import annotations

import subprocess
import tempfile
import zipfile
from functools import cache
from pathlib import Path

import fmpy

from ..c_compiler import c_compiler

WHOLE = ("Int8", "UInt8", "Int16", "UInt16", "Int32", "UInt32", "Int64", "UInt64")
_LENGTH = '<Dimension valueReference="42"/>'
_PARAMETER = 'causality="parameter" variability="fixed"'
_CLOCK = 'causality="input" intervalVariability='
VARIABLES = {
    "u": ("Float64", 1, 'causality="input" start="0.5"', ""),
    "x": ("Float64", 2, 'causality="output"', ""),
    "f": ("Float32", 3, 'causality="input" start="0.25"', ""),
    "f_out": ("Float32", 4, 'causality="output"', ""),
    **{k.lower(): (k, 10 + 2 * i, 'causality="input" start="3"', "") for i, k in enumerate(WHOLE)},
    **{f"{k.lower()}_out": (k, 11 + 2 * i, 'causality="output"', "") for i, k in enumerate(WHOLE)},
    "b": ("Boolean", 30, 'causality="input" start="false"', ""),
    "not_b": ("Boolean", 31, 'causality="output"', ""),
    "choice": ("Enumeration", 32, 'causality="input" declaredType="gear" start="1"', ""),
    "chosen": ("Enumeration", 33, 'causality="output" declaredType="gear"', ""),
    "label": ("String", 34, _PARAMETER, '<Start value="none"/>'),
    "length": ("Int32", 35, 'causality="output"', ""),
    "data": ("Binary", 36, _PARAMETER, '<Start value="00"/>'),
    "sum": ("UInt32", 37, 'causality="output"', ""),
    "steps": ("Int32", 38, 'causality="output"', ""),
    "text": ("String", 34, 'causality="input"', '<Start value="none"/>'),
    "said": ("String", 60, 'causality="output"', ""),
    "bytes": ("Binary", 36, 'causality="input"', '<Start value="00"/>'),
    "copied": ("Binary", 61, 'causality="output"', ""),
    "v": ("Float64", 40, 'causality="input" start="1 2 3"', _LENGTH),
    "w": ("Float64", 41, 'causality="output"', _LENGTH),
    "n": ("UInt64", 42, 'causality="structuralParameter" variability="fixed" start="3"', ""),
    "gain": ("Float64", 43, f'{_PARAMETER} start="1 2 3"', _LENGTH),
    "s": ("Float64", 44, "", _LENGTH),
    "ds": ("Float64", 45, 'derivative="44"', _LENGTH),
    "derivatives_of_step": (
        "Boolean",
        46,
        'causality="parameter" variability="tunable" start="false"',
        "",
    ),
    "level": ("Float64", 47, 'causality="input" variability="discrete" start="0"', ""),
    "clock": ("Clock", 50, f'{_CLOCK}"constant" intervalDecimal="0.2"', ""),
    "ticks": ("Int32", 51, 'causality="output" clocks="50"', ""),
    "held": ("Float64", 52, 'causality="output" variability="discrete" clocks="50"', ""),
    "countdown": ("Clock", 53, f'{_CLOCK}"countdown"', ""),
    "rings": ("Int32", 54, 'causality="output" clocks="53"', ""),
    "events": ("Int32", 55, 'causality="output"', ""),
}
"""Type, value reference, attributes, content."""
DEPENDS = {"w": "v", "f_out": "f", "not_b": "b", "chosen": "choice"} | {
    f"{k.lower()}_out": k.lower() for k in WHOLE
}
ABLE = (
    'canHandleVariableCommunicationStepSize="true" canGetAndSetFMUState="true" '
    'canSerializeFMUState="true" providesDirectionalDerivatives="true"'
)
GEAR = """<TypeDefinitions><EnumerationType name="gear"><Item name="low" value="1"/>
    <Item name="top" value="7"/></EnumerationType></TypeDefinitions>"""


@cache
def library() -> bytes:
    """The compiled anybody3.c."""
    with tempfile.TemporaryDirectory() as folder:
        out, source = Path(folder) / "anybody3.so", Path(__file__).with_suffix(".c")
        headers = Path(fmpy.__file__).with_name("c-code")
        command = [*c_compiler(), "-shared", "-fPIC", f"-I{headers}", "-o", out, source]
        subprocess.run(command, check=True)
        return out.read_bytes()


def description(
    mode: str = "plain", variables: str = "u x", *, able: str = ABLE, kind: str = "CoSimulation",
    **changed: tuple[str, str],
) -> str:  # fmt: skip
    """Its model description, with these variables; `changed` replaces text in a variable's line."""
    lines, structure = [], []
    for name in variables.split():
        tag, reference, attributes, content = VARIABLES[name]
        line = f'<{tag} name="{name}" valueReference="{reference}" {attributes}>{content}</{tag}>'
        lines.append(line.replace(*changed[name]) if name in changed else line)
        if 'causality="output"' in attributes:
            known = VARIABLES.get(DEPENDS.get(name, ""), ("", "", "", ""))[1]
            structure.append(f'<Output valueReference="{reference}" dependencies="{known}"/>')
    if "ds" in variables.split():
        structure.append('<ContinuousStateDerivative valueReference="45"/>')
    return f"""<?xml version="1.0" encoding="UTF-8"?>
<fmiModelDescription fmiVersion="3.0" modelName="Anybody" instantiationToken="{mode}">
  <{kind} modelIdentifier="anybody3" {able}/>{GEAR}
  <ModelVariables><Float64 name="time" valueReference="0" causality="independent"
    variability="continuous"/>{"".join(lines)}</ModelVariables>
  <ModelStructure>{"".join(structure)}</ModelStructure>
</fmiModelDescription>"""


def make_fmu3(
    path: Path, mode: str = "plain", variables: str = "u x", *, text: str | None = None, **about
) -> Path:
    """Write an FMU; what it says of itself as in `description`, or as given."""
    binary = f"binaries/{fmpy.platform_tuple}/anybody3{fmpy.sharedLibraryExtension}"
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("modelDescription.xml", text or description(mode, variables, **about))
        archive.writestr(binary, library())
    return path
