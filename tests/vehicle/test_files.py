"""Vehicles and trains from files: what is written is read, what cannot be is said in one line."""

from dataclasses import replace
from pathlib import Path

import pytest

from railcosim.parameters import ParameterError, UnusualWarning
from railcosim.vehicle.files import read_stock, write_stock
from railcosim.vehicle.multibody import build_multibody
from railcosim.vehicle.names import BUILT_IN
from railcosim.vehicle.parameters import BogiePlace, CarBodyPlace, Vehicle
from railcosim.vehicle.train import Train, TrainVehicle, train_of

EXAMPLES = Path(__file__).parents[2] / "examples"
WAGON = read_stock(Path("wagon"))


@pytest.fixture
def write(tmp_path):
    def to_file(text, name="mine.toml"):
        path = tmp_path / name
        path.write_text(text, encoding="utf-8")
        return path

    return to_file


SOME = {
    **{name: read_stock(Path(name)) for name in BUILT_IN},
    **{
        name: read_stock(EXAMPLES / f"{name}.toml")
        for name in ("locomotive", "articulated", "train")
    },
    "backwards": Train(vehicles=(TrainVehicle(vehicle=WAGON, reversed=True),)),
}


@pytest.mark.parametrize("name", SOME)
def test_round_trip(write, name):
    assert read_stock(write(write_stock(SOME[name]))) == SOME[name]


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize("name", [*BUILT_IN, *EXAMPLES.glob("*.toml")])
def test_what_we_ship_is_usual(name):
    read_stock(Path(name))


def test_built_in_vehicles():
    assert BUILT_IN == ("paper", "manchester", "wagon")
    assert read_stock(Path("paper")) == Vehicle()
    assert build_multibody(WAGON).wheelset_x.size == 2


def test_the_papers_vehicle_written_out(write):
    """Places say what the short form means."""
    text = """
    [[carbodies]]
    [[bogies]]
    x = 7.85
    [[bogies]]
    x = -7.85
    """
    long = read_stock(write(text))
    assert long == Vehicle().placed
    assert long == Vehicle(
        carbodies=(CarBodyPlace(x=0.0),),
        bogies=(
            BogiePlace(x=7.85, wheelsets=(1.25, -1.25), carbodies=(1,)),
            BogiePlace(x=-7.85, wheelsets=(1.25, -1.25), carbodies=(1,)),
        ),
    )


def test_what_differs_where_it_stands(write):
    text = """
    [bogie]
    mass = 5e3
    inertia_pitch = 6e3
    [[carbodies]]
    [[bogies]]
    x = 7.85
    bogie = { mass = 7e3 }
    [[bogies]]
    x = -7.85
    """
    read = read_stock(write(text))
    assert read.bogies[0].bogie == replace(read.bogie, mass=7e3)
    assert read.bogies[1].bogie is None
    masses = [b.mass for b in train_of(read).parts().bodies if b.kind == "bogie"]
    assert masses == [7e3, 5e3]


def test_a_train_of_files_and_tables(write):
    write("[carbody]\nmass = 30e3\n", "light.toml")
    text = """
    [coupler]
    stiffness = 1e5
    [[vehicle]]
    file = "light.toml"
    count = 2
    [[vehicle]]
    reversed = true
    [vehicle.carbody]
    mass = 60e3
    [vehicle.geometry]
    length = 23
    """
    train = read_stock(write(text, "train.toml"))
    assert [one.vehicle.carbody.mass for one in train.vehicles] == [30e3, 30e3, 60e3]
    assert [one.reversed for one in train.vehicles] == [False, False, True]
    assert train.coupler.stiffness == 1e5
    assert train.vehicles[2].vehicle.geometry.length == 23.0


def test_several_of_one(write):
    train = read_stock(Path("wagon"), 8)
    assert len(train.vehicles) == 8
    x = build_multibody(train).wheelset_x
    assert x[2::2] - x[:-2:2] == pytest.approx(-15.5)
    assert len(read_stock(EXAMPLES / "train.toml", 2).vehicles) == 8


