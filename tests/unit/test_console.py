"""What a command shows and where: progress on terminals only, one sentence, and no traceback where nothing is heard."""

from __future__ import annotations

import os
import pty
import re
import subprocess
import sys
import termios
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import click
import pytest
from click.testing import CliRunner

from design.design_file import Design
from experiments.__main__ import main as experiments
from identification.base.command_line import CommandGroup
from identification.base.errors import InputError

ROOT = Path(__file__).resolve().parents[2]
SWEEP = "data/elevation/synthetic_test_1_frf.csv"


@pytest.fixture
def design_json(extended_design: Design, tmp_path: Path) -> Path:
    path = tmp_path / "design.json"
    path.write_text(extended_design.to_json(), encoding="utf-8")
    return path


def on_terminal(words: Sequence[str], **environment: str) -> str:
    """What a program that ends well writes to a terminal, which is its standard input, output and error."""
    mine, its = pty.openpty()
    termios.tcsetwinsize(its, (24, 80))
    process = subprocess.Popen(
        [sys.executable, *words], cwd=ROOT, env=os.environ | environment, stdin=its, stdout=its, stderr=its
    )
    os.close(its)
    shown = b""
    try:
        while part := os.read(mine, 65536):
            shown += part
    except OSError:  # Linux's way to say that the other side is closed
        pass
    os.close(mine)
    assert process.wait() == 0, shown
    return shown.decode()


def to_pipes(words: Sequence[str], **environment: str) -> subprocess.CompletedProcess[str]:
    own = os.environ | environment
    return subprocess.run([sys.executable, *words], cwd=ROOT, env=own, capture_output=True, text=True, check=True)


RUN = ["--limit", "9", "--anti-windup", "thesis", "--amplitude", "50"]
PROGRESS = {
    "simulate: ": [
        *["experiments", "simulate", "{design}", *RUN, "--until", "300", "--sample-time", "1"],
        *["--output", "{folder}/run.csv"],
    ],
    "sampled: ": [
        *["experiments", "sampled", "{design}", *RUN, "--until", "5", "--rate", "10000", "--method", "tustin"],
        *["--output", "{folder}/run.csv"],
    ],
}


@pytest.mark.parametrize("bar", PROGRESS)
def test_progress_is_shown_on_a_terminal_and_nowhere_else(bar: str, design_json: Path, tmp_path: Path) -> None:
    words = [word.format(design=design_json, folder=tmp_path) for word in PROGRESS[bar]]
    shown, quiet = on_terminal(["-m", *words]), CliRunner().invoke(experiments, words[1:])
    goes_when_the_command_is_done(bar, shown, quiet.stdout)
    assert quiet.stderr == ""


def goes_when_the_command_is_done(bar: str, shown: str, printed: str) -> None:
    assert bar in shown
    assert bar not in shown.rpartition("\r")[2]
    assert shown.endswith(printed.replace("\n", "\r\n"))


def test_a_fit_shows_its_progress_and_hangs_on_no_number_of_threads(tmp_path: Path) -> None:
    words, threads = ["-m", "identification", "fit", SWEEP, "--output"], ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS")
    one, two = tmp_path / "one", tmp_path / "two"
    one.mkdir()
    two.mkdir()
    shown = on_terminal([*words, str(one / "model.json")], **dict.fromkeys(threads, "1"))
    piped = to_pipes([*words, str(two / "model.json")], **dict.fromkeys(threads, "2"))
    goes_when_the_command_is_done("fits: ", shown.replace(str(one), str(two)), piped.stdout)
    assert piped.stderr == ""
    assert (one / "model.json").read_bytes() == (two / "model.json").read_bytes()


SLOW = (
    "import click, sys, time; from tqdm import tqdm; from identification.base.command_line import CommandGroup\n"
    "@click.group(cls=CommandGroup)\n"
    "def main(): pass\n"
    "@main.command()\n"
    "@click.option('--bar', is_flag=True)\n"
    "def slow(bar):\n"
    "    click.echo('begins\\x07')\n"
    "    with tqdm(desc='counted', disable=None if bar else True, leave=False): time.sleep(2.2)\n"
    "    click.echo('ends')\n"
    "main(['slow', *sys.argv[1:]])\n"
)


def test_a_command_without_a_bar_of_its_own_shows_the_time_it_takes() -> None:
    """Every command, since all are of one class."""
    with ThreadPoolExecutor() as pool:
        shown, barred, piped = (
            pool.submit(run, ["-c", SLOW, *words])
            for run, words in ((on_terminal, []), (on_terminal, ["--bar"]), (to_pipes, []))
        )
    assert "at work: 00:02" in shown.result()
    assert re.search(r"\r +\rbegins\\x07\r\nends\r\n$", shown.result())
    assert "at work" not in barred.result()
    assert piped.result().stderr == ""


