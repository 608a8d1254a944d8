"""SSP 2.0, and what SSP 1.0 has that few use: mappings, signal dictionaries, variants."""

import zipfile

import numpy as np
import pytest

from railcosim.master.component import ComponentError
from railcosim.master.fmi.archive import FmuError
from railcosim.master.fmi.fmu import FmuComponent
from railcosim.master.ssp import Part, open_ssp, write_ssp

from . import anybody
from .anybody3 import make_fmu3
from .plant import (
    ROUNDING,
    component,
    connection,
    growth,
    loop,
    make_fmu,
    pack,
    real,
    run,
    ssd,
    values,
)  # fmt: skip


@pytest.fixture
def plant_fmu(tmp_path):
    return make_fmu(tmp_path / "P.fmu")


def second(text):
    """The same as of SSP 2.0, with its types."""
    for old, new in (("Real", "Float64"), ("Integer", "Int32")):
        text = text.replace(f"ssc:{old}", f"ssc:{new}").replace(f"ssv:{old}", f"ssv:{new}")
    return text.replace('version="1.0"', 'version="2.0"').replace(
        '<?xml version="2.0"', '<?xml version="1.0"'
    )


def test_the_second_version_runs_as_the_first(plant_fmu, tmp_path):
    """x' = k x, with k = -0.5 from a parameter set and x(0) = 3."""
    text = ssd(loop(a=values(real("x0", 3.0)), b=values(real("k", -0.5))))
    runs = []
    for k, one in enumerate((text, second(text))):
        with open_ssp(pack(tmp_path / f"{k}.ssp", one, P__fmu=plant_fmu)) as loaded:
            runs.append(run(loaded)["a.x"])
    assert np.array_equal(*runs)
    np.testing.assert_allclose(runs[0], growth(3.0, -0.5), rtol=ROUNDING)


def test_units_of_its_types_convert(tmp_path):
    fmu = make_fmu(tmp_path / "P.fmu", u="m", x="m")
    text = second(ssd(loop()).replace("<ssc:Real/>", '<ssc:Real unit="m"/>'))
    with (
        pytest.raises(FmuError, match="m is not"),
        open_ssp(
            pack(tmp_path / "S.ssp", text.replace('unit="m"', 'unit="furlong"', 1), P__fmu=fmu)
        ),
    ):
        pass


@pytest.mark.parametrize(
    ("entry", "told"),
    [
        ('<ssv:UInt64 value="18446744073709551615"/>', "does not fit"),
        ('<ssv:Int8 value="3"/>', ""),
        ('<ssv:Binary value="00"/>', r"a\.n: 00 is Binary, which only Binary takes as it is"),
        ('<ssv:Binary value="0"/>', "parameter n: '0' must be bytes, two hexadecimal digits each"),
        ('<ssv:Int16 value="x"/>', "must be a number"),
    ],
)
def test_values_of_its_types(plant_fmu, tmp_path, entry, told):
    text = second(ssd(loop(a=values(f'<ssv:Parameter name="n">{entry}</ssv:Parameter>'))))
    path = pack(tmp_path / "S.ssp", text, P__fmu=plant_fmu)
    if told:
        with pytest.raises(FmuError, match=told), open_ssp(path):
            pass
        return
    with open_ssp(path) as loaded:
        assert loaded.starts["a"] == {"n": 3}


def test_bytes_are_bytes(tmp_path):
    """There and back; the FMU adds them up."""
    fmu = make_fmu3(tmp_path / "P.fmu", variables="u x data sum")
    entry = '<ssv:Parameter name="data"><ssv:Binary value="0102FF"/></ssv:Parameter>'
    one = component("a", more=values(entry), u="input", x="output")
    text = second(ssd(f"<ssd:Elements>{one}</ssd:Elements>"))
    with open_ssp(pack(tmp_path / "S.ssp", text, P__fmu=fmu)) as loaded:
        assert loaded.starts["a"] == {"data": "0102ff"}
        assert run(loaded)["a.sum"][-1] == 1 + 2 + 255
    with FmuComponent.load(fmu, name="a") as a:
        part = Part(name="a", description=a.description, starts={"data": "0102ff"})
        path = write_ssp(tmp_path / "W.ssp", [part], [], step=0.125, stop=1.0, version="2.0")
    with open_ssp(path) as loaded:
        assert loaded.starts["a"] == {"data": "0102ff"}


