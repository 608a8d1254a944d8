"""Model descriptions and SSP files that were damaged: a sentence each, no traceback, no hang.

    python -m tests.master.fuzzed --count 1000 --seed 1

What goes wrong otherwise is kept in the folder that it names, with its number: the same seed and
number make the same file.
"""

from __future__ import annotations

import argparse
import random
import shutil
import signal
import sys
import tempfile
import traceback
import warnings
import zipfile
from collections import Counter
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import fmpy

from railcosim.cli.failures import BAD_INPUTS, FAILURES
from railcosim.master.fmi.description import describe_file
from railcosim.master.fmi.fmu import FmuComponent
from railcosim.master.fmi.fmu_parameters import Scalar
from railcosim.master.schemes.jacobi import jacobi
from railcosim.master.system_run import run_ssp
from railcosim.storage.temporary import scratch

from . import anybody, anybody3, plant
from .damage import bytes_changed, damaged
from .ssp_systems import nested

SENTENCES = (*BAD_INPUTS, *FAILURES)
"""What the commands say in one line."""
LONGEST = 60  # s: one takes milliseconds, the first loads xarray on a machine that is busy


# --- files ----------------------------------------------------------------------------------------


def _archive(path: Path, entries: dict[str, bytes], chance: random.Random) -> Path:
    """A zip archive; now and then damaged itself, or with entries that lead out of it."""
    with zipfile.ZipFile(path, "w", chance.choice((0, 8))) as archive:
        for name, content in entries.items():
            archive.writestr(name, content)
        if chance.random() < 0.03:
            archive.writestr(
                chance.choice(("../outside", "/tmp/outside", "a/../../outside", "C:x")), "x"
            )
    if chance.random() < 0.05:
        path.write_bytes(bytes_changed(path.read_bytes(), chance))
    return path


def description(folder: Path, chance: random.Random) -> Path:
    """An FMU with a damaged description."""
    text = damaged(anybody.description().encode(), chance)
    binary = f"binaries/{fmpy.platform}/anybody{fmpy.sharedLibraryExtension}"
    entries = {"modelDescription.xml": text, binary: anybody.library()}
    return _archive(folder / "F.fmu", entries, chance)


EVERYTHING = (
    "u x f f_out int8 int8_out uint64 uint64_out b not_b choice chosen length sum text said bytes "
    "copied v w n s ds level"
)
CLOCKS = "u x int8 level clock ticks held countdown rings events"
ABLE = f'{anybody3.ABLE} hasEventMode="true"'


def description3(folder: Path, chance: random.Random) -> Path:
    """The same of FMI 3.0: arrays, texts and bytes, or clocks."""
    mode, variables, able = chance.choice(
        (("plain", EVERYTHING, anybody3.ABLE), ("clocks", CLOCKS, ABLE))
    )
    text = damaged(anybody3.description(mode, variables, able=able).encode(), chance)
    binary = f"binaries/{fmpy.platform_tuple}/anybody3{fmpy.sharedLibraryExtension}"
    entries = {"modelDescription.xml": text, binary: anybody3.library()}
    return _archive(folder / "F.fmu", entries, chance)


SET = (
    '<?xml version="1.0"?><ssv:ParameterSet xmlns:ssv="http://ssp-standard.org/SSP1/'
    'SystemStructureParameterValues" version="1.0" name="s"><ssv:Parameters>'
    '<ssv:Parameter name="a.k"><ssv:Real value="2" unit="m"/></ssv:Parameter>'
    '<ssv:Parameter name="a.n"><ssv:Integer value="2"/></ssv:Parameter>'
    '<ssv:Parameter name="a.follow"><ssv:Boolean value="true"/></ssv:Parameter>'
    "</ssv:Parameters></ssv:ParameterSet>"
)
MAPPING = (
    '<?xml version="1.0"?><ssm:ParameterMapping version="1.0" '
    'xmlns:ssm="http://ssp-standard.org/SSP1/SystemStructureParameterMapping" '
    'xmlns:ssc="http://ssp-standard.org/SSP1/SystemStructureCommon">'
    '<ssm:MappingEntry source="a.k" target="c.k">'
    '<ssc:LinearTransformation factor="2" offset="1"/></ssm:MappingEntry>'
    '<ssm:MappingEntry source="a.n" target="a.n"/></ssm:ParameterMapping>'
)
BINDINGS = (
    "<ssd:ParameterBindings>"
    '<ssd:ParameterBinding source="resources/s.ssv"/>'
    '<ssd:ParameterBinding source="resources/s.ssv">'
    '<ssd:ParameterMapping source="resources/m.ssm"/></ssd:ParameterBinding>'
    "</ssd:ParameterBindings>"
)
TIMES = '<ssd:DefaultExperiment startTime="0" stopTime="0.5"/>'


def system(folder: Path, chance: random.Random) -> Path:
    """An SSP file of a system in a system, in which one XML file is damaged."""
    fmu = plant.make_fmu(folder / "P.fmu")
    texts = {
        "SystemStructure.ssd": plant.ssd(nested(BINDINGS), TIMES).encode(),
        "resources/s.ssv": SET.encode(),
        "resources/m.ssm": MAPPING.encode(),
    }
    which = chance.choice(["SystemStructure.ssd", "SystemStructure.ssd", *texts])
    texts[which] = damaged(texts[which], chance)
    return _archive(folder / "S.ssp", texts | {"resources/P.fmu": fmu.read_bytes()}, chance)