PLACES = "[[carbodies]]\n[[bogies]]\nx = 5\n[[bogies]]\nx = -5\n"


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("[[bogies]]\nx = 5", ["[[carbodies]] are missing"]),
        ("[[carbodies]]\n", ["0 wheelsets", "must be 1 to 64"]),
        ("[[carbodies]]\n[[axles]]\nx = 1\ncarbody = 2", ["no car body 2", "[[carbodies]] has 1"]),
        ("[[carbodies]]\n[[axles]]\nx = 1", ["carbody.pitch is free", "two places"]),
        ("[carbodies]\nx = 1", ["carbodies: must be an array", "[[carbodies]]"]),
        ("[[carbody]]\nmass = 1", ["[carbody]", "must be a table"]),
        (PLACES + "wheelsets = 3", ["[[bogies]] wheelsets = 3", "list of numbers"]),
        (PLACES + "wheelsets = ['a']", ["wheelsets = 'a'", "must be a number in m"]),
        (PLACES + "wheelsets = []", ["[[bogies]] x = -5 m", "needs wheelsets"]),
        (PLACES + f"wheelsets = {list(range(70))}", ["70 numbers, at most 64"]),
        (PLACES + "pivots = [0, 1]", ["2 pivots for 1 carbodies"]),
        (PLACES + "carbodies = [1.5]", ["carbodies = 1.5", "whole number"]),
        (PLACES + "mass = 3", ["[[bogies]] unknown key 'mass'", "wheelsets"]),
        (PLACES + "bogie = {mass = -3}", ["[[bogies]] bogie mass = -3 kg", "must be > 0"]),
        (PLACES + "bogie = {weight = 3}", ["[[bogies]] bogie unknown key 'weight'"]),
        (PLACES + "bogie = 3", ["bogie = 3", "must be a table"]),
        ("[[carbodies]]\n[[bogies]]\nx = -5\n[[bogies]]\nx = 5", ["from the front"]),
        ("[geometry]\naxle_half_distance = 1.5\n" + PLACES, ["axle_half_distance", "[[bogies]]"]),
        (PLACES + "[[couplers]]\ncarbodies = [1, 1]", ["[1, 1]", "numbers of two"]),
        (PLACES.replace("-5", "-0.5").replace("[[carbodies]]", "[[carbodies]]\nx = 20"),
         ["would hang", "carries -"]),
        ("[[vehicle]]\nfile = '../up.toml'", ["'../up.toml'", "in the train file's folder"]),
        ("[[vehicle]]\nfile = '/etc/passwd'", ["'/etc/passwd'", "in the train file's folder"]),
        ("[[vehicle]]\nfile = 'mine.toml'", ["is a train itself"]),
        ("[[vehicle]]\nfile = 'gone.toml'", ["gone.toml: cannot be read"]),
        ("[[vehicle]]\nfile = 'wagn'", ["no built-in vehicle", "paper, manchester, wagon"]),
        ("[[vehicle]]\nfile = 3", ["file = 3", "a name in quotes"]),
        ("[[vehicle]]\ncount = 0", ["[vehicle] count = 0", ">= 1 and <= 64"]),
        ("[[vehicle]]\ncount = 17", ["68 wheelsets", "at most 64"]),
        ("[[vehicle]]\nfile = 'wagon'\n[vehicle.carbody]\nmass = 4e4", ["out [vehicle.carbody]"]),
        ("vehicle = 3", ["[[vehicle]]"]),
        ("vehicle = [3]", ["[[vehicle]]"]),
        ("[[vehicle]]\n[carbody]\nmass = 4e4", ["[carbody]", "allowed: coupler"]),
    ],
)  # fmt: skip
def test_a_mistake_is_named_in_one_line(write, text, said):
    path = write(text)
    with pytest.raises(ParameterError) as error:
        build_multibody(read_stock(path))
    assert "\n" not in str(error.value)
    for part in said:
        assert part in str(error.value)


def test_no_such_vehicle():
    with pytest.raises(ParameterError, match="built-in vehicle; these are paper, manchester, wag"):
        read_stock(Path("manchestr"))
    with pytest.raises(ParameterError, match=r"65 vehicles: must be 1 to 64"):
        read_stock(Path("paper"), 65)


def test_a_slip_of_the_unit_where_it_stands(write):
    with pytest.warns(UnusualWarning, match=r"\[\[bogies\]\] bogie mass = 5 kg .* 5 t\?"):
        read_stock(write(PLACES + "bogie = {mass = 5}"))
    with pytest.warns(UnusualWarning, match=r"\[\[vehicle\]\] \[carbody\] mass = 40 kg .* 40 t\?"):
        read_stock(write("[[vehicle]]\n[vehicle.carbody]\nmass = 40"))
