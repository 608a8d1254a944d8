"""Wheels and rails with profiles inside FMUs: a cone's profile on a circle's is the cone."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from railcosim.analysis.pair.contact import CouplingError
from railcosim.analysis.pair.owner import FMUS, Owner
from railcosim.analysis.pair.pair import Journey, open_pair
from railcosim.analysis.pair.profiles import profiles_of, profiles_told
from railcosim.analysis.schemes.catalogue import members
from railcosim.fmus.export import BARE, PythonRuntime, export
from railcosim.master.cosimulation import cosimulate
from railcosim.mechanics.contact.profiled import Profiled
from railcosim.mechanics.contact.profiles import ProfileError
from railcosim.mechanics.ports import FORCE
from railcosim.track.irregularity import synthesise
from railcosim.track.parameters import Mesh, Track
from railcosim.vehicle.files import read_stock
from railcosim.vehicle.properties import FileName

pytestmark = pytest.mark.filterwarnings("ignore:.*a ring of")  # as short as it can be
TINY = Track(mesh=Mesh(cells=4, elements_per_bay=2, highest_slab_frequency=100,
                       highest_frequency=100))  # fmt: skip
SCHEMES = {
    Owner.TRACK: "gauss-seidel-linear-vehicle-first",
    Owner.MASTER: "interface-jacobian",
    Owner.VEHICLE: "iqn-ils-linear",
}


@pytest.fixture(scope="module")
def pairs(tmp_path_factory):
    """Files of a wagon on cones, and on the same as profiles."""
    folder, wagon = tmp_path_factory.mktemp("profiled"), read_stock(Path("wagon"))
    y, angle = np.linspace(-0.04, 0.04, 321), np.arctan(wagon.rolling.conicity)
    R = wagon.contact.rail_radius
    out, down = R * np.sin(angle), R * np.cos(angle)
    shapes = {
        "wheel": -wagon.rolling.conicity * y, "rail": down - np.sqrt(R**2 - (y - out) ** 2)
    }  # fmt: skip
    for name, z in shapes.items():
        np.savetxt(
            folder / f"{name}.csv", np.stack([y, z], 1), "%.17g", ",", header="y,z", comments=""
        )
    names = {f"{name}_profile": FileName(f"{name}.csv", folder) for name in shapes}
    kinds = {"cone": {"flange_stiffness": 0.0}, "profile": names}
    made = {}
    for kind, own in kinds.items():
        one = replace(wagon, rolling=replace(wagon.rolling, **own))
        made[kind] = export(one, TINY, folder / kind, dimension="spatial", runtime=BARE)
    python = PythonRuntime(documented=False)
    made["python"] = export(one, TINY, folder / "python", dimension="spatial", runtime=python)
    return made


def aside_and_down(files, owner, steps=10):
    """Forces (n, forces) of all contacts, at rest and over an irregularity."""
    profile = synthesise("german-low", 2.0, quantities=("all",))
    journey = Journey(speed=20.0, held=False, profile=profile)
    with open_pair(*(files[name] for name in FMUS[owner]), {}, journey) as pair:
        told = [name.partition(".")[2] for name in pair.system.names]
        at = [told.index(name) for name in pair.layout.surface.names(FORCE)]
        scheme = members()[SCHEMES[owner]].scheme
        points = cosimulate(pair.system, scheme, 1e-4, steps * 1e-4)
        return np.array([point.outputs[at] for point in points])


# 10 s: FMUs in space of both runtimes, and runs of them.
@pytest.mark.slow
def test_a_cone_by_its_profile_is_the_cone(pairs) -> None:
    """Whoever owns the contacts, and in both runtimes, which agree to 1e-9.

    Points of the profiles are 0.25 mm apart: curvatures err by 1e-4, so creep by some of it.
    """
    size = np.abs(aside_and_down(pairs["cone"], Owner.TRACK)).max()
    for owner in Owner:
        cone, profile = (aside_and_down(pairs[kind], owner) for kind in ("cone", "profile"))
        assert np.ptp(cone, axis=0).max() > 10.0
        assert np.abs(profile - cone).max() < 1e-5 * size
    native, python = (aside_and_down(pairs[kind], Owner.TRACK) for kind in ("profile", "python"))
    assert np.abs(native - python).max() < 1e-9 * size


@pytest.mark.slow  # the same FMUs
def test_tables_that_are_told(pairs) -> None:
    """By all that owns contacts or might; wheels of one law are alike."""
    files = pairs["profile"]
    table = profiles_told(files["Vehicle"])
    assert table is not None
    assert profiles_told(files["Track"]) is None
    assert profiles_of([files["Vehicle"]], files["TrackWithContact"]).told() == table.told()
    with pytest.raises(CouplingError, match=r"Vehicle\.fmu: its wheels roll on other profiles"):
        profiles_of([files["Vehicle"], pairs["cone"]["Vehicle"]])
    journey = Journey(speed=20.0, held=True, profile=synthesise("german-low", 1.0))
    asked = {"contact.conicity": 0.1}
    with (
        pytest.raises(CouplingError, match="conicity: is of cones"),
        open_pair(files["Vehicle"], files["Track"], asked, journey),
    ):
        pass
    told = table.told()
    for wrong in (
        told | {"step": 0.0}, told | {"columns": {}}, told | {"half_distance": float("nan")},
        told | {"columns": told["columns"] | {"C": told["columns"]["C"][1:]}}, [],
    ):  # fmt: skip
        with pytest.raises(ProfileError):
            Profiled.of(wrong)