def test_compilation_is_said_on_a_terminal(tmp_path: Path) -> None:
    code = "import numpy as np; from experiments.engine import crossings as c; c._sign_changes(np.ones(2))"
    shown = on_terminal(["-c", code], XDG_CACHE_HOME=str(tmp_path))
    assert shown == "Compiling, once for this machine: some 20 s.\r\n"
    assert on_terminal(["-c", code], XDG_CACHE_HOME=str(tmp_path)) == ""


ROOMS = ("identification", "design", "experiments", "paper_figures", "antiwindup")


@pytest.mark.parametrize("room", ROOMS)
def test_nobody_hears_a_command(room: str) -> None:
    """A full device gets a sentence, a reader that left gets none; a refusal keeps its status."""
    helped, refused = f"$0 -m {room} --help", f"$0 -m {room} nothing"
    full = (1, "Error: standard output cannot be written to (No space left on device)\n")
    expected = {f"{helped} > /dev/full": full, f"{refused} 2> /dev/full": (2, "")}
    if room == "antiwindup":  # and of the others, whose groups are of one class
        expected |= {
            f"{helped} > /dev/full 2> /dev/full": (1, ""),
            f"{helped} >&-": (0, ""),
            f"{helped} >&- 2>&- <&-": (0, ""),
            f"{refused} 2>&-": (2, ""),
            f"({helped}; echo $? >&2) | true": (0, "141\n"),
        }
    for command, end in expected.items():
        words = ["/bin/bash", "-o", "pipefail", "-c", command, sys.executable]
        done = subprocess.run(words, cwd=ROOT, capture_output=True, text=True, check=False)
        assert (done.returncode, done.stderr) == end, command


NOISE = (
    "import click, warnings; from identification.base.process import begin; begin()\n"
    "from identification.base.command_line import CommandGroup; import numpy as np\n"
    "@click.group(cls=CommandGroup)\n"
    "def main(): pass\n"
    "@main.command()\n"
    "def noise():\n"
    "    warnings.warn('a warning'); np.sqrt(-np.ones(1))\n"
    "    np.linalg.lstsq(np.full((3, 2), np.nan), np.ones(3), rcond=None)\n"
    "main(['noise'])\n"
)


def test_libraries_write_nothing_beside_a_refusal() -> None:
    """LAPACK writes to standard output past Python."""
    done = subprocess.run([sys.executable, "-c", NOISE], cwd=ROOT, capture_output=True, text=True, check=False)
    assert (done.returncode, done.stdout) == (2, "")
    assert re.fullmatch(r"Error: the given numbers are too large or too small to compute with \(.*\)\n", done.stderr)


@click.group(cls=CommandGroup)
def group() -> None:
    pass


@group.command()
@click.option("--number", type=float)
@click.argument("kind")
def ends(kind: str, number: float | None) -> None:
    """Raise what is asked for."""
    errors = {
        "escape": InputError("a.csv, line 2: \x1b[31mred\x07 is no number\x9b2J"),
        "long": InputError(f"a.csv's test is '{'x' * 1000}'; expected what the loop's test, named elsewhere, is"),
        "memory": MemoryError("Unable to allocate 7.45 GiB for an array"),
        "bare": MemoryError(),
    }
    raise errors[kind]


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["escape"], r"Error: a.csv, line 2: \x1b[31mred\x07 is no number\x9b2J"),
        (["long"], f"Error: a.csv's test is '{'x' * 80}...'; expected what the loop's test, named elsewhere, is"),
        (
            ["memory"],
            "Error: out of memory (unable to allocate 7.45 GiB for an array); expected less input, or a machine with "
            "more memory",
        ),
        (["bare"], "Error: out of memory; expected less input, or a machine with more memory"),
        (["escape", "--number", "\x1b[2J"], r"Error: Invalid value for '--number': '\x1b[2J' is not a valid float."),
        (["escape", "--\x1b[2J"], r"Error: No such option '--\x1b[2J'."),
    ],
)
def test_sentences_are_fit_for_a_terminal(words: list[str], said: str) -> None:
    result = CliRunner().invoke(group, ["ends", *words])
    assert (result.exit_code, result.stderr.splitlines()[-1]) == (2, said)


def test_caches_go_where_they_can_be_written(tmp_path: Path) -> None:
    """As in a container; a file in the folder's place bars root too."""
    (barred := tmp_path / "home").touch()
    (temporary := tmp_path / "tmp").mkdir()
    environment = {
        name: value for name, value in os.environ.items() if name not in ("XDG_CACHE_HOME", "XDG_CONFIG_HOME")
    } | {"HOME": str(barred), "TMPDIR": str(temporary)}
    words = [sys.executable, "-m", "paper_figures", "draw", "fig_2_06", "--results", ".", "--output", str(tmp_path)]
    said = [
        subprocess.run(words, cwd=ROOT, env=environment, capture_output=True, text=True, check=True).stderr
        for _ in range(2)
    ]
    kept = temporary / f"antiwindup-{os.getuid()}"
    assert said == [f"{barred}/.cache, {barred}/.config cannot be written to; caches are kept in {kept}\n", ""]
    assert list((kept / "matplotlib").glob("fontlist-*"))
