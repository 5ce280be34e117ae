"""The folder of a build: which of its files the project wrote, from what, and which of them may be replaced."""

from __future__ import annotations

import os
from collections.abc import Iterable, Sequence
from pathlib import Path

from identification.base.errors import InputError
from identification.base.files import is_file, note, noted_name, require_folder, require_replaceable, true_path
from identification.base.manifest import Written, content_of, read_journal, read_manifest, write_manifest

JOURNAL = ".antiwindup.journal"
"""What the steps of a build put into their places, while it runs: after a kill the manifest is not up to date."""


class OutputFolder:
    """What stands in a folder and what the project knows of it.

    Parameters
    ----------
    path
        The folder, which this process alone writes to. The files that a build had begun when it was killed are the
        project's if they are as its journal has them, before or after; others are somebody else's.

    Attributes
    ----------
    written
        What its manifest lists.

    Raises
    ------
    InputError
        The manifest or the journal is none.
    """

    def __init__(self, path: Path) -> None:
        self.path, self.journal, self._contents = path, path / JOURNAL, dict[Path, str | None]()
        self._begun = set[Path]()
        self.written = read_manifest(path)
        noted = read_journal(self.journal)
        for name, written in list(self.written.items()):
            if written.content is None:
                content = None if os.path.islink(path / name) else self.content(path / name)  # noqa: PTH114
                del self.written[name]
                if content in noted.get(noted_name(self.journal, path / name), set()):
                    self.written[name] = Written("", content)

    def name(self, path: Path) -> str:
        """The name of a file in the manifest."""
        return path.relative_to(self.path).as_posix()

    def content(self, path: Path) -> str | None:
        """The SHA-256 of any file, None if it is not there."""
        if path in self._begun:
            return content_of(path)
        if path not in self._contents:
            self._contents[path] = content_of(path)
        return self._contents[path]

    def require_free(self, paths: Sequence[Path]) -> None:
        """Refuse, with an InputError, places of outputs that hold what the project did not write or may not replace."""
        for folder in {path.parent for path in paths}:
            if folder != self.path and folder.is_symlink():
                raise InputError(f"{folder}: is a link; expected a folder for the outputs, or none")
            if os.path.lexists(folder):
                require_folder(folder)
        for path in paths:
            self._contents.pop(path, None)
            written = self.written.get(self.name(path))
            if os.path.lexists(path) and (written is None or path.is_symlink()):
                raise InputError(
                    f"{path}: exists already and is not an output of this program; expected another folder, or --force"
                )
            if written is not None and self.content(path) not in (None, written.content):
                raise InputError(f"{path}: was changed since it was written; expected another folder, or --force")
            require_replaceable(path)

    def require_no_input(self, inputs: Iterable[Path], paths: Sequence[Path]) -> None:
        """Refuse, with an InputError, inputs that are outputs, of this build or of another one into the folder."""
        places = {true_path(path): path for path in (*(self.path / name for name in self.written), *paths)}
        for path in inputs:
            if (place := places.get(true_path(path))) is not None:
                raise InputError(f"{path}: is an output in {place.parent} too; expected another folder to write to")

    def holds(self, source: str, paths: Iterable[Path]) -> bool:
        """Whether files stand there as they were written, from this source."""
        found = [(self.written.get(self.name(path)), self.content(path)) for path in paths]
        return all(content is not None and written == Written(source, content) for written, content in found)

    def begin(self, source: str, paths: Iterable[Path]) -> None:
        """Note, on the disk too, that files are about to be written; raises InputError where their folder cannot be."""
        for path in paths:
            try:
                path.parent.mkdir(exist_ok=True)
                if is_file(path):
                    note(self.journal, {path: path})
            except OSError as error:
                raise InputError(f"{path}: cannot be written ({error.strerror})") from None
            self.written[self.name(path)] = Written(source, None)
            self._begun.add(path)
            self._contents.pop(path, None)
        write_manifest(self.path, self.written)

    def end(self, paths: Iterable[Path]) -> None:
        """Note what the files that were begun hold."""
        for path in paths:
            name = self.name(path)
            self._begun.discard(path)
            self.written[name] = Written(self.written[name].source, self.content(path))

    def remove(self, paths: Iterable[Path]) -> None:
        """Remove those files that the project wrote or has begun; what was changed since is the user's from now on.

        Raises
        ------
        InputError
            A file may not be removed.
        """
        noted = read_journal(self.journal)
        for path in paths:
            written = self.written.get(self.name(path))
            ours = noted.get(noted_name(self.journal, path), set()) if written and not written.content else set()
            try:
                if written and is_file(path) and not path.is_symlink() and content_of(path) in {written.content, *ours}:
                    path.unlink(missing_ok=True)
            except OSError as error:
                raise InputError(f"{path}: cannot be removed ({error.strerror})") from None
            self.written.pop(self.name(path), None)
            self._begun.discard(path)
            self._contents.pop(path, None)

    def save(self) -> None:
        """Write the manifest; where nothing in it is only begun, it needs no journal any more."""
        write_manifest(self.path, self.written)
        if all(written.content for written in self.written.values()):
            self.journal.unlink(missing_ok=True)
