"""An FMU that needs nothing where it is imported: the compiled C runtime and model.bin."""

from __future__ import annotations

import hashlib
import uuid
from collections.abc import Callable
from dataclasses import dataclass
from importlib.metadata import version
from pathlib import Path

from railcosim.compiling.platforms import Platform, platforms_named
from railcosim.storage.archive import write_archive

from .content import Content, profiles_json
from .description import fmi2, fmi3
from .description.about import NATIVE, Description
from .description.extras import extras
from .description.kind import KINDS
from .description.structure import states_of
from .native_runtime.compile import build, headers, sources
from .native_runtime.resource import resource
from .native_runtime.universal import universal
from .roles import PROFILES, Role
from .stepping_variables import derivatives_of_step

(MAC,) = platforms_named("darwin64")
WRITERS = {2: fmi2.model_description, 3: fmi3.model_description}


@dataclass(frozen=True)
class NativeRuntime:
    """FMI 2.0 or 3.0, Co-Simulation and, without contacts or gaps inside, Model Exchange.

    Attributes
    ----------
    fmi : int
        Version, 2 or 3.
    platforms : tuple of Platform, optional
        What to compile for; this machine if not given.
    model_exchange : bool
        Whether tracks are for Model Exchange as well in FMI 2.0, which lists each of their
        thousands of states as a variable: some tools take minutes to load that. Vehicles, and
        FMI 3.0 with its arrays, always have it.
    documented : bool
        Whether they have what people and others' tools look at: pages, pictures, reference runs,
        terminals. It takes a third of an export.
    """

    fmi: int = 2
    platforms: tuple[Platform, ...] | None = None
    model_exchange: bool = False
    documented: bool = True

    def prepare(self, progress: Callable[[str], None]) -> None:
        """Compile, so that a missing compiler is told before anything is computed."""
        build(self.fmi, self.platforms, progress)

    def pack(self, content: Content, target: Path, progress: Callable[[str], None]) -> str:
        """Write the FMU; return the digest of what was written."""
        libraries = build(self.fmi, self.platforms, progress)
        progress(f"packing {target.name}")
        entries = self._entries(content)
        for platform, binary in self._binaries(libraries).items():
            place = f"binaries/{platform.folder(self.fmi)}/{content.name}{platform.suffix}"
            entries[place] = binary
        return write_archive(target, entries)

    def _binaries(self, libraries: dict[Platform, Path]) -> dict[Platform, bytes]:
        """What goes into the folder of each platform."""
        binaries = {platform: path.read_bytes() for platform, path in libraries.items()}
        macs = [platform for platform in binaries if platform.suffix == MAC.suffix]
        if self.fmi == 2 and macs:
            # Importers of FMI 2.0 look there on either kind of Mac.
            return binaries | {MAC: universal([binaries[mac] for mac in macs])}
        return binaries

    def _entries(self, content: Content) -> dict[str, bytes]:
        """All but the binaries, by place in the archive."""
        kind, body = KINDS[content.model], content.body
        table = [*content.table, derivatives_of_step()]
        seen = [v.name for v in table if v.role is Role.OUT_SEEN]
        shown = states_of(body, seen) if self._shows_states(content) else None
        profiles = content.profiles
        model = resource(body, table, guid="", profiles=profiles)
        guid = _guid(model, with_states=shown is not None)
        about = Description(
            name=content.name,
            guid=guid,
            version=version("railcosim"),
            text=content.text,
            capabilities=NATIVE,
            annotations=content.annotations,
        )
        files = [path.name for path in sources(self.fmi)]
        entries = {
            "modelDescription.xml": WRITERS[self.fmi](about, table, shown, files),
            "resources/model.bin": resource(body, table, guid, profiles),
        }
        if profiles is not None:
            entries[f"resources/{PROFILES}"] = profiles_json(profiles)
        for path in sources(self.fmi) + headers(self.fmi):
            entries[f"sources/{path.name}"] = path.read_bytes()
        if not self.documented:
            return entries
        return entries | extras(
            about, kind, table, body, fmi=self.fmi, parameters=content.parameters,
            model_exchange=shown is not None, sources=files, profiles=profiles,
        )  # fmt: skip

    def _shows_states(self, content: Content) -> bool:
        is_long = self.fmi == 2 and content.model == "track"
        linear = not content.has_contact and content.body.gaps is None
        return linear and (self.model_exchange or not is_long)


def _guid(model: bytes, *, with_states: bool) -> str:
    """The same content, the same GUID."""
    digest = hashlib.sha256(model + bytes([with_states])).digest()
    return "{" + str(uuid.UUID(bytes=digest[:16])) + "}"
