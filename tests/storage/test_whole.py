"""Files whole or not at all, and targets tried first."""

# ruff: noqa: PT012 - what happens inside the block is what is tested

from __future__ import annotations

import os
import resource
import stat

import pytest

from railcosim.storage.whole import TargetError, check_target, write_whole, written_whole

MKNOD = pytest.mark.skipif(
    not hasattr(os, "geteuid") or os.geteuid() != 0, reason="only root makes devices"
)


def test_replaced_at_the_end_only(tmp_path):
    target = tmp_path / "x.nc"
    target.write_text("old")
    with written_whole(target) as partial:
        partial.write_text("new")
        assert (partial.suffix, partial.parent) == (".nc", tmp_path)
        assert target.read_text() == "old"
    assert target.read_text() == "new"
    with pytest.raises(ZeroDivisionError), written_whole(target) as partial:
        partial.write_text("half")
        raise ZeroDivisionError
    assert target.read_text() == "new"
    assert list(tmp_path.iterdir()) == [target]


def test_two_at_once_do_not_mix(tmp_path):
    target = tmp_path / "x"
    with written_whole(target) as first, written_whole(target) as second:
        assert first != second
        first.write_text("first")
        second.write_text("second")
    assert target.read_text() == "first"  # the last to end
    assert list(tmp_path.iterdir()) == [target]


def test_line_ends_and_letters_stay(tmp_path):
    write_whole(tmp_path / "x", "ü\n\r\n")
    assert (tmp_path / "x").read_bytes() == b"\xc3\xbc\n\r\n"


def test_a_link_stays_one(tmp_path):
    (tmp_path / "link").symlink_to(tmp_path / "x")
    write_whole(tmp_path / "link", b"1")
    write_whole(tmp_path / "link", b"2")
    assert (tmp_path / "link").is_symlink()
    assert (tmp_path / "x").read_bytes() == b"2"


def test_a_long_name(tmp_path):
    """As long as any file system has: the name beside it is not longer."""
    target = tmp_path / ("x" * 252 + ".nc")
    check_target(target)
    write_whole(target, b"1")
    assert target.read_bytes() == b"1"


@MKNOD
@pytest.mark.parametrize("through", ["itself", "link"])
def test_a_device_is_not_replaced(tmp_path, through):
    device = tmp_path / "null"
    os.mknod(device, stat.S_IFCHR | 0o666, os.makedev(1, 3))
    target = device
    if through == "link":
        target = tmp_path / "link"
        target.symlink_to(device)
    for act in (check_target, lambda path: write_whole(path, b"1")):
        with pytest.raises(TargetError, match=r"null: is a device|link: is a device"):
            act(target)
    assert stat.S_ISCHR(device.stat().st_mode)


def test_what_is_no_file(tmp_path):
    os.mkfifo(tmp_path / "pipe")
    with pytest.raises(TargetError, match="pipe: is a pipe"):
        check_target(tmp_path / "pipe")
    with pytest.raises(TargetError, match=": is a folder"):
        check_target(tmp_path)
    with pytest.raises(TargetError, match=r"there is no folder .*none"):
        check_target(tmp_path / "none" / "x")
    (tmp_path / "circle").symlink_to(tmp_path / "circle")
    with pytest.raises(TargetError, match="circle: cannot be written"):
        check_target(tmp_path / "circle")
    with pytest.raises(TargetError, match=r"cannot be written .*long"):
        check_target(tmp_path / ("x" * 300))


def test_a_trial_changes_nothing(tmp_path):
    (tmp_path / "x").write_text("old")
    check_target(tmp_path / "x")
    check_target(tmp_path / "y")
    assert [p.name for p in tmp_path.iterdir()] == ["x"]
    assert (tmp_path / "x").read_text() == "old"


def test_no_room(tmp_path):
    """A limit on the size of files stands for a full disk: the same error in the same calls."""
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    (tmp_path / "x").write_text("old")
    resource.setrlimit(resource.RLIMIT_FSIZE, (1000, before[1]))
    try:
        with pytest.raises(TargetError, match=r"x: cannot be written \(File too large\)"):
            check_target(tmp_path / "x")
        with pytest.raises(OSError, match="File too large"):
            write_whole(tmp_path / "x", bytes(2000))
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)
    assert (tmp_path / "x").read_text() == "old"
    assert [p.name for p in tmp_path.iterdir()] == ["x"]
