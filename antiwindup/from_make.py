"""What make hands to a build: values of its variables, by the environment, which neither make nor a shell has read.

``python -m antiwindup.from_make refit`` is ``antiwindup refit`` with ANTIWINDUP_SWEEPS, ANTIWINDUP_OUTPUT and so on.
"""

from __future__ import annotations

if __name__ == "__main__":
    from identification.base.process import begin

    begin()

import os
import shlex
import sys
from collections.abc import Mapping

import click

from antiwindup.__main__ import main
from identification.__main__ import fit_options, reading_options
from identification.base.command_line import Refusal
from identification.base.errors import InputError, shown

PREFIX = "ANTIWINDUP_"


def arguments(build: str, variables: Mapping[str, str]) -> list[str]:
    """The command line of a build.

    Parameters
    ----------
    build
        refit, figures or report.
    variables
        SWEEPS, names as :func:`words` reads them; FIT, options; ONLY, figures; FORCE, yes or nothing; and OUTPUT,
        MODEL, AXIS, LIMIT, PLANTS, JOBS, values as they are. What is missing or empty is not given, but for OUTPUT.

    Raises
    ------
    InputError
        A quote in FIT or SWEEPS has no end, FIT holds what is no option of the fit, or FORCE another word.
    """
    given = {name: value for name, value in variables.items() if value}
    options = [f"--output={variables['OUTPUT']}"]
    options += [
        f"--{name.lower()}={given[name]}" for name in ("MODEL", "AXIS", "LIMIT", "PLANTS", "JOBS") if name in given
    ]
    options += [f"--only={name}" for name in given.get("ONLY", "").split()]
    if given.get("FORCE", "yes") != "yes":
        raise InputError(f"FORCE is {shown(given['FORCE'])}; expected yes or nothing")
    options += ["--force"] if "FORCE" in given else []
    fit = _split("FIT", given.get("FIT", ""))
    try:
        only_fit.make_context("FIT", list(fit), resilient_parsing=False)
    except click.ClickException as error:
        raise InputError(f"FIT is {shown(given['FIT'])}: {error.format_message()}") from None
    return [build, *options, *fit, "--", *words(given.get("SWEEPS", ""))]


@click.command(add_help_option=False)
@reading_options
@fit_options
def only_fit(**_options: object) -> None:
    """What FIT may hold."""


def words(value: str) -> list[str]:
    """The names of files in a value: it is one name, if there is such a file; or several with blanks between.

    Names with blanks among several stand in quotes, as in a shell, if not all words are files as they stand.

    Raises
    ------
    InputError
        A quote has no end.
    """
    plain = value.split()
    if os.path.lexists(value):
        return [value]
    return plain if all(map(os.path.lexists, plain)) else _split("SWEEPS", value)


def _split(name: str, value: str) -> list[str]:
    try:
        return shlex.split(value)
    except ValueError as error:
        raise InputError(f"{name} is {value!r}: {error}; expected words, quoted where they hold blanks") from None


if __name__ == "__main__":
    handed = {name.removeprefix(PREFIX): value for name, value in os.environ.items() if name.startswith(PREFIX)}
    try:
        found = arguments(sys.argv[1], handed)
    except InputError as error:
        Refusal(str(error)).show()
        sys.exit(Refusal.exit_code)
    main(found, prog_name="antiwindup")
