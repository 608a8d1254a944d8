"""SSP files that we write: valid, and the same when they are read again."""

from __future__ import annotations

import io
import os
import time
import zipfile
from pathlib import Path

import pytest
from fmpy.ssp import ssd as fmpy_ssd
from lxml import etree

from railcosim.master.connections import Connection, CouplingError
from railcosim.master.fmi.fmu import FmuComponent
from railcosim.master.ssp import Part, open_ssp, write_ssp

from .plant import STEP, loop, make_fmu, real, run, values
from .ssp_systems import nested, unit_loop

SSV = "{http://ssp-standard.org/SSP1/SystemStructureParameterValues}"


def exported(loaded, path):
    parts = [
        Part(name=f.name, description=f.description, starts=loaded.starts[f.name])
        for f in loaded.fmus
    ]
    return write_ssp(path, parts, loaded.connections, loaded.maps, start=1.0, stop=2.0, step=STEP)


def test_there_and_back(package, tmp_path, two_units):
    """Nested, with units, transformations and all kinds of values: the same bits."""
    files = two_units
    inside = '<ssc:LinearTransformation factor="-0.1" offset="0.7"/>'
    entries = real("x0", 1 / 3) + (
        '<ssv:Parameter name="n"><ssv:Integer value="7"/></ssv:Parameter>'
        '<ssv:Parameter name="follow"><ssv:Boolean value="false"/></ssv:Parameter>'
    )
    system = unit_loop(inside=inside, a=values(entries))
    with open_ssp(package(system, **files)) as loaded:
        first = run(loaded)
        path = exported(loaded, tmp_path / "again.ssp")
        known = (loaded.connections, loaded.maps, loaded.starts)
    assert known[2]["a"] == {"x0": 1 / 3, "n": 7, "follow": False}
    with open_ssp(path) as loaded:
        assert (loaded.connections, loaded.maps, loaded.starts) == known
        assert (loaded.start, loaded.stop, loaded.step) == (1.0, 2.0, STEP)
        assert loaded.notes == ()
        second = run(loaded)
    assert list(first) == list(second)
    for name, column in first.items():
        assert column.tobytes() == second[name].tobytes()


def test_there_and_back_flat(package, tmp_path):
    """Systems in systems come back flat, and give the same."""
    entries = real("gain", -0.1) + real("a.x0", 2.0) + real("push", 4.0)
    with open_ssp(package(nested(values(entries)))) as loaded:
        first = run(loaded)
        path = exported(loaded, tmp_path / "again.ssp")
    with open_ssp(path) as loaded:
        second = run(loaded)
    assert {k: v.tobytes() for k, v in first.items()} == {k: v.tobytes() for k, v in second.items()}


def test_files_of_one_name(package, tmp_path):
    """Both are packed; one that is used twice is packed once."""
    paths = [tmp_path / folder / "P.fmu" for folder in "ab"]
    for path, unit in zip(paths, ("m", "mm"), strict=True):
        path.parent.mkdir()
        make_fmu(path, x=unit, u="m")
    loads = [paths[0], paths[1], paths[0]]
    fmus = [FmuComponent.load(p, name=n) for p, n in zip(loads, "pqr", strict=True)]
    parts = [Part(name=f.name, description=f.description) for f in fmus]
    path = write_ssp(tmp_path / "s.ssp", parts, [])
    for fmu in fmus:
        fmu.close()
    with open_ssp(path) as loaded:
        assert [f.outputs[0].unit for f in loaded.fmus] == ["m", "mm", "m"]
        assert loaded.fmus[0].description.path == loaded.fmus[2].description.path


