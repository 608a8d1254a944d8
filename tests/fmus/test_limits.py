"""What an export refuses."""

import pytest

from railcosim.fmus.export import NativeRuntime, export
from railcosim.fmus.native_runtime import compile as compiling
from railcosim.fmus.native_runtime import resource as packing
from railcosim.parameters import ParameterError
from railcosim.vehicle.parameters import Vehicle


def test_a_table_the_runtime_would_not_load_is_refused(short_contents, monkeypatch):
    track = short_contents["Track"]
    size = track.body.shapes.table.nbytes
    monkeypatch.setattr(packing, "LARGEST_TABLE", size)
    packing.resource(track.body, track.table, "{}")
    monkeypatch.setattr(packing, "LARGEST_TABLE", size - 1)
    with pytest.raises(ParameterError, match="reduce cells, elements_per_bay"):
        packing.resource(track.body, track.table, "{}")


def test_a_missing_compiler_is_told_before_anything_is_made(short_track, tmp_path, monkeypatch):
    def missing(*_: object) -> None:
        raise compiling.CompilerMissing("no compiler")

    monkeypatch.setattr(compiling, "installed", lambda *_: None)
    monkeypatch.setattr(compiling, "compiler_for", missing)
    told: list[str] = []
    with pytest.raises(compiling.CompilerMissing):
        export(Vehicle(), short_track, tmp_path / "out", told.append, runtime=NativeRuntime())
    assert not (tmp_path / "out").exists()
    assert told == []
