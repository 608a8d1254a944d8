"""A vehicle FMU on a track FMU whose ring it may not fit, and what a track says of its ring."""

import warnings
import zipfile

import numpy as np
import pytest

from railcosim.analysis.pair.linear_pair import linear_parts
from railcosim.analysis.pair.pair import Journey, open_pair
from railcosim.analysis.pair.ring import check_frequencies_of, check_ring_of
from railcosim.analysis.response.map import response_map
from railcosim.analysis.response.models import linear_models
from railcosim.fmus.annotations import ring_annotations
from railcosim.master.connections import CouplingError
from railcosim.master.fmi.archive import FmuError, read_annotations
from railcosim.track.decay import PROMISED, RingWarning, decay_along
from railcosim.track.irregularity import flat
from railcosim.track.parameters import Track

POSITIONS = np.array([18.5125, 16.0125, 2.8125, 0.3125])  # m


@pytest.fixture
def track_saying(tmp_path):
    """An archive with a model description and, perhaps, annotations."""

    def make(annotations):
        path = tmp_path / "Track.fmu"
        with zipfile.ZipFile(path, "w") as archive:
            archive.writestr(
                "modelDescription.xml",
                f'<fmiModelDescription fmiVersion="2.0">{annotations}</fmiModelDescription>',
            )
        return path

    return make


def ring(attributes, tool="railcosim"):
    return f'<VendorAnnotations><Tool name="{tool}"><Ring {attributes}/></Tool></VendorAnnotations>'


def test_longest_vehicle_is_the_longest_that_keeps_the_promise():
    decay, noted = decay_along(Track()), ring_annotations(Track())["Ring"]
    longest = float(noted["longestVehicle"])
    assert float(noted["length"]) == 100.0
    assert decay.worst(20, longest)[0] <= PROMISED < decay.worst(20, longest + 0.1)[0]
    assert decay.longest_span(6) == 0.0  # 36 % at the force itself, see test_decay


def test_tracks_that_say_nothing_or_enough_are_let_through(track_saying):
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        check_ring_of(track_saying(""), POSITIONS)
        check_ring_of(track_saying(ring('length="1"', tool="other")), POSITIONS)
        check_ring_of(track_saying(ring('length="100.0" longestVehicle="18.2"')), POSITIONS)


def test_vehicle_longer_than_its_ring_is_refused(track_saying):
    """Through a ring of 19.6 m the last wheelset is 1.4 m ahead of the first one."""
    track = track_saying(ring('length="19.6" longestVehicle="0.0"'))
    with pytest.raises(
        CouplingError, match=r"Track\.fmu.* 19\.6 m.* 18\.2 m .*more \[mesh\] cells"
    ):
        check_ring_of(track, POSITIONS)
    with pytest.raises(CouplingError):
        check_ring_of(track, POSITIONS + 1e3)  # wherever it stands


def test_vehicle_longer_than_the_track_is_made_for_is_told(track_saying):
    track = track_saying(ring('length="100.0" longestVehicle="18.1"'))
    with pytest.warns(RingWarning, match=r"100 m .*up to 18\.1 m apart; these are 18\.2 m"):
        check_ring_of(track, POSITIONS)


def test_frequencies_beyond_the_promise_are_told(track_saying):
    ours = track_saying(ring('length="100.0" longestVehicle="52.2"'))
    with pytest.warns(RingWarning, match=r"above 900 Hz .*track-receptance"):
        check_frequencies_of(ours, 901.0)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        check_frequencies_of(ours, 900.0)
        check_frequencies_of(track_saying(""), 901.0)  # someone else's


def test_a_map_tells_too(exported):
    """Its highest frequency: the highest speed over the shortest wavelength."""
    files, wavelength = (exported["Vehicle"], exported["Track"]), np.array([0.1, 0.11])
    with pytest.warns(RingWarning) as told:
        response_map(*files, wavelength, np.array([91.0, 92.0]))
    assert sum("above 900 Hz" in str(warning.message) for warning in told) == 1


@pytest.mark.parametrize(
    "attributes", ['length="1e400" longestVehicle="1"', 'length="100"', 'length="x"', 'length="-1"']
)
def test_what_is_no_length_is_refused(track_saying, attributes):
    with pytest.raises(FmuError, match="annotation Ring has"):
        check_ring_of(track_saying(ring(attributes)), POSITIONS)


def test_pairs_of_files_are_checked_in_time_and_in_frequency(exported):
    """The ring of 30 m under the default vehicle."""
    assert read_annotations(exported["Track"], "railcosim")["Ring"]["length"] == "30.0"
    assert "Ring" not in read_annotations(exported["Vehicle"], "railcosim")
    with pytest.warns(RingWarning, match=r"Track\.fmu: a ring of 30 m .*no vehicle.*18\.2 m"):
        linear_models(exported["Vehicle"], exported["Track"], lambda done, total: None)
    with pytest.warns(RingWarning, match=r"Track\.fmu: a ring of 30 m"):
        linear_parts(exported["Vehicle"], exported["Track"], lambda done, total: None)
    journey = Journey(speed=50.0, held=False, profile=flat())
    with (
        pytest.warns(RingWarning, match="TrackWithContact"),
        open_pair(exported["Vehicle"], exported["TrackWithContact"], {}, journey),
    ):
        pass