def test_what_cannot_be_written(package, tmp_path):
    with open_ssp(package(loop())) as loaded:
        parts = [Part(name=f.name, description=f.description) for f in loaded.fmus]
        target = tmp_path / "s.ssp"
        target.write_bytes(b"an older one")
        with pytest.raises(CouplingError, match=r"signal is no FMU of this system"):
            write_ssp(target, parts, [Connection("signal", "y", "a", "u")])
        with pytest.raises(CouplingError, match=r"b has no input 'v'"):
            write_ssp(target, parts, [Connection("a", "x", "b", "v")])
        with pytest.raises(CouplingError, match="names must differ"):
            write_ssp(target, [parts[0], parts[0]], [])
        wrong = Part(name="a", description=parts[0].description, starts={"x9": 1.0})
        with pytest.raises(CouplingError, match=r"no parameter or input 'x9'"):
            write_ssp(target, [wrong], [])
    # The FMUs are gone with the folder they were unpacked to.
    with pytest.raises(FileNotFoundError):
        write_ssp(target, parts, [])
    assert target.read_bytes() == b"an older one"
    assert not list(tmp_path.glob(".*"))


def schema(name):
    return etree.XMLSchema(file=str(Path(fmpy_ssd.__file__).parent / "schema" / name))


def test_valid(package, tmp_path, two_units):
    """Against the schemas of SSP 1.0, with a transformation, units and all types of values."""
    entries = real("x0", 1 / 3, "m") + (
        '<ssv:Parameter name="n"><ssv:Integer value="7"/></ssv:Parameter>'
        '<ssv:Parameter name="follow"><ssv:Boolean value="true"/></ssv:Parameter>'
    )
    with open_ssp(package(unit_loop(a=values(entries)), **two_units)) as loaded:
        path = exported(loaded, tmp_path / "out.ssp")
    with zipfile.ZipFile(path) as file:
        structure = etree.fromstring(file.read("SystemStructure.ssd"))
    schema("SystemStructureDescription.xsd").assertValid(structure)
    # What is in a binding has a schema of its own, which the first one passes over.
    sets = list(structure.iter(f"{SSV}ParameterSet"))
    assert len(sets) == 2
    for values_ in sets:
        document = etree.parse(io.BytesIO(etree.tostring(values_)))
        schema("SystemStructureParameterValues.xsd").assertValid(document)
    described = fmpy_ssd.read_ssd(str(path))
    assert len(fmpy_ssd.get_connections(described.system)) == 2


def test_the_step_is_where_others_look_for_it(package, tmp_path):
    """For libcosim and for OMSimulator, which knows elements by prefix and aborts without."""
    with open_ssp(package(loop())) as loaded:
        path = exported(loaded, tmp_path / "out.ssp")
        parts = [Part(name=f.name, description=f.description) for f in loaded.fmus]
        short = write_ssp(tmp_path / "short.ssp", parts, loaded.connections, step=1e-5)
        none = write_ssp(tmp_path / "none.ssp", parts, loaded.connections)
    with open_ssp(path) as again:
        assert again.step == STEP

    def text(file):
        with zipfile.ZipFile(file) as opened:
            return opened.read("SystemStructure.ssd").decode()

    root = etree.fromstring(text(path).encode())
    way = [e.tag.rpartition("}")[2] for e in root.iter() if "OMSimulator" in str(e.tag)]
    assert way == ["Annotations", "SimulationInformation", "FixedStepMaster"]
    (found,) = (e for e in root.iter() if str(e.tag).endswith("}FixedStepMaster"))
    assert float(found.get("stepSize")) == STEP
    assert found.get("description") == "oms-ma"
    assert "<oms:FixedStepMaster" in text(path)
    assert 'stepSize="0.00001"' in text(short)
    assert "FixedStep" not in text(none)


def test_the_clock_is_not_in_the_file(package, tmp_path, monkeypatch):
    """Written at two times, with FMUs of two ages: the same bytes."""
    with open_ssp(package(nested(""))) as loaded:
        first = exported(loaded, tmp_path / "pair.ssp").read_bytes()
        for fmu in loaded.fmus:
            os.utime(fmu.description.path, (1.6e9, 1.6e9))
        monkeypatch.setattr(time, "time", lambda: 1.7e9)
        second = exported(loaded, tmp_path / "pair.ssp").read_bytes()
    assert first == second
