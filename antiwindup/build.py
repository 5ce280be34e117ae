"""A build: the steps whose command, inputs or code changed are run, each in a process of its own, several at once."""

from __future__ import annotations

import json
from collections.abc import Callable, Sequence
from contextlib import ExitStack
from dataclasses import dataclass, field
from functools import cached_property
from graphlib import TopologicalSorter
from hashlib import sha256
from multiprocessing.connection import wait
from multiprocessing.process import BaseProcess
from pathlib import Path

from antiwindup.code_files import code_of
from antiwindup.output_folder import OutputFolder
from antiwindup.steps import Step
from antiwindup.worker import load_ahead, start
from identification.base.errors import InputError
from identification.base.files import is_folder, note, write_whole
from identification.base.folder_lock import locked_folder
from identification.base.partial_files import partial_file

REFUSED, USAGE = "Error: ", "Usage: "
LOST = 255  # what multiprocessing says of a process whose fork server is gone

Tell = Callable[[int, Sequence[str]], object]
"""Called before each wait, with the number of steps that have ended and the names of those that run."""


class Crash(Exception):
    """A command ended in no way that it should; the message is what it printed."""


@dataclass(frozen=True)
class _Running:
    step: Step
    stage: int
    source: str
    process: BaseProcess
    log: Path
    closing: ExitStack


