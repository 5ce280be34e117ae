"""Which variables of a MAT file, or fields of its structures, make a test."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from itertools import islice
from pathlib import Path

from identification.base.errors import InputError
from identification.formats.columns import COMPLEX, INPUTS, KINDS, KNOWN, MOST_NAMES, choose_columns, quoted
from identification.formats.mat_variable import DAMAGED, DEEPEST, NUMERIC, PLAIN, Variable
from identification.formats.spellings import factor_of, spelt

LABELS = NUMERIC | {"char", "cell"}
MOST_STRUCTURES = 1000  # looked at; in an HDF5 file one may hold itself
RESPONSES = {"frf", "h", "g", "resp", "tf", "p"}  # what a complex variable is called
SIGNALS = {"u": INPUTS, "y": ("output",)}
IN_MATLAB = {
    **dict.fromkeys(
        ("frd", "idfrd", "genfrd"),
        "{0} = chgFreqUnit({0}, 'Hz'); frequency_hz = {0}.Frequency; response = squeeze({0}.ResponseData); "
        "save('mine.mat', 'frequency_hz', 'response')",
    ),
    "iddata": "time_s = {0}.SamplingInstants; input = {0}.InputData; output = {0}.OutputData; "
    "save('mine.mat', 'time_s', 'input', 'output')",
}

Scope = Mapping[str, Variable]
Chosen = dict[str, tuple[Variable, float]]


def choose_variables(path: Path, variables: Scope, meant: Mapping[str, str]) -> Chosen:
    """For each name of ours, frequency or time first, its variable and how many of our unit one of the file's is.

    They are those that ``meant`` translates, with others that have our names; or else variables, or fields of one
    structure, that have our names or say their quantity and its unit, such as ``f_hz``. A field f of a structure s is
    called ``s.f``.

    Raises
    ------
    InputError
        There are none, or those of several structures; the sentence says what to type.
    """
    scopes: dict[str, Scope] = {"": variables}
    if not _is_test(_found(variables)) or any("." in name for name in meant):
        scopes = dict(islice(_scopes(path, "", variables, 0), MOST_STRUCTURES))
    everything = {f"{prefix}{name}": each for prefix, scope in scopes.items() for name, each in scope.items()}
    translated = {name: ours for name, ours in meant.items() if name in everything}
    if translated:
        beside = {name: each for prefix in ("", *map(_prefix, translated)) for name, each in scopes[prefix].items()}
        renamed = {name.removeprefix(_prefix(name)) for name in translated}
        found = {name: (each, 1.0) for name, each in beside.items() if _is_usable(name, each) and name not in renamed}
        others = [name for name in found if name not in translated.values()]
        for name, ours in translated.items():
            if not _is_usable(ours, everything[name]):
                raise InputError(f"{path}: {name} is of class {everything[name].kind}; expected numbers")
            found[ours] = everything[name], factor_of(name.removeprefix(_prefix(name)), ours)
        return _only(path, [*others, *translated.values()], found)
    tests = {prefix: found for prefix, scope in scopes.items() if _is_test(found := _found(scope))}
    if len(tests) > 1 and "" not in tests:
        first = ",".join(f"{prefix}{name}={name}" for prefix, found in list(tests.items())[:1] for name in found)
        listed = ", ".join(quoted(prefix[:-1]) for prefix in list(tests)[:MOST_NAMES])
        raise InputError(
            f'{path}: {len(tests)} structures hold tests, {listed}; expected one, as by --columns "{first}"'
        )
    if not tests:
        raise _refusal(path, scopes, everything)
    prefix, found = next(iter(tests.items()))
    taken = [each for each, _ in found.values()]
    others = [_shown(name, each) for name, each in scopes[prefix].items() if each not in taken]
    return _only(path, [*found, *others], found)


def _scopes(path: Path, prefix: str, variables: Scope, depth: int) -> Iterator[tuple[str, Scope]]:
    """The variables, and the fields of each structure among them, and of those, by what stands before their names."""
    yield prefix, variables
    for name, each in variables.items() if depth < DEEPEST else ():
        try:
            fields = each.fields()
        except DAMAGED:
            raise InputError(f"{path}: {prefix}{name} is damaged; expected a whole structure") from None
        if fields:
            yield from _scopes(path, f"{prefix}{name}.", fields, depth + 1)


def _prefix(name: str) -> str:
    return name[: name.rfind(".") + 1]


def _found(scope: Scope) -> Chosen:
    """Those of our names, which come before those that say which of ours they are."""
    own = {name: (each, 1.0) for name, each in scope.items() if _is_usable(name, each)}
    complexes = [name for name, each in scope.items() if each.is_complex]
    said: dict[str, list[tuple[Variable, float]]] = {}
    for name, each in scope.items():
        spelling = spelt(name)
        if complexes == [name] and name.casefold() in RESPONSES:
            said.setdefault(COMPLEX, []).append((each, 1.0))
        elif spelling and spelling.ours and _is_usable(spelling.ours, each):
            said.setdefault(spelling.ours, []).append((each, spelling.factor))
    found = {ours: each[0] for ours, each in said.items() if len(each) == 1} | own
    kind = max((kind for kind in KINDS if kind <= set(found)), key=lambda kind: len(kind & set(own)), default=set())
    return {ours: each for ours, each in found.items() if ours in {*kind, "coherence", *own}}


def _is_test(found: Chosen) -> bool:
    return any(kind <= set(found) for kind in KINDS)


def _is_usable(ours: str, variable: Variable) -> bool:
    return ours in KNOWN and variable.kind in (LABELS if ours == "test" else NUMERIC)


def _only(path: Path, names: list[str], found: Chosen) -> Chosen:
    """Those of the variables found that make a test, and their labels."""
    chosen = choose_columns(str(path), names, "variables")
    return {name: found[name] for name in (*chosen, "test") if name in found}


def _shown(name: str, variable: Variable) -> str:
    return name if variable.kind in NUMERIC else f"{name} ({variable.kind})"


def _refusal(path: Path, scopes: Mapping[str, Scope], everything: Scope) -> InputError:
    """What to type where the numbers of a test may be there by other names, or what MATLAB has to do."""
    for prefix, scope in scopes.items():
        guesses = {name: ours for name, each in scope.items() if (ours := _may_be(name, each, scope))}
        if any(kind <= {ours[0] for ours in guesses.values()} for kind in KINDS):
            unsaid = {name: ours for name, ours in guesses.items() if name not in KNOWN}
            chosen = ",".join(f"{prefix}{name}={ours[0]}" for name, ours in unsaid.items())
            instead = "".join(f", or {name}" for ours in unsaid.values() for name in ours[1:])
            names = ", ".join(quoted(f"{prefix}{name}") for name in unsaid)
            verb = "does" if len(unsaid) == 1 else "do"
            return InputError(
                f'{path}: {names} {verb} not name a quantity with a unit; expected --columns "{chosen}"{instead}'
            )
    for name, each in everything.items():
        if each.kind not in PLAIN:
            how = f" (in MATLAB: {IN_MATLAB[each.kind].format(name)})" if each.kind in IN_MATLAB else ""
            return InputError(
                f"{path}: {name} is an object of class {each.kind}, which only MATLAB reads; "
                f"expected its numbers in variables of their own{how}"
            )
    choose_columns(str(path), [_shown(name, each) for name, each in everything.items()], "variables")
    return InputError(f"{path}: holds no test; expected the variables of one")


def _may_be(name: str, variable: Variable, scope: Scope) -> tuple[str, ...]:
    """The names of ours that a variable may stand for."""
    if variable.kind not in NUMERIC:
        return ()
    if variable.is_complex:
        return (COMPLEX,) if sum(each.is_complex for each in scope.values()) == 1 else ()
    if near := [ours for ours in KNOWN if ours.replace("_", "") == name.casefold().replace("_", "")]:
        return (near[0],)
    spelling = spelt(name)
    if spelling is None:
        return SIGNALS.get(name, ())
    return (spelling.ours,) if spelling.ours else spelling.may_be
