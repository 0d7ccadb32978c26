"""The reference's pages: which modules they show, and their text for Sphinx."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from functools import cache
from importlib import import_module
from pathlib import Path
from typing import NamedTuple

_FRONT = "macromicro."


class Page(NamedTuple):
    """A page of the reference: name, title, first words, modules, and whether users call them."""

    name: str
    title: str
    words: str
    modules: tuple[str, ...]
    called: bool = True


PAGES = (
    Page("macromicro", "macromicro", "The package's front door.", ("macromicro",)),
    Page(
        "remote",
        "Clients of a served machine",
        "What `macromicro.connect` returns, and devices for Bluesky.",
        ("remote.machine", "remote.asynchronous", "remote.failures", "ophyd", "ophyd_async"),
    ),
    Page(
        "identify",
        "Identification",
        "From recordings alone.",
        ("identify", "identify.result", "identify.runs"),
    ),
    Page(
        "hysteresis",
        "Hysteresis",
        "Preisach model and play operators.",
        (
            "hysteresis",
            "hysteresis.forc",
            "hysteresis.table_files",
            "hysteresis.diagnostics",
            "hysteresis.prandtl",
            "hysteresis.prandtl_fit",
            "hysteresis.everett",
            "hysteresis.memory",
        ),
    ),
    Page("motion", "Motion profiles", "Of any axis.", ("motion",)),
    Page(
        "design",
        "Design and metrics",
        "Sheets for parts; measures of a response.",
        ("design", "design.response", "design.vibration", "design.extension", "design.margins"),
    ),
    Page(
        "studies",
        "Batches",
        "Many variants of one run.",
        ("batch",),
    ),
    Page(
        "macro",
        "Physics of the macro-stage",
        "The functions that the physics chapter names.",
        tuple(
            f"plant.{name}"
            for name in (
                "amplifier", "motor", "friction", "value_noise", "belt", "carriage", "encoder",
            )
        ),
        called=False,
    ),
    Page(
        "micro",
        "Physics of the micro-stage",
        "The functions that the physics chapter names.",
        tuple(
            f"plant.{name}"
            for name in ("driver", "thermal", "phase", "wire", "flexure", "micro", "hall", "laser")
        ),
        called=False,
    ),
    Page(
        "others",
        "Physics of other machines",
        "Axes and piezo stages.",
        tuple(
            f"plant.{name}"
            for name in (
                "power", "transmission", "axis", "switches", "high_voltage", "creep", "piezo",
                "gauge",
            )
        ),
        called=False,
    ),
    Page(
        "laws",
        "Control laws",
        "The thesis' laws and their parts.",
        tuple(
            f"control.{name}"
            for name in ("pid", "pd", "pi", "deadzone", "calibration", "cascade", "notch",
                         "integral")
        ),
        called=False,
    ),
    Page(
        "contracts",
        "Contracts of your own parts",
        "What a law, a stage, a rig, a machine or a procedure of your own fills in.",
        ("control.law", "control.stage_law", "control.contract", "machines.stage",
         "machines.machine", "machines.signals", "machines.contract",
         "commission.procedure", "commission.stand", "types", "rig.session",
         "rig.opening", "lab.drive", "thesis.procedure", "programme", "recording", "columns",
         "kernel"),
    ),
    Page(
        "parameters",
        "Parameters and units",
        "What a settings file is checked by.",
        ("schema.par", "units", "errors"),
    ),
)  # fmt: skip


def module(name: str) -> str:
    """The module of a source file: "macromicro.plant.belt" for src/macromicro/plant/belt.py."""
    return name.removeprefix("src/").removesuffix(".py").replace("/", ".").removesuffix(".__init__")


def full(name: str) -> str:
    """A module's whole name, from its name within the package."""
    return name if name == "macromicro" else _FRONT + name


def shown() -> set[str]:
    """All modules of the reference, by their whole names."""
    return {full(name) for page in PAGES for name in page.modules}


class Named(NamedTuple):
    """A function or class of the reference: its name there, Sphinx' word for it, its home."""

    name: str
    kind: str
    home: str


def public(module: str) -> list[Named]:
    """Public functions and classes of a module: its front door's, or those that it defines.

    Of a front door, which is in the order of the alphabet, functions come first.
    """
    named = list(_public(module))
    if hasattr(import_module(module), "_HOMES"):
        named.sort(key=lambda each: ("function", "class", "exception").index(each.kind))
    return named


def _public(module: str) -> Iterator[Named]:
    found = import_module(module)
    listed = getattr(found, "_HOMES", None) or getattr(found, "__all__", None)
    if listed is None:
        tree = ast.parse(Path(str(found.__file__)).read_text(encoding="utf-8"))
        kinds = (ast.FunctionDef, ast.AsyncFunctionDef, ast.ClassDef)
        listed = [n.name for n in tree.body if isinstance(n, kinds) and not n.name.startswith("_")]
    for each in listed:
        thing = getattr(found, each)
        if isinstance(thing, type):
            kind = "exception" if issubclass(thing, BaseException) else "class"
        elif callable(thing):
            kind = "function"
        else:
            continue
        home = f"{thing.__module__}.{thing.__qualname__}"
        yield Named(f"{module}.{each}", kind, home)


@cache
def documented() -> dict[str, Named]:
    """All functions and classes of the reference by their homes: each once, where it is first."""
    found: dict[str, Named] = {}
    for page in PAGES:
        for name in map(full, page.modules):
            for each in public(name):
                found.setdefault(each.home, each)
    return found


def _client(named: Named) -> bool:
    return named.kind == "class" and named.home.startswith("macromicro.remote.")


def text(page: Page) -> str:
    """A page in reStructuredText."""
    lines = [page.title, "=" * len(page.title), "", page.words, ""]
    named = documented()
    for name in map(full, page.modules):
        if len(page.modules) > 1:
            lines += [name, "-" * len(name), ""]
        lines += [f".. automodule:: {name}", "   :no-members:", ""]
        for each in public(name):
            if named[each.home] == each:
                lines += [f".. auto{each.kind}:: {each.name}"]
                lines += ["   :members:"] if each.kind != "function" else []
                # A client's requests are methods of its base.
                lines += ["   :inherited-members:"] if _client(each) else []
                lines += [""]
    return "\n".join(lines)


def write(folder: Path) -> None:
    """Write all pages."""
    folder.mkdir(parents=True)
    for page in PAGES:
        (folder / f"{page.name}.rst").write_text(text(page), encoding="utf-8")
