"""Descriptions are small: what a tool must list, and search for what depends on what."""

from dataclasses import replace
from pathlib import Path

import pytest
from fmpy import read_model_description

from railcosim.fmus.content import contents
from railcosim.fmus.export import NATIVE, WITH_STATES
from railcosim.vehicle.files import read_stock

from .test_any_wheelsets import TINY

pytestmark = pytest.mark.filterwarnings("ignore:a ring of")  # as short as it can be
NAMES = ["Vehicle", "Track", "VehicleWithContact", "TrackWithContact"]
# Of a Track.fmu that listed its states, 12,103 variables with 250,000 dependencies, others' tools
# took this: OMSimulator, which searches one for the other, 180 s to load it, and FMPy, which makes
# an object of each variable, 18 s to validate it. We want 2 s and 3 s, on a machine as fast.
SEARCHED = 2 / 180 * 12_103 * 250_000
LISTED = 3 / 18 * 12_103


@pytest.fixture(scope="module", params=["vertical", "spatial"])
def all_contents(request, short_contents):
    """All four, by name. What is inside a track makes no variable of it, so it may be tiny."""
    if request.param == "vertical":
        return short_contents
    wagon = read_stock(Path("wagon"))  # of two bogies
    return {made.name: made for made in contents(wagon, TINY, dimension="spatial")}


def size(content, runtime, folder):
    """How many variables an FMU lists, and how many dependencies of them."""
    target = folder / "one.fmu"
    replace(runtime, documented=False).pack(content, target, str)
    read = read_model_description(str(target), validate=False)
    unknowns = [*read.outputs, *read.derivatives, *read.initialUnknowns]
    return len(read.modelVariables), sum(len(u.dependencies or ()) for u in unknowns)


@pytest.mark.parametrize("fmi", [2, 3])
@pytest.mark.parametrize("name", NAMES)
def test_a_description_takes_others_no_time(all_contents, tmp_path, name, fmi):
    variables, dependencies = size(all_contents[name], replace(NATIVE, fmi=fmi), tmp_path)
    assert variables < LISTED
    assert 0 < variables * dependencies < SEARCHED


def test_a_track_that_lists_its_states_is_too_large(short_contents, tmp_path):
    """It is what the limits are for; even a ring of 30 m is above one of them."""
    variables, dependencies = size(short_contents["Track"], WITH_STATES, tmp_path)
    assert variables * dependencies > SEARCHED