@dataclass
class Build:
    """A folder and the steps that belong into it.

    Parameters
    ----------
    path
        The folder, which is made if it is not there. It may hold anything else: files that the project did not write,
        and those that were changed since, are neither replaced nor removed.
    steps
        All that belongs into the folder, each after those that it needs. What the project wrote there before and no
        step writes is removed.
    inputs
        The files that the steps are given, which are none of the outputs.
    wanted
        The steps that are run, with those that they need. Of the others, what is not of the same inputs, options and
        code is removed.
    goes_on
        Whether a step that refuses, if it is not vital, stops only those that need its outputs. What was refused is
        asked again in every build.
    jobs
        How many run at once.
    force
        Whether files in the places of outputs are replaced whoever wrote them.
    printed, refused
        What the steps that ran printed, and the sentences of those that refused, by the steps' names.
    """

    path: Path
    steps: Sequence[Step]
    inputs: Sequence[Path]
    wanted: Sequence[Step]
    goes_on: bool
    jobs: int
    force: bool = False
    printed: dict[str, str] = field(default_factory=dict)
    refused: dict[str, str] = field(default_factory=dict)
    _running: dict[int, _Running] = field(default_factory=dict)
    _untouched: set[Step] = field(default_factory=set)

    @cached_property
    def needed(self) -> list[Step]:
        """The steps that are wanted and those that they need, in their order."""
        found, read = [], set[Path]()
        for step in reversed(self.steps):
            if step in self.wanted or read & {*step.outputs}:
                found.append(step)
                read |= {*step.needs, *step.uses}
        return found[::-1]

    @property
    def runs(self) -> int:
        """How often a step that is needed is looked at: once, and once for each of its stages."""
        return sum(1 + len(step.stages) for step in self.needed)

    def run(self, tell: Tell) -> None:
        """Bring the files up to date.

        Raises
        ------
        InputError
            Another process writes into the folder; the place of an output is taken; or a step refused that stops all.
        Crash
            A step ended in no way that it should.
        """
        with locked_folder(self.path):
            self._folder = OutputFolder(self.path)
            places = [path for step in self.steps for path in (*step.outputs, step.refusal)]
            self._folder.require_no_input(self.inputs, places)
            self._seen = {path: _signature(path) for path in self.inputs}
            if not self.force:
                self._folder.require_free(places)
            self._folder.remove({self.path / name for name in self._folder.written} - {*places})
            try:
                self._run(tell)
                for step in self.steps:
                    if step not in self.needed and not self._folder.holds(self._source(step), step.outputs):
                        self._remove([step])
            finally:
                for running in self._running.values():
                    running.process.terminate()
                    running.process.join()
                    running.closing.close()
                self._folder.save()

    def _run(self, tell: Tell) -> None:
        """Run the steps, each after those that make what it reads."""
        steps = self.needed
        makers = {output: step for step in steps for output in (*step.outputs, step.refusal)}
        sorter = TopologicalSorter[tuple[Step, int]]()  # a run is a step and the number of its stage
        for step in steps:
            for stage, files in enumerate((*step.stages, step.uses)):
                made_before = {makers[path] for path in (*step.needs, *files) if path in makers}
                runs_before = [(maker, len(maker.stages)) for maker in made_before]
                sorter.add((step, stage), *runs_before, *([(step, stage - 1)] if stage else []))
        sorter.prepare()
        self._untouched = {*steps}
        done, waiting = 0, list[tuple[Step, int]]()
        while sorter.is_active():
            waiting = sorted([*waiting, *sorter.get_ready()], key=lambda run: (_is_last(*run), steps.index(run[0])))
            ended = []
            while waiting and len(self._running) < self.jobs:
                if self._settled(*(run := waiting.pop(0))):
                    ended.append(run)
            if not ended:
                if done + len(self._running) < self.runs:
                    load_ahead()
                tell(done, [running.step.name for running in self._running.values()])
                ended = [self._settle(self._running.pop(number)) for number in wait(list(self._running))]  # type: ignore[arg-type]
            for run in ended:
                sorter.done(run)
                done += 1

    def _settled(self, step: Step, stage: int) -> bool:
        """Whether nothing is to be done for a step in a stage; if something is, it is started."""
        folder = self._folder
        self._untouched.discard(step)
        if any(folder.content(path) is None for path in step.needs):
            self._remove([step])
            return True
        if folder.holds(self._source(step), step.outputs):
            return True
        if not _is_last(step, stage):  # what an earlier build left of other inputs must not stand beside the new
            for other in self.needed:
                if other in self._untouched and not folder.holds(self._source(other), other.outputs):
                    self._remove([other])
        source = self._source(step)
        if not self.force:
            folder.require_free(step.outputs)  # as they are by now
        folder.begin(source, step.outputs)
        for path in step.outputs:
            if self.force and not is_folder(path):  # which the command refuses
                path.unlink(missing_ok=True)
        with ExitStack() as stack:
            log = stack.enter_context(partial_file(self.path, ".log"))
            process = start(step.command, log, folder.journal)
            closing = stack.pop_all()
        self._running[process.sentinel] = _Running(step, stage, source, process, log, closing)
        return False

    def _settle(self, ended: _Running) -> tuple[Step, int]:
        """Note how a step ended."""
        step, folder = ended.step, self._folder
        ended.process.join()
        said = ended.log.read_text(encoding="utf-8", errors="replace")
        ended.closing.close()
        for path, seen in self._seen.items():
            if _signature(path) != seen:
                self._remove(self._after([step]))
                raise InputError(f"{path}: was changed while the build ran; give the same command again")
        if ended.process.exitcode == 0 and all(folder.content(path) for path in step.outputs):
            folder.end(step.outputs)
            folder.remove([step.refusal])
            self.printed[step.name] = said
            return step, ended.stage
        *before, sentence = said.strip().splitlines() or [""]
        is_refusal = (
            ended.process.exitcode == 2
            and sentence.startswith(REFUSED)
            and not any(line.startswith(USAGE) for line in before)
        )
        sentence = sentence.removeprefix(REFUSED)
        if not is_refusal or step.is_vital or not self.goes_on:
            self._remove(self._after([step]))
            if is_refusal:
                raise InputError(sentence)
            if ended.process.exitcode == LOST:
                lost = f"{step.name}: was ended because its parent process ended"
                raise InputError(f"{lost}; the same command continues from there")
            if (status := ended.process.exitcode or 0) < 0:
                raise InputError(f"{step.name}: was ended by signal {-status}; the same command continues from there")
            raise Crash(f"{step.name} ended with status {ended.process.exitcode}:\n{said}")
        self._remove([step])
        self.refused[step.name] = sentence
        folder.begin(ended.source, [step.refusal])
        write_whole({step.refusal: f"{sentence}\n"})
        note(folder.journal, {step.refusal: step.refusal})
        folder.end([step.refusal])
        return step, ended.stage

    def _source(self, step: Step) -> str:
        """The hash of all that decides on what a step writes."""
        read = {str(path): self._folder.content(path) for path in (*step.needs, *step.uses)}
        return sha256(json.dumps([step.command, code_of(step.command), read]).encode()).hexdigest()

    def _remove(self, steps: Sequence[Step]) -> None:
        self._folder.remove(path for step in steps for path in (*step.outputs, step.refusal))

    def _after(self, made: Sequence[Step]) -> list[Step]:
        """Steps and those that hang on what they make, in their order."""
        found, written = [], set[Path]()
        for step in self.steps:
            if step in made or written & {*step.needs, *step.uses}:
                found.append(step)
                written |= {*step.outputs, step.refusal}
        return found


def _is_last(step: Step, stage: int) -> bool:
    return stage == len(step.stages)


def _signature(path: Path) -> tuple[int, int, int] | None:
    """By which a file is known to be the same as a while ago."""
    try:
        found = path.stat()
    except OSError:
        return None
    return found.st_ino, found.st_size, found.st_mtime_ns
