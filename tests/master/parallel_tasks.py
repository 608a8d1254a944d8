"""Tasks for test_parallel, in a module that worker processes can import."""

import os
import time


def square(x, progress):
    progress(1, 2)
    return x * x, os.getpid()


def fail(progress):
    raise ValueError("no such track")


def nap(file, progress):
    """Too long, without a word, after having said where."""
    file.write_text(str(os.getpid()))
    time.sleep(600)


def for_ever(progress):
    while True:
        progress(0, 1)
        time.sleep(0.01)