@pytest.mark.parametrize("version", ["1.0", "2.0"])
def test_what_is_written_is_read(plant_fmu, tmp_path, version):
    with FmuComponent.load(plant_fmu, name="a") as a:
        part = Part(name="a", description=a.description, starts={"x0": 2.5, "n": 4, "follow": True})
        path = write_ssp(tmp_path / "W.ssp", [part], [], step=0.125, stop=1.0, version=version)
    with zipfile.ZipFile(path) as archive:
        text = archive.read("SystemStructure.ssd").decode()
    assert ("ssv:Float64" in text, "ssv:Int32" in text) == (version == "2.0",) * 2
    assert f'version="{version}" name="W"' in text
    with open_ssp(path) as loaded:
        assert loaded.starts["a"] == {"x0": 2.5, "n": 4, "follow": True}


def test_variants_by_name(plant_fmu, tmp_path):
    path = pack(tmp_path / "S.ssp", ssd(loop(a=values(real("x0", 1.0)))), P__fmu=plant_fmu)
    other = ssd(loop(a=values(real("x0", 7.0)))).replace('name="by hand"', 'name="hot day"')
    with zipfile.ZipFile(path, "a") as archive:
        archive.writestr("VarA.ssd", other)
    for name, x0 in ((None, 1.0), ("by hand", 1.0), ("hot day", 7.0), ("VarA", 7.0)):
        with open_ssp(path, variant=name) as loaded:
            assert loaded.starts["a"]["x0"] == x0
    told = r"no variant 'hot dog'; did you mean hot day.*by hand"
    with pytest.raises(FmuError, match=told), open_ssp(path, variant="hot dog"):
        pass


# --- values that are no Reals -----------------------------------------------------------------


def mapped(kind, *entries):
    inside = "".join(f'<ssc:MapEntry source="{a}" target="{b}"/>' for a, b in entries)
    return f"<ssc:{kind}MappingTransformation>{inside}</ssc:{kind}MappingTransformation>"


def pair(folder, output, input_, inside):
    """Of two of anybody's FMUs, one output to one input, through a mapping."""
    fmu = anybody.make_fmu(folder / "A.fmu")
    ends = {output: "output", input_: "input"}
    parts = "".join(component(n, "resources/A.fmu", **ends) for n in ("a", "b"))
    wire = connection(f"a.{output}", f"b.{input_}", inside)
    text = f"<ssd:Elements>{parts}</ssd:Elements><ssd:Connections>{wire}</ssd:Connections>"
    return pack(folder / "S.ssp", ssd(text), A__fmu=fmu)


@pytest.mark.parametrize(
    ("output", "input_", "inside", "seen"),
    [
        # not_b of b = false is true, which becomes false; its own not_b is then true.
        ("not_b", "b", mapped("Boolean", ("true", "false"), ("false", "true")), ("b.not_b", 1)),
        # twice 3 is 6, which becomes 11.
        ("twice", "n", mapped("Integer", (6, 11), (0, 1)), ("b.twice", 22)),
        # low becomes top, which is 7.
        (
            "chosen",
            "choice",
            mapped("Enumeration", ("low", "top"), ("mid", "low")),
            ("b.chosen", 7),
        ),
    ],
)
def test_mappings_of_what_is_no_real(tmp_path, output, input_, inside, seen):
    with open_ssp(pair(tmp_path, output, input_, inside)) as loaded:
        name, value = seen
        assert run(loaded)[name].tolist() == [value] * 9


