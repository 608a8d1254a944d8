"""Models that take seconds to make, made once."""

import mmap
import os
import signal
from functools import cache
from pathlib import Path

# As the command line does, and before numpy is loaded: the matrices are small.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import pytest
from hypothesis import settings

from railcosim.analysis.pair.export_pair import export_pair
from railcosim.fmus.content import contents
from railcosim.fmus.export import BARE, packed
from railcosim.track.parameters import Mesh, Track
from railcosim.track.reduced import reduce_track
from railcosim.vehicle.parameters import Vehicle

# The same examples each time, however slow the machine: what fails must fail again.
settings.register_profile("always alike", derandomize=True, deadline=None)
settings.load_profile("always alike")


# A shell lets what it begins in the background ignore Ctrl-C, and that is inherited; tests send it.
if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
    signal.signal(signal.SIGINT, signal.default_int_handler)


@pytest.fixture(scope="module", autouse=True)
def loaded_files_stay_whole():
    """No test cuts what is loaded here, such as a library: that ends the process by SIGBUS, later.

    Who replaces such a file writes another and gives it the name, as `storage.whole` does.
    """
    yield
    assert cut_while_mapped() == []


def cut_while_mapped():
    """Files that this process has mapped beyond their end; none where no system says so."""
    maps, ends = Path("/proc/self/maps"), {}
    for line in maps.read_text().splitlines() if maps.exists() else []:
        span, rights, offset, _, inode, *path = line.split(maxsplit=5)
        if path and "r" in rights:  # others are holes between the parts of a library
            begin, end = (int(part, 16) for part in span.split("-"))
            file = path[0], int(inode)
            ends[file] = max(ends.get(file, 0), int(offset, 16) + end - begin)
    return sorted(path for (path, inode), end in ends.items() if is_cut(path, inode, end))


def is_cut(path, inode, end):
    """Whether it is shorter; what has been removed is whole as long as it is mapped."""
    try:
        file = Path(path).stat()
    except OSError:
        return False
    return file.st_ino == inode and end - mmap.PAGESIZE >= file.st_size


@pytest.fixture(scope="session")
def default_track():
    return Track()


@pytest.fixture(scope="session")
def default_reduced(default_track):
    return reduce_track(default_track)


@pytest.fixture(scope="session")
def short_track():
    """A ring of 30 m, the shortest that a vehicle of 18.2 m fits on with room to spare."""
    return Track(mesh=Mesh(cells=6, highest_slab_frequency=800, highest_frequency=1500))


@pytest.fixture(scope="session")
def short_reduced(short_track):
    return reduce_track(short_track)


@pytest.fixture(scope="session")
def exported(short_fmus):
    """The same; tests of systems have longer ones by this name."""
    return short_fmus


@pytest.fixture(scope="session")
def short_fmus(tmp_path_factory, short_track):
    """The four FMUs of the default vehicle and the short track, by name; Pair.ssp beside them.

    With the track's states, and without what people look at, as commands make them that linearise.
    """
    return export_pair(Vehicle(), short_track, tmp_path_factory.mktemp("fmus"), runtime=BARE)


@pytest.fixture(scope="session")
def short_contents(short_track):
    """What those four carry, by name."""
    return {content.name: content for content in contents(Vehicle(), short_track)}


@pytest.fixture(scope="session")
def packed_by(short_fmus, short_contents, tmp_path_factory):
    """Function: the same four as another runtime packs them."""

    @cache
    def made(runtime):
        if runtime == BARE:
            return short_fmus
        folder = tmp_path_factory.mktemp("packed")
        with packed(short_contents.values(), folder, runtime=runtime) as files:
            return files

    return made
