"""The folder of a build: which of its files the project wrote, from what, and which of them may be replaced."""

from __future__ import annotations

import os
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from identification.base.errors import InputError
from identification.base.files import is_there, require_folder, require_replaceable
from identification.base.manifest import Written, content_of, write_manifest


@dataclass
class OutputFolder:
    """What stands in a folder and what the project knows of it.

    Parameters
    ----------
    path
        The folder.
    written
        What its manifest lists.
    contents
        The SHA-256 of each file that was looked at, None of one that is not there.
    """

    path: Path
    written: dict[str, Written]
    contents: dict[Path, str | None] = field(default_factory=dict)

    def name(self, path: Path) -> str:
        """The name of a file in the manifest."""
        return path.relative_to(self.path).as_posix()

    def content(self, path: Path) -> str | None:
        """The SHA-256 of any file, None if it is not there."""
        if path not in self.contents:
            self.contents[path] = content_of(path)
        return self.contents[path]

    def require_free(self, paths: Sequence[Path]) -> None:
        """Refuse, with an InputError, places of outputs that hold what the project did not write or may not replace."""
        for folder in {path.parent for path in paths}:
            if is_there(folder):
                require_folder(folder)
        for path in paths:
            written = self.written.get(self.name(path))
            if written is None and os.path.lexists(path):
                raise InputError(
                    f"{path}: is there already, written by somebody else; expected another folder, or --force"
                )
            if (
                written is not None
                and written.content is not None
                and self.content(path) not in (None, written.content)
            ):
                raise InputError(f"{path}: was changed since it was written; expected another folder, or --force")
            require_replaceable(path)

    def holds(self, source: str, paths: Iterable[Path]) -> bool:
        """Whether files stand there as they were written, from this source."""
        found = [(self.written.get(self.name(path)), self.content(path)) for path in paths]
        return all(content is not None and written == Written(source, content) for written, content in found)

    def begin(self, source: str, paths: Iterable[Path]) -> None:
        """Note, on the disk too, that files are about to be written: whatever stands there then is the project's."""
        for path in paths:
            path.parent.mkdir(exist_ok=True)
            self.written[self.name(path)] = Written(source, None)
            self.contents.pop(path, None)
        self.save()

    def end(self, paths: Iterable[Path]) -> None:
        """Note what the files that were begun hold."""
        for path in paths:
            name = self.name(path)
            self.written[name] = Written(self.written[name].source, self.content(path))

    def remove(self, paths: Iterable[Path]) -> None:
        """Remove those files that the project wrote or has begun; what was changed since is the user's from now on."""
        for path in paths:
            written = self.written.pop(self.name(path), None)
            if written and written.content in (None, content_of(path)):
                path.unlink(missing_ok=True)
            self.contents.pop(path, None)

    def forget_all_but(self, paths: Iterable[Path]) -> None:
        """Remove all other files that the project wrote and nobody changed; that one was begun says nothing of it."""
        others = set(self.written) - {self.name(path) for path in paths}
        self.remove(self.path / name for name in others if self.written[name].content is not None)
        self.written = {name: written for name, written in self.written.items() if name not in others}

    def save(self) -> None:
        """Write the manifest."""
        write_manifest(self.path, self.written)
