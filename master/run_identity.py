"""What a run is made with, for telling runs apart."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from importlib.metadata import version

from railcosim.master.component import Component
from railcosim.master.cosimulation import Cosimulation

About = Mapping[str, str | float]
"""What a run is made with beyond its system and scheme: parameters, speed, irregularity."""


def identity_of(run: Cosimulation, about: About) -> dict[str, str]:
    """All that a run is made with, but its end."""
    system = run.system
    return {
        "railcosim": version("railcosim"),
        "scheme and step": run.context,
        "start": repr(run.start),
        **{f"component {c.name}": _kind(c) for c in system.components},
        "connections": ", ".join(map(str, system.connections)),
        **{k: v if isinstance(v, str) else repr(float(v)) for k, v in about.items()},
    }


def _kind(component: Component) -> str:
    """What a component is: the digest of an FMU's file, or a class."""
    description = getattr(component, "description", None)
    return f"sha256 {description.sha256}" if description is not None else type(component).__name__


def digest_of(identity: Mapping[str, str]) -> str:
    """A short form of an identity, for files that go with a run."""
    return hashlib.sha256(json.dumps(dict(identity), sort_keys=True).encode()).hexdigest()


def difference(there: Mapping[str, str], here: dict[str, str]) -> str:
    """Say what differs, the first three things by name and both values."""
    keys = [k for k in {**there, **here} if there.get(k) != here.get(k)]
    sentences = [
        f"{k} is {there.get(k, 'not given')!r} there and {here.get(k, 'not given')!r} here"
        for k in keys[:3]
    ]
    more = [f"and {len(keys) - 3} more"] if len(keys) > 3 else []
    return "; ".join(sentences + more)
