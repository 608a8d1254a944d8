"""Our FMUs are made once, and never taken for what they are not."""

import json
import os
import sys
import warnings
from dataclasses import replace

import pytest

from railcosim.analysis.pair import kept_fmus
from railcosim.analysis.pair.kept_fmus import BEGUN, MOST, NOTES, fmus_of_pair, key_of
from railcosim.track.local import LocalChange
from railcosim.track.parameters import Track
from railcosim.vehicle.parameters import Vehicle

NAMES = ("Track", "TrackWithContact", "Vehicle", "VehicleWithContact")


@pytest.fixture
def exports(tmp_path, monkeypatch):
    """An empty cache, exports that cost nothing, and what was exported."""
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    made = []

    def export(vehicle, track, dimension, changes, line, out, progress):
        files = {name: out / f"{name}.fmu" for name in NAMES}
        for name, path in files.items():
            path.write_text(f"{name} {vehicle} {track} {dimension} {changes} {line}")
        made.append(out)
        return files

    monkeypatch.setattr(kept_fmus, "_export", export)
    return made


def pair(vehicle=None, **options):
    with fmus_of_pair(vehicle or Vehicle(), Track(), **options) as made:
        return made, {name: path.read_bytes() for name, path in made.files.items()}


def test_the_second_time_they_are_there(exports):
    (first, content), (second, again) = pair(), pair()
    assert (first.found, second.found, len(exports)) == (False, True, 1)
    assert first.files == second.files
    assert content == again
    assert set(first.files) == set(NAMES)


def test_those_in_space_are_others(exports):
    (_, content), (made, others) = pair(), pair(dimension="spatial")
    assert not made.found
    assert content != others
    assert len(exports) == 2


@pytest.mark.parametrize("kind", NOTES.values())
def test_what_was_said_when_they_were_made_is_said_again(exports, monkeypatch, kind):
    """A ring that errs by 100 % was told of once, and never again."""
    making = kept_fmus._export

    def warning(*arguments):
        warnings.warn("wrong by 106 %", kind, stacklevel=2)
        warnings.warn("of a library", DeprecationWarning, stacklevel=2)
        return making(*arguments)

    monkeypatch.setattr(kept_fmus, "_export", warning)
    for _ in range(2):
        with pytest.warns(kind, match="wrong by 106 %") as told:
            pair()
        assert len([one for one in told if one.category is kind]) == 1
    assert len(exports) == 1


def test_other_places_are_other_fmus(exports):
    hanging = LocalChange(what="fastening", x=0.3125, value=0.0)
    (_, one), (made, other) = pair(), pair(changes=[hanging])
    assert not made.found
    assert one != other


def test_other_parameters_are_other_fmus(exports):
    heavy = replace(Vehicle(), carbody=replace(Vehicle().carbody, mass=50e3))
    (_, one), (made, other) = pair(), pair(heavy)
    assert not made.found
    assert one != other
    assert pair()[0].found


def test_other_code_or_another_compiler_is_another_key(exports, monkeypatch):
    keys = {key_of(Vehicle(), Track())}
    monkeypatch.setenv("CC", "tcc")
    keys.add(key_of(Vehicle(), Track()))
    monkeypatch.setattr(kept_fmus, "_code", lambda: "edited")
    keys.add(key_of(Vehicle(), Track()))
    assert len(keys) == 3


def test_every_parameter_is_in_the_key(exports, monkeypatch):
    seen = []
    monkeypatch.setattr(kept_fmus, "digest", lambda content: seen.append(json.loads(content)))
    key_of(Vehicle(), Track())
    assert seen[0]["vehicle"]["carbody"]["mass"] == Vehicle().carbody.mass
    assert seen[0]["track"]["mesh"]["cells"] == Track().mesh.cells


def test_the_code_is_all_below_the_analysis(monkeypatch, tmp_path):
    assert {"analysis", "cli"} <= kept_fmus.NO_MAKERS
    assert not {"fmus", "vehicle", "track", "parameters", "mechanics"} & kept_fmus.NO_MAKERS
    monkeypatch.setattr(sys.modules["railcosim"], "__path__", [str(tmp_path)])
    codes = []
    for package in ("fmus", "analysis"):
        (tmp_path / package).mkdir()
        (tmp_path / package / "x.py").write_text("1")
        kept_fmus._code.cache_clear()
        codes.append(kept_fmus._code())
    kept_fmus._code.cache_clear()
    assert codes[0] == codes[1]
    (tmp_path / "fmus" / "x.py").write_text("2")
    assert kept_fmus._code() != codes[0]
    kept_fmus._code.cache_clear()


@pytest.mark.parametrize("harm", ["shorten", "remove", "add"])
def test_what_is_damaged_is_made_again(exports, harm):
    made, whole = pair()
    track = made.files["Track"]
    if harm == "shorten":
        track.write_bytes(track.read_bytes()[:-1])
    elif harm == "remove":
        track.unlink()
    else:
        (made.kept / "Other.fmu").write_text("?")
    again, content = pair()
    assert not again.found
    assert content == whole
    assert pair()[0].found


def test_fresh_makes_them_anew(exports):
    pair()
    made, _ = pair(fresh=True)
    assert not made.found
    assert len(exports) == 2


def test_half_a_pair_is_never_found(exports, monkeypatch):
    whole = kept_fmus._export

    def killed(*arguments):
        whole(*arguments)["Vehicle"].unlink()
        raise KeyboardInterrupt

    monkeypatch.setattr(kept_fmus, "_export", killed)
    with pytest.raises(KeyboardInterrupt):
        pair()
    monkeypatch.setattr(kept_fmus, "_export", whole)
    assert not pair()[0].found


def test_others_folder_is_not_believed(exports, tmp_path):
    folder = pair()[0].kept.parents[1]
    folder.chmod(0o777)
    made, _ = pair()
    assert made.kept is None
    assert not any(path.exists() for path in made.files.values())  # gone with the block
    assert len(exports) == 2


def test_only_the_last_ones_stay(exports):
    for k in range(MOST + 2):
        made, _ = pair(replace(Vehicle(), carbody=replace(Vehicle().carbody, mass=4e4 + k)))
        os.utime(made.kept, (k, k))
    folder = made.kept.parent
    dead = folder / f"{BEGUN}x"
    dead.mkdir()
    os.utime(dead, (0, 0))
    (folder / f"{BEGUN}y").mkdir()  # of a process that makes one now
    pair()
    assert len(list(folder.glob("[!.]*"))) == MOST
    assert [path.name for path in folder.glob(".*")] == [f"{BEGUN}y"]
