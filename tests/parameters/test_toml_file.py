"""Parameter files: what is written is read back, what is wrong is said in one line."""

from dataclasses import fields, replace
from pathlib import Path

import pytest

from railcosim.parameters import ParameterError, read_toml, write_toml
from railcosim.parameters.toml_file import SIZE_LIMIT
from railcosim.track.parameters import Fastening, Foundation, Mesh, Rail, Slab, Track
from railcosim.vehicle.parameters import Bogie, CarBody, Vehicle


@pytest.fixture
def write(tmp_path):
    def to_file(text, name="my track.toml"):
        path = tmp_path / name
        path.write_text(text, encoding="utf-8")
        return path

    return to_file


OTHERS = [
    Vehicle(),
    Track(),
    Vehicle(carbody=CarBody(mass=1 / 3), bogie=Bogie(inertia_pitch=1e-300 + 1e-5)),
    Track(
        slab=Slab(present=False),
        mesh=Mesh(cells=8),
        rail=Rail(loss_factor=0.1 + 0.2),
        foundation=Foundation(ca_layer_stiffness=1.3e9),
    ),
]


@pytest.mark.parametrize("parameters", OTHERS)
def test_round_trip(write, parameters):
    path = write(write_toml(parameters, "anything"))
    assert read_toml(type(parameters), path) == parameters


@pytest.mark.parametrize("kind", [Vehicle, Track])
def test_an_empty_file_is_the_defaults(write, kind):
    assert read_toml(kind, write("")) == kind()


def test_a_file_says_only_what_differs(write):
    path = write("[fastening]\nstiffness = 60e6\n[mesh]\ncells = 8.0\n[slab]\nthickness = 1\n")
    track = read_toml(Track, path)
    assert track == replace(
        Track(), fastening=Fastening(stiffness=6e7), mesh=Mesh(cells=8), slab=Slab(thickness=1.0)
    )
    assert isinstance(track.mesh.cells, int)
    assert isinstance(track.slab.thickness, float)


@pytest.mark.parametrize("parameters", [Vehicle(), Track()])
def test_every_key_has_its_unit_and_source(parameters):
    lines = write_toml(parameters, "title").splitlines()
    assert lines[0] == "# title"
    keys = [k for k, line in enumerate(lines) if line and line[0] not in "#["]
    sets = [getattr(parameters, f.name) for f in fields(parameters)]
    assert len(keys) == sum(len(fields(chosen)) for chosen in sets if chosen != ())
    for k in keys:
        assert lines[k - 1].startswith("# ")
        assert ";" in lines[k - 1]  # description (unit, range; source)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("[fastening]\nstifness = 3e7", ["[fastening]", "'stifness'", "did you mean 'stiffness'"]),
        ("[fastenings]\nstiffness = 3e7", ["[fastenings]", "did you mean 'fastening'"]),
        ("[xyz]\na = 1", ["[xyz]", "allowed: rail, fastening, slab, foundation, mesh"]),
        ("[rail]\nqqqq = 1", ["[rail]", "'qqqq'", "allowed: young_modulus"]),
        ("rail = 3", ["rail = 3", "must be a table"]),
        ("stiffness = 3e7", ["stiffness"]),
        ("[fastening]\nstiffness = '3e7'", ["[fastening] stiffness = '3e7'", "a number in N/m"]),
        ("[fastening]\nstiffness = true", ["stiffness = True", "a number in N/m"]),
        ("[fastening]\nstiffness = [3e7]", ["stiffness = [30000000.0]", "a number in N/m"]),
        ("[slab]\npresent = 1", ["[slab] present = 1", "true or false"]),
        ("[mesh]\ncells = 20.5", ["[mesh] cells = 20.5", "whole number"]),
        ("[mesh]\ncells = nan", ["[mesh] cells = nan", "whole number"]),
        ("[fastening]\nstiffness = -3e7", ["stiffness = -3e+07 N/m", "must be > 0"]),
        ("[fastening]\nstiffness = 0", ["stiffness = 0 N/m", "must be > 0"]),
        ("[fastening]\ndamping = -1", ["damping = -1 N.s/m", "must be >= 0"]),
        ("[fastening]\nstiffness = nan", ["stiffness = nan", "must be > 0"]),
        ("[fastening]\nstiffness = inf", ["stiffness = inf", "must be > 0"]),
        ("[slab]\npoisson_ratio = 0.5", ["poisson_ratio = 0.5", ">= 0 and <= 0.499"]),
        ("[mesh]\ncells = 2", ["cells = 2", ">= 4 and <= 400"]),
        ("[mesh]\ncells = 7", ["[mesh] cells = 7", "even number"]),
        ("[fastening]\nspacing = 0.6", ["spacing = 0.6 m", "divide the cell", "5 m"]),
        ("[fastening]\nspacing = 7", ["spacing = 7 m", "divide the cell"]),
        ("[rail]\nlateral_distance = 2.4", ["lateral_distance = 2.4 m", "slab.width = 2.4 m"]),
        ("[slab]\njoint = 0.7\nlength = 4.3", ["joint = 0.7 m", "fastening.spacing = 0.625 m"]),
        ("[rail\n", ["not a TOML file"]),
        ("[rail]\narea = 1\narea = 2", ["not a TOML file"]),
    ],
)
def test_a_mistake_is_named_in_one_line(write, text, said):
    path = write(text)
    with pytest.raises(ParameterError) as error:
        read_toml(Track, path)
    message = str(error.value)
    assert message.startswith(f"{path}: ")
    assert "\n" not in message
    for part in said:
        assert part in message


