"""FMUs from trouble.c, all of one model identifier, and systems of two of them."""

from __future__ import annotations

import subprocess
import zipfile
from pathlib import Path

import fmpy

from railcosim.master.component import Variable
from railcosim.master.connections import Connection
from railcosim.master.signals import Signal
from railcosim.master.system import System

from ..c_compiler import c_compiler

_DESCRIPTION = """<?xml version="1.0" encoding="UTF-8"?>
<fmiModelDescription fmiVersion="2.0" modelName="Trouble" guid="trouble">
  <CoSimulation modelIdentifier="trouble" canGetAndSetFMUstate="true"
                canSerializeFMUstate="true"/>
  <ModelVariables>
    <ScalarVariable name="u" valueReference="0" causality="input"><Real start="0.5"/>
    </ScalarVariable>
    <ScalarVariable name="x" valueReference="1" causality="output"><Real/></ScalarVariable>
    <ScalarVariable name="y" valueReference="3" causality="output"><Real/></ScalarVariable>
    <ScalarVariable name="s" valueReference="2" causality="parameter" variability="tunable">
      <Real start="0"/></ScalarVariable>
  </ModelVariables>
  <ModelStructure>
    <Outputs><Unknown index="2" dependencies=""/><Unknown index="3" dependencies="1"/></Outputs>
  </ModelStructure>
</fmiModelDescription>"""


def make_fmu(folder: Path, trouble: str = "NONE") -> Path:
    """Compile and pack one."""
    library, path = folder / f"{trouble}.so", folder / f"{trouble}.fmu"
    source = Path(__file__).with_suffix(".c")
    command = [*c_compiler(), "-shared", "-fPIC", f"-DTROUBLE={trouble}"]
    subprocess.run([*command, "-o", library, source], check=True)
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("modelDescription.xml", _DESCRIPTION)
        name = f"binaries/{fmpy.platform}/trouble{fmpy.sharedLibraryExtension}"
        archive.write(library, name)
    return path


def make_system(first, second) -> System:
    """Initialise two of them, a signal feeding the first, and the first the second and back."""
    signal = Signal("signal", [Variable(name="f")], lambda t: [1.0 + t * t])
    pairs = [("first", "x", "second", "u"), ("second", "y", "first", "u")]
    for fmu in (first, second):
        fmu.enter_initialization(0.0)
        fmu.exit_initialization()
    return System([signal, first, second], [Connection(*pair) for pair in pairs])
