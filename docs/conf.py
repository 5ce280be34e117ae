"""The documentation site: `make docs`."""

from __future__ import annotations

import ast
import re
import sys
import warnings
from importlib.metadata import metadata
from itertools import pairwise
from pathlib import Path
from types import GenericAlias
from typing import TYPE_CHECKING, Any

import numba
from jinja2 import FileSystemLoader
from jinja2.sandbox import SandboxedEnvironment
from latex2mathml.converter import convert
from numpydoc import docscrape_sphinx

if TYPE_CHECKING:
    from click import Context
    from docutils import nodes
    from sphinx.application import Sphinx
    from sphinx.writers.html5 import HTML5Translator

warnings.filterwarnings("ignore", "Unknown section", module="numpydoc")  # in docstrings of others
# A compiled function would hide its docstring. Not by the environment, which the notebooks would take over.
numba.config.DISABLE_JIT = True
ROOT = Path(__file__).resolve().parents[1]
API = ROOT / "docs" / "reference" / "api"
COMMANDS = ROOT / "docs" / "reference" / "commands"
ROOMS = ("identification", "design", "experiments", "paper_figures", "antiwindup")
WIDE = 35
"""A table whose columns together take more characters is too wide for a narrow screen."""
LITERAL = re.compile(r"(``.+?``)")
sys.path.insert(0, str(ROOT))  # data.thesis

project = "Anti-windup for plants with dead time and integral action"
author = "The maintainers"
project_copyright = "the maintainers; code BSD 3-Clause"
release = metadata("antiwindup-thesis")["Version"]
extensions = [
    "myst_nb",
    "numpydoc",
    "sphinx.ext.autodoc",
    "sphinx.ext.viewcode",
    "sphinx_click",
    "sphinx_copybutton",
]
exclude_patterns = ["images"]

nitpicky = False
smartquotes_action = "qe"  # and no dashes, of which options are full
default_role = "literal"
root_doc = "index"

# pages
myst_enable_extensions = ["dollarmath", "amsmath", "deflist", "attrs_inline", "colon_fence"]
myst_heading_anchors = 4
nb_execution_mode = "force"  # the pages are of the code as it is, which no cache knows
nb_execution_in_temp = True
nb_execution_raise_on_error = True
nb_execution_timeout = 300
nb_merge_streams = True

# docstrings
add_module_names = False
autodoc_typehints = "none"
autodoc_use_type_comments = False
viewcode_follow_imported_members = False  # else the way back from the source of a room's face is lost
numpydoc_show_class_members = False
numpydoc_xref_param_type = False

# numpydoc would compile its template anew for each docstring, a third of the site's time
TEMPLATES = SandboxedEnvironment(loader=FileSystemLoader(Path(docscrape_sphinx.__file__).with_name("templates")))
docscrape_sphinx.SandboxedEnvironment = lambda loader: TEMPLATES

# the site
html_theme = "pydata_sphinx_theme"
html_title = "Anti-windup"
html_static_path = ["_static"]
html_css_files = ["site.css"]
html_show_sourcelink = False
html_theme_options = {
    "show_toc_level": 2,
    "navigation_with_keys": False,
    "footer_start": ["copyright"],
    "footer_end": [],
    # their tables take the place of the list of sections
    "secondary_sidebar_items": {"**": ["page-toc"], "thesis/claims": [], "thesis/equations": []},
}
linkcheck_timeout = 20


def mathml(translator: HTML5Translator, node: nodes.Element) -> None:
    """A formula as MathML, which browsers typeset by themselves: no script, no network."""
    from docutils.nodes import SkipNode

    display = "inline" if node.tagname == "math" else "block"
    translator.body.append(convert(node.astext(), display=display))
    raise SkipNode


def name_cells(app: Sphinx, document: nodes.document, page: str) -> None:
    """Mark the wide tables; name the column in each of their cells, which a narrow screen shows."""
    from docutils import nodes

    for table in document.findall(nodes.table):
        heads, rows = (next(table.findall(kind), []) for kind in (nodes.thead, nodes.tbody))
        if heads and sum(max(len(cell.astext()) for cell in column) for column in zip(*rows, strict=True)) > WIDE:
            table["classes"].append("wide")
            for row in rows:
                for head, cell in zip(heads[0], row, strict=False):
                    if cell.astext() and head.astext():
                        cell[0].insert(0, nodes.inline("", f"{head.astext()}: ", classes=["column"]))


def without_substitutions(*arguments: Any) -> None:
    """Take bars in docstrings and help texts for absolute values, and not for substitutions."""
    lines: list[str] = arguments[-1]
    for row, line in enumerate(lines):
        parts = LITERAL.split(line)
        lines[row] = "".join(part if k % 2 else part.replace("|", r"\|") for k, part in enumerate(parts))