@pytest.mark.parametrize(
    "text",
    [
        "[fastening]\nstiffness = 1" + 400 * "0",
        "[mesh]\ncells = 1" + 400 * "0",
        "[fastening]\nstiffness = 1" + 5000 * "0",
        "rail = " + 5000 * "[" + 5000 * "]",
    ],
    ids=["no float", "no float for an integer", "no integer", "too deep"],
)
def test_numbers_and_brackets_without_end_are_refused(write, text):
    with pytest.raises(ParameterError, match=r"my track\.toml: ") as error:
        read_toml(Track, write(text))
    assert len(str(error.value)) < 400
    assert "\n" not in str(error.value)


def test_a_missing_file(tmp_path):
    with pytest.raises(ParameterError, match=r"nowhere\.toml: cannot be read: No such file"):
        read_toml(Track, tmp_path / "nowhere.toml")


@pytest.mark.parametrize("path", [Path("/dev/zero"), Path()])
def test_what_is_no_file(path):
    with pytest.raises(ParameterError, match="is no file"):
        read_toml(Track, path)


def test_a_file_that_is_no_text(tmp_path):
    path = tmp_path / "picture.toml"
    path.write_bytes(bytes(range(256)))
    with pytest.raises(ParameterError, match="not a TOML file"):
        read_toml(Track, path)


def test_a_huge_file_is_not_even_read(tmp_path):
    path = tmp_path / "huge.toml"
    with path.open("wb") as file:
        file.truncate(SIZE_LIMIT + 1)  # holes: takes no space
    with pytest.raises(ParameterError, match="larger than 1000000 bytes"):
        read_toml(Track, path)


def test_values_are_checked_without_a_file():
    with pytest.raises(ParameterError, match=r"mass = -1 kg: must be > 0"):
        CarBody(mass=-1)
    with pytest.raises(ParameterError, match="must be a number in kg"):
        CarBody(mass=None)
    with pytest.raises(TypeError, match="weight"):
        CarBody(weight=1)
    with pytest.raises(ParameterError, match="divide the cell"):
        Track(fastening=Fastening(spacing=0.7))


def test_a_byte_order_mark_is_no_content(write):
    path = write("\ufeff[fastening]\nstiffness = 60e6\n")
    assert read_toml(Track, path).fastening.stiffness == 6e7
