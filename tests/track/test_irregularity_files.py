"""Profiles in CSV files as the world writes them, and the mistakes in them."""

import warnings
from pathlib import Path

import numpy as np
import pytest

from railcosim.parameters import ParameterError
from railcosim.track.irregularity import Profile, read_profile, synthesise, write_profile

X, LEFT, RIGHT = [0.0, 0.5, 1.0, 1.5], [0.0, 1.25e-3, -2e-4, 0.0], [1e-4, 0.0, 0.0, 3e-3]


def read(tmp_path, content) -> Profile:
    path = tmp_path / "track.csv"
    path.write_bytes(content if isinstance(content, bytes) else content.encode())
    return read_profile(path)


def table(between=",", decimal=".", scale=1.0, order=(0, 1, 2), end="\n") -> str:
    columns = (X, [scale * z for z in LEFT], [scale * z for z in RIGHT])
    rows = zip(*(columns[k] for k in order), strict=True)
    return end.join(between.join(f"{v:.9g}".replace(".", decimal) for v in row) for row in rows)


@pytest.mark.parametrize(
    "content",
    [
        "x,left,right\n" + table(),
        b"\xef\xbb\xbfx,left,right\r\n" + table(end="\r\n").encode(),
        "x;left;right\n" + table(";"),
        "x;left;right\n" + table(";", ","),
        "x\tleft\tright\n" + table("\t", ","),
        "right,x,left\n" + table(order=(2, 0, 1)),
        " X , LEFT,Right \n" + table(", "),
        "x (m),left [m], right(m)\n" + table(),
        "x (m);left (mm);right (mm)\n" + table(";", ",", 1e3),
        '"x";"left";"right"\n' + table(";"),
        "# by hand, x;y\n\nx,left,right\n# and here\n" + table() + "\n\n  # end\n",
        "# H\xf6he in m\nx,left,right\n".encode("latin-1") + table().encode(),
        "# down;;\nx;left;right\n" + table(";") + "\n;;\n",
        "x,left,right\r" + table(end="\r"),
    ],
    ids=["plain", "spreadsheet", "semicolon", "decimal comma", "tab", "order", "capitals", "units",
         "mm", "quotes", "comments", "latin-1", "padded", "old mac"],
)  # fmt: skip
def test_the_same_profile_in_many_clothes(tmp_path, content) -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        profile = read(tmp_path, content)
    assert profile.x.tolist() == X
    assert profile.left == pytest.approx(LEFT, rel=1e-12)  # mm to m rounds
    assert profile.right == pytest.approx(RIGHT, rel=1e-12)
    assert (profile.fade, profile.level_beyond) == (0.0, False)


def test_without_right_both_rails_are_alike(tmp_path) -> None:
    profile = read(tmp_path, "left,x\n" + table(order=(1, 0)))
    assert np.array_equal(profile.left, profile.right)


def test_a_written_profile_is_read_back(tmp_path) -> None:
    profile = synthesise("ballastless", 50.0, quantities=["all"])
    write_profile(profile, tmp_path / "p.csv")
    again = read_profile(tmp_path / "p.csv")
    for name in ("x", "left", "right", "left_y", "right_y"):
        assert np.array_equal(getattr(profile, name), getattr(again, name))


@pytest.mark.parametrize(
    ("header", "row", "rails"),
    [
        ("x,left_z,right_z", "1,2", (1, 2, None, None)),
        ("x,left,right,left_y,right_y", "1,2,3,4", (1, 2, 3, 4)),
        ("x,right_y,left_y", "4,3", (0, 0, 3, 4)),
        ("x,left_y", "3", (0, 0, 3, 3)),
        ("x,vertical", "1", (1, 1, None, None)),
        ("x,Cross-level,vertical", "2,5", (6, 4, None, None)),
        ("x,gauge", "2", (0, 0, -1, 1)),
        ("x,vertical,cross level,alignment,gauge", "1,2,3,4", (2, 0, 1, 5)),
    ],
)
def test_rails_or_geometry_by_their_columns(tmp_path, header, row, rails) -> None:
    """In mm, by hand: gauge 2 wider has the right rail 1 to the right, the left one to the left."""
    units = ",".join(f"{name} (mm)" if name != "x" else name for name in header.split(","))
    ends = ["0" + ",0" * row.count(",") + ",0", f"1,{row}"]
    rows = [ends[0], ends[1], ends[0].replace("0", "2", 1), ends[0].replace("0", "3", 1)]
    profile = read(tmp_path, "\n".join([units, *rows]))
    found = (profile.left, profile.right, profile.left_y, profile.right_y)
    for rail, expected in zip(found, rails, strict=True):
        if expected is None:
            assert rail is None
        else:
            assert rail == pytest.approx([0.0, 1e-3 * expected, 0.0, 0.0], abs=1e-15)


