"""When requests to end are obeyed."""

# ruff: noqa: PT012 - what happens inside the block is what is tested

from __future__ import annotations

import signal

import pytest

from railcosim.storage.interruption import Terminated, finishing, noting, obey_all

KINDS = [(signal.SIGINT, KeyboardInterrupt, "^$"), (signal.SIGTERM, Terminated, "terminated")]


@pytest.fixture(autouse=True)
def _handlers():
    """As in our commands; and nothing is left of it."""
    before = {s: signal.getsignal(s) for s in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)}
    obey_all()
    ours = {s: signal.getsignal(s) for s in before}
    yield
    assert {s: signal.getsignal(s) for s in before} == ours
    for number, handler in before.items():
        signal.signal(number, handler)


@pytest.mark.parametrize(("number", "kind", "words"), KINDS)
def test_at_once(number, kind, words):
    with pytest.raises(kind, match=words):
        signal.raise_signal(number)


@pytest.mark.parametrize(("number", "kind", "words"), KINDS)
def test_noted(number, kind, words):
    done = []
    with pytest.raises(kind, match=words), noting() as check:
        check()
        signal.raise_signal(number)
        done.append("the rest of the step")
        check()
        done.append("never")
    assert done == ["the rest of the step"]


def test_the_second_does_not_wait():
    with pytest.raises(KeyboardInterrupt), noting():
        signal.raise_signal(signal.SIGINT)
        signal.raise_signal(signal.SIGTERM)
        raise AssertionError


def test_noted_too_late_for_a_check():
    done = []
    with pytest.raises(KeyboardInterrupt), noting():
        signal.raise_signal(signal.SIGINT)
        done.append("all of it")
    assert done


@pytest.mark.parametrize("times", [1, 2, 5])
@pytest.mark.parametrize(("number", "kind", "words"), KINDS)
def test_finished(number, kind, words, times):
    done = []
    with pytest.raises(kind, match=words), finishing():
        for _ in range(times):
            signal.raise_signal(number)
        done.append("all of it")
    assert done


def test_a_run_and_its_results():
    """Interrupted once; what comes after it is finished, whatever is asked."""
    done = []
    with finishing():
        with pytest.raises(Terminated), noting() as check:
            signal.raise_signal(signal.SIGTERM)
            check()
        signal.raise_signal(signal.SIGINT)
        with noting():
            signal.raise_signal(signal.SIGINT)
            signal.raise_signal(signal.SIGINT)
        done.append("results")
    assert done


def test_an_ended_run_and_its_results():
    """Noted at the last moment of the run, raised behind the results."""
    done = []
    with pytest.raises(KeyboardInterrupt), finishing():
        with noting():
            signal.raise_signal(signal.SIGINT)
        done.append("results")
    assert done


def test_ignored_stays_ignored():
    signal.signal(signal.SIGHUP, signal.SIG_IGN)
    with noting() as check:
        signal.raise_signal(signal.SIGHUP)
        check()
    assert signal.getsignal(signal.SIGHUP) is signal.SIG_IGN
    signal.signal(signal.SIGHUP, signal.SIG_DFL)
    obey_all()