DICTIONARY = (
    '<ssd:SignalDictionaries><ssd:SignalDictionary name="bus"><ssb:SignalDictionary '
    'xmlns:ssb="http://ssp-standard.org/SSP1/SystemStructureSignalDictionary" version="2.0">'
    '<ssb:DictionaryEntry name="place"><ssc:Float64/></ssb:DictionaryEntry>'
    "</ssb:SignalDictionary></ssd:SignalDictionary></ssd:SignalDictionaries>"
)
MAPS = (
    "<ssc:BooleanMappingTransformation>"
    '<ssc:MapEntry source="true" target="false"/><ssc:MapEntry source="false" target="true"/>'
    "</ssc:BooleanMappingTransformation>"
)


def system2(folder: Path, chance: random.Random) -> Path:
    """An SSP 2.0 file of an FMU of either version, with a dictionary, a mapping and a variant."""
    fmus = {
        "resources/A.fmu": anybody.make_fmu(folder / "A.fmu"),
        "resources/B.fmu": anybody3.make_fmu3(folder / "B.fmu", variables="u x b not_b"),
    }
    parts = plant.component("a", "resources/A.fmu", u="input", x="output", not_b="output")
    parts += plant.component("b", "resources/B.fmu", u="input", x="output", b="input")
    parts += '<ssd:SignalDictionaryReference name="far" dictionary="bus"/>'
    wires = plant.connection("a.x", "far.place") + plant.connection("far.place", "b.u")
    wires += plant.connection("a.not_b", "b.b", MAPS)
    whole = (
        f"<ssd:Elements>{parts}</ssd:Elements><ssd:Connections>{wires}</ssd:Connections>"
        f"{DICTIONARY}"
    )
    text = plant.ssd(whole, TIMES, version="2.0").replace("ssc:Real", "ssc:Float64").encode()
    entries = {"SystemStructure.ssd": damaged(text, chance), "Other.ssd": text}
    files = {name: path.read_bytes() for name, path in fmus.items()}
    return _archive(folder / "S.ssp", entries | files, chance)


# --- what is done with them -----------------------------------------------------------------------


def use_description(path: Path) -> None:
    """Describe it, load it, give it what it says it takes, and step it."""
    describe_file(path)
    with FmuComponent.load(path, name="f") as fmu:
        known = {**fmu.description.parameters, **fmu.description.initials}
        values: dict[str, Scalar] = {
            n: 1 for n, p in known.items() if p.type in {"Real", "Integer"}
        }
        fmu.set_parameters({n: v for n, v in values.items() if known[n].variability != "constant"})
        fmu.enter_initialization(0.0, 1.0)
        fmu.set_inputs(fmu.u)
        fmu.exit_initialization()
        fmu.get_outputs()
        fmu.do_step(0.0, 0.1)
        fmu.get_outputs()


def use_system(path: Path) -> None:
    """Run it."""
    _, stopped = run_ssp(
        path, lambda first: jacobi(), lambda done, total: None, step=0.125, time=0.5
    )
    if stopped is not None and not isinstance(stopped, SENTENCES):
        raise stopped


KINDS: dict[str, tuple[Callable[[Path, random.Random], Path], Callable[[Path], None]]] = {
    "description": (description, use_description),
    "description of FMI 3": (description3, use_description),
    "system": (system, use_system),
    "system of SSP 2": (system2, use_system),
}


class Hung(Exception):  # noqa: N818 (it says what happened)
    """It took too long."""


@contextmanager
def limited(seconds: int) -> Iterator[None]:
    """Raise `Hung` in the block after so many seconds."""

    def stop(*_: object) -> None:
        raise Hung(f"more than {seconds} s")

    before = signal.signal(signal.SIGALRM, stop)
    signal.alarm(seconds)
    try:
        yield
    finally:
        signal.alarm(0)
        signal.signal(signal.SIGALRM, before)


def outcome(kind: str, folder: Path, seed: int, number: int) -> str:
    """Make one and use it: ``runs``, ``told``, or what is wrong.

    Parameters
    ----------
    kind : str
        Of `KINDS`.
    folder : Path
        Empty; the file is made in ``in/`` there, and is all that is in it afterwards.
    seed, number : int
        What decides the damage.
    """
    make, use = KINDS[kind]
    inside = folder / "in"
    inside.mkdir()
    path = make(inside, random.Random(f"{kind} {seed} {number}"))
    before = _seen(folder)
    try:
        with limited(LONGEST), warnings.catch_warnings():
            warnings.simplefilter("ignore")
            use(path)
        found = "runs"
    except SENTENCES as error:
        found = "told" if str(error).strip() else f"{type(error).__name__} says nothing"
    except Exception:
        found = traceback.format_exc()
    after = _seen(folder)
    if after != before:
        found = f"wrote {sorted(set(after) ^ set(before)) or 'over what was there'}"
    return found


def _seen(folder: Path) -> dict[Path, int]:
    """What is there, where hostile entries lead to, and what is unpacked; with times."""
    places = [*folder.rglob("*"), *folder.parent.glob("outside*"), *Path("/tmp").glob("outside*")]
    return {p: p.stat().st_mtime_ns for p in [*places, *scratch().iterdir()] if p.exists()}


def main() -> int:
    """Make as many of each kind as asked for; exit status 1 if any goes wrong."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--count", type=int, default=1000)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--kind", choices=list(KINDS), action="append")
    asked = parser.parse_args()
    bad = 0
    for kind in asked.kind or list(KINDS):
        counts = Counter[str]()
        for number in range(asked.count):
            folder = Path(tempfile.mkdtemp(prefix="fuzzed_"))
            found = outcome(kind, folder, asked.seed, number)
            counts[found if found in {"runs", "told"} else "wrong"] += 1
            if found in {"runs", "told"}:
                shutil.rmtree(folder)
            else:
                bad += 1
                print(f"{kind} {number}, seed {asked.seed}, kept in {folder}:\n{found}", flush=True)
        print(f"{kind}: {dict(counts)}", flush=True)
    return 1 if bad else 0


if __name__ == "__main__":
    sys.exit(main())