def test_geometry_and_rails_are_one_profile(tmp_path) -> None:
    """What is read of quantities has these quantities."""
    profile = read(tmp_path, "x,vertical,cross_level,alignment,gauge\n" + "\n".join(
        f"{k},{1e-3 * k},{2e-3 * k},{-3e-3 * k},{4e-3 * k}" for k in range(4)
    ))  # fmt: skip
    for name, slope in zip(profile.quantities, (1e-3, 2e-3, -3e-3, 4e-3), strict=True):
        assert profile.quantities[name] == pytest.approx(slope * np.arange(4), abs=1e-17)


@pytest.mark.parametrize(
    ("content", "says"),
    [
        ("", "header is ''"),
        ("x,z\n0,0\n", r"line 1: the header is 'x,z'; wanted: x,left,right or x,left"),
        ("x,left,left\n0,0,0\n", "header"),
        ("x,left,right,gauge\n0,0,0,0\n", "header is 'x,left,right,gauge'"),
        ("x,right\n0,0\n", "header is 'x,right'"),
        ("x,left,right_y\n0,0,0\n", "header is 'x,left,right_y'"),
        ("x,left,left_z\n0,0,0\n", "header"),
        ("vertical,gauge\n0,0\n", "header"),
        ("x\n0\n", "header"),
        ("x,gauge (mm)\n0,1435\n1,1436\n2,1434\n3,1435\n", "0.718 m off their places aside"),
        ("x,left (inch)\n0,0\n", "header"),
        ("0,0\n1,0\n2,0\n3,0\n", "header is '0,0'"),
        ("x left\n0 0\n", "header"),
        (b"\xff\xfex\x00,\x00l\x00", "header"),
        (b"\x1b[31mx,left\n0,0\n", r"header is '\\x1b\[31mx,left'"),
        ("x,left\n0,0\n1,0\n", "four rows"),
        ("x,left\n0,0\n1,0\n0.5,0\n2,0\n", "increase"),
        ("x,left\n0,0\n1,nan\n2,0\n3,0\n", "line 3"),
        ("x,left\n0,0\n1,soft\n2,0\n3,0\n", "line 3.*'1,soft'"),
        ("x,left\n0,0\n1,0,0\n2,0\n3,0\n", "line 3"),
        ("x,left\n0,0\n1_0,0\n20,0\n30,0\n", "line 3"),
        ("x;left\n0;0\n1;1.234,5\n2;0\n3;0\n", "line 3"),
        ('x,left\n"0\n0",1\n1,0\n2,0\n3,0\n4,0\n', "line 2"),
        ("x,left\n0,0\n5e-324,1e-3\n1e-323,0\n2e-323,0\n100,0\n", "1e-06 m or more"),
        ("x,left\n-1e308,0\n0,0\n1e300,1e-3\n1e308,0\n", "1e.08 m"),
        ("x,left\n0,0\n1,1e308\n2,-1e308\n3,0\n", "in mm"),
        ("x,left\n0,0\n1,3\n2,-2\n3,0\n", "in mm"),
        ("x,left\n0," + "1" * 200_000 + "\n", "line 2: over 1000 characters"),
        ("x,left\n" + " " * 2000, "line 2"),
    ],
)
def test_a_bad_profile_is_refused(tmp_path, content, says) -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("error")  # nothing overflows on the way
        with pytest.raises(ParameterError, match=says) as refused:
            read(tmp_path, content)
    assert "\n" not in str(refused.value)
    assert str(refused.value).isprintable()


def test_an_endless_file_is_refused() -> None:
    with pytest.raises(ParameterError, match="line 1: over"):
        read_profile(Path("/dev/zero"))


@pytest.mark.parametrize("what", ["missing.csv", "."])
def test_what_cannot_be_read(tmp_path, what) -> None:
    with pytest.raises(ParameterError, match="cannot be read"):
        read_profile(tmp_path / what)


def test_heights_that_look_like_millimetres(tmp_path) -> None:
    with pytest.warns(UserWarning, match=r"0\.3 m about their mean: meant mm"):
        read(tmp_path, "x,left\n0,0.3\n1,-0.3\n2,0.3\n3,-0.3\n")
