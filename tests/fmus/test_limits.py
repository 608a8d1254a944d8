"""What an export refuses."""

from dataclasses import replace

import numpy as np
import pytest

from railcosim.fmus.content import contents
from railcosim.fmus.export import NativeRuntime, export
from railcosim.fmus.native_runtime import compile as compiling
from railcosim.fmus.native_runtime.resource import LARGEST_TABLE, resource
from railcosim.parameters import ParameterError
from railcosim.vehicle.parameters import Vehicle


def test_a_table_the_runtime_would_not_load_is_refused(short_track):
    track = next(c for c in contents(Vehicle(), short_track) if c.name == "Track")
    shapes = track.body.shapes
    shape = shapes.table.shape
    rows = LARGEST_TABLE // (8 * shape[1] * shape[2]) + 1
    # One number seen from everywhere: as large as that only in name.
    table = np.broadcast_to(np.complex64(1.0), (rows, *shape[1:]))
    with pytest.raises(ParameterError, match="reduce cells, elements_per_bay"):
        resource(replace(track.body, shapes=replace(shapes, table=table)), track.table, "{}")


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
