"""A library is kept again, under the same name, while another process calls the one before."""

import subprocess
import sys

from railcosim.compiling.kept import digest, find, keep

from ..c_compiler import c_compiler

CALLS = """import ctypes, sys
library = ctypes.CDLL(sys.argv[1])
print("loaded", flush=True)
while library.told() == 7 and sys.stdin.readline():
    library.set(7)
    print("called", flush=True)
"""
SOURCE = """int number = 7, filled[20000] = {1};
int told(void) { return number * filled[0]; }
void set(int n) { number = n; filled[0] = 1; }
"""


def test_who_has_it_loaded_sees_nothing_of_it(tmp_path):
    """Written in place, it would end by SIGBUS: pages of a file that is short for a moment."""
    source, made = tmp_path / "c.c", tmp_path / "c.so"
    source.write_text(SOURCE)
    subprocess.run([*c_compiler(), "-shared", "-fPIC", "-o", made, source], check=True)
    content = made.read_bytes()
    cache = tmp_path / "cache"
    cache.mkdir()
    place = keep(cache, "c", ".so", content)
    with subprocess.Popen(
        [sys.executable, "-c", CALLS, str(place)],
        stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True,
    ) as other:  # fmt: skip
        assert other.stdout.readline() == "loaded\n"
        for _ in range(20):
            other.stdin.write("again\n")
            other.stdin.flush()
            assert keep(cache, "c", ".so", content) == place
            assert other.stdout.readline() == "called\n"
        other.communicate(timeout=1800)
    assert other.returncode == 0
    assert find(cache, "c", ".so") == place
    assert place.name == f"c-{digest(content)}.so"
    assert list(cache.iterdir()) == [place]