@pytest.mark.parametrize(
    ("output", "input_", "inside", "told"),
    [
        (
            "x",
            "u",
            mapped("Boolean", ("true", "false")),
            "a mapping of Boolean values, and x is Real",
        ),
        ("not_b", "b", mapped("Boolean", ("true", "maybe")), "has 'maybe', which is none"),
        (
            "chosen",
            "choice",
            mapped("Enumeration", ("low", "up")),
            "'up' of its mapping is none of",
        ),
        ("twice", "n", "<ssc:CubicTransformation/>", "a CubicTransformation is not known"),
    ],
)
def test_mappings_that_do_not_fit_are_refused(tmp_path, output, input_, inside, told):
    with pytest.raises(FmuError, match=told), open_ssp(pair(tmp_path, output, input_, inside)):
        pass


def test_a_value_that_a_mapping_does_not_have(tmp_path):
    path = pair(tmp_path, "twice", "n", mapped("Integer", (5, 1)))
    with open_ssp(path) as loaded, pytest.raises(ComponentError, match="b: its input n is given 6"):
        run(loaded)


def test_values_are_mapped(plant_fmu, tmp_path):
    mapping = (
        '<ssd:ParameterMapping><ssm:ParameterMapping version="1.0">'
        f'<ssm:MappingEntry source="on" target="follow">{mapped("Boolean", ("true", "false"))}'
        f'</ssm:MappingEntry><ssm:MappingEntry source="n" target="n">{mapped("Integer", (2, 9))}'
        "</ssm:MappingEntry></ssm:ParameterMapping></ssd:ParameterMapping>"
    )
    given = '<ssv:Parameter name="on"><ssv:Boolean value="true"/></ssv:Parameter>' + (
        '<ssv:Parameter name="n"><ssv:Integer value="{}"/></ssv:Parameter>'
    )
    for n, found in ((2, {"follow": False, "n": 9}), (3, None)):
        text = ssd(loop(a=values(given.format(n), mapping=mapping)))
        path = pack(tmp_path / "S.ssp", text, P__fmu=plant_fmu)
        if found is None:
            with pytest.raises(FmuError, match="3 is not in its Integer mapping"), open_ssp(path):
                pass
        else:
            with open_ssp(path) as loaded:
                assert loaded.starts["a"] == found


def test_signal_dictionaries_pass_on_what_one_gives(plant_fmu, tmp_path):
    """x goes through a dictionary, also seen from a system inside, as if it were connected."""
    bus = (
        '<ssd:SignalDictionaries><ssd:SignalDictionary name="bus"><ssb:SignalDictionary '
        'xmlns:ssb="http://ssp-standard.org/SSP1/SystemStructureSignalDictionary" version="1.0">'
        '<ssb:DictionaryEntry name="place"><ssc:Real/></ssb:DictionaryEntry>'
        "</ssb:SignalDictionary></ssd:SignalDictionary></ssd:SignalDictionaries>"
    )
    refer = '<ssd:SignalDictionaryReference name="{}" dictionary="{}"/>'
    inner = (
        '<ssd:System name="inner"><ssd:Elements>'
        + component("b", more=values(real("k", -0.5)), u="input", z="output")
        + refer.format("near", "bus")
        + "</ssd:Elements><ssd:Connections>"
        + connection("near.place", "b.u")
        + "</ssd:Connections></ssd:System>"
    )
    parts = component("a", more=values(real("x0", 3.0)), u="input", x="output")
    text = (
        f"<ssd:Elements>{parts}{refer.format('far', 'bus')}{inner}</ssd:Elements>"
        f"<ssd:Connections>{connection('a.x', 'far.place')}</ssd:Connections>{bus}"
    )
    with open_ssp(pack(tmp_path / "S.ssp", ssd(text), P__fmu=plant_fmu)) as loaded:
        assert [str(c) for c in loaded.connections] == ["a.x -> inner.b.u"]
        found = run(loaded)
        np.testing.assert_allclose(found["inner.b.z"], -0.5 * found["a.x"], rtol=ROUNDING)
    wrong = ssd(text.replace('dictionary="bus"', 'dictionary="tram"', 1))
    path = pack(tmp_path / "W.ssp", wrong, P__fmu=plant_fmu)
    with (
        pytest.raises(FmuError, match="dictionary 'tram', which is not"),
        open_ssp(path),
    ):
        pass