def whole_metavars(app: Sphinx, context: Context, lines: list[str]) -> None:
    """Give an option's value its brackets back, of which sphinx-click takes the outer ones away."""
    for parameter in context.command.params:
        if parameter.metavar and "[" in parameter.metavar:
            cut = f"<{parameter.metavar.strip('[]')}>"
            lines[:] = [line.replace(cut, f"<{parameter.metavar}>") for line in lines]


def of_others(app: Sphinx, what: str, name: str, thing: object, skip: bool, options: object) -> bool | None:
    """Leave out names for types of others: numpydoc cannot write their signatures."""
    return True if isinstance(thing, GenericAlias) else None


def write_api_pages(app: Sphinx) -> None:
    """Write a page for each package of the rooms: what its modules hold, and the packages in it."""
    API.mkdir(exist_ok=True)
    for room in ROOMS:
        for init in sorted((ROOT / room).rglob("__init__.py")):
            package, folder = ".".join(init.parent.relative_to(ROOT).parts), init.parent
            inner = [f"   {package}.{each.parent.name}" for each in sorted(folder.glob("*/__init__.py"))]
            modules = [package, *(f"{package}.{each.stem}" for each in sorted(folder.glob("[!_]*.py")))]
            lines = [package, "=" * len(package), ""]
            lines += [".. toctree::", "", *inner, ""] if inner else []
            for module in modules:
                if module != package:
                    lines += [module.rpartition(".")[2], "-" * len(module), ""]
                lines += [f".. automodule:: {module}", f"   :members: {_documented(folder, module)}", ""]
            (API / f"{package}.rst").write_text("\n".join(lines), encoding="utf-8")


def _documented(folder: Path, module: str) -> str:
    """What a module itself documents: autodoc would load all that it imports, too; a package's face may show all."""
    if not (source := folder / f"{module.rpartition('.')[2]}.py").exists():
        return ""
    body = ast.parse(source.read_text(encoding="utf-8")).body
    names = [each.name for each in body if isinstance(each, ast.FunctionDef | ast.ClassDef)]
    for assigned, said in pairwise(body):
        if isinstance(said, ast.Expr) and isinstance(assigned, ast.Assign | ast.AnnAssign):
            targets = assigned.targets if isinstance(assigned, ast.Assign) else [assigned.target]
            names += [each.id for target in targets for each in ast.walk(target) if isinstance(each, ast.Name)]
    return ", ".join(name for name in names if not name.startswith("_"))


def write_command_pages(app: Sphinx) -> None:
    """Write a page for each command, and one for each group with the commands in it."""
    from click import Context, Group

    from antiwindup.__main__ import main

    def write(name: str, group: Group) -> None:
        context = Context(group, info_name=name)
        found = {each: group.get_command(context, each) for each in group.list_commands(context)}
        for each, command in found.items():
            if command is None or not (group is main or isinstance(command, Group)):
                continue
            inner = ""
            if isinstance(command, Group):
                write(f"{name} {each}", command)
                leaves = [leaf for leaf, what in command.commands.items() if not isinstance(what, Group)]
                inner = f"   :nested: full\n   :commands: {', '.join(leaves)}\n"
            place = f"{command.callback.__module__}:{command.callback.__name__}"
            text = f".. click:: {place}\n   :prog: {name} {each}\n{inner}"
            file = COMMANDS / f"{name} {each}.rst".removeprefix("antiwindup ").replace(" ", "_")
            file.write_text(text, encoding="utf-8")

    COMMANDS.mkdir(exist_ok=True)
    write("antiwindup", main)


def link_to_source(app: Sphinx, doctree: nodes.document, docname: str) -> None:
    """Let a link to a module of a room lead to its page of source, and not to a file to download."""
    from docutils.nodes import reference
    from sphinx.addnodes import download_reference

    for node in list(doctree.findall(download_reference)):
        file = (Path(app.srcdir, docname).parent / node["reftarget"]).resolve()
        place = (
            file.relative_to(ROOT).with_suffix("").as_posix().removesuffix("/__init__") if ROOT in file.parents else ""
        )
        if file.suffix == ".py" and place.partition("/")[0] in ROOMS and app.builder.format == "html":
            uri = app.builder.get_relative_uri(docname, f"_modules/{place}")
            node.replace_self(reference("", "", *node.children, refuri=uri, internal=True))


def setup(app: Sphinx) -> None:
    """Register what this file adds to Sphinx."""
    app.connect("builder-inited", write_api_pages)
    app.connect("builder-inited", write_command_pages)
    app.connect("autodoc-process-docstring", without_substitutions)
    for part in ("description", "usage", "options", "arguments", "epilog"):
        app.connect(f"sphinx-click-process-{part}", without_substitutions)
    app.connect("sphinx-click-process-options", whole_metavars)
    app.connect("autodoc-skip-member", of_others)
    app.connect("doctree-resolved", link_to_source)
    app.connect("doctree-resolved", name_cells)
    app.add_html_math_renderer("mathml", (mathml, None), (mathml, None))


html_math_renderer = "mathml"
