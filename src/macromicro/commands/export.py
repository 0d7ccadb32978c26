"""``macromicro export``: kernels as C99 and as FMUs, the firmware of a board."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from macromicro.commands.group import Group, whole

app = typer.Typer(
    cls=Group,
    help="Write laws, guards, observers and plants as C99, for a microcontroller, or as FMUs; "
    "the firmware of a board.",
    no_args_is_help=True,
    rich_markup_mode=None,
)

What = Annotated[
    str,
    typer.Argument(
        metavar="WHAT",
        help="Such as axis.law; `macromicro export list`; or MODULE:LAW of your own.",
    ),
]
Config = Annotated[
    Path | None,
    typer.Option(metavar="FILE", help="Settings of a machine, whose values are written."),
]


@app.command("list")
def list_(config: Config = None) -> None:
    """Print what can be exported, for all machines or that of a settings file."""
    from macromicro.errors import InputError
    from macromicro.export import catalogue

    units = catalogue.every(config)
    width = max(map(len, units))
    for name in units:
        try:
            title = units[name]().title
        except InputError as error:
            title = f"not to be exported: {error}"
        print(f"{name:<{width}}  {title}")


@app.command()
def c(
    what: What,
    out: Annotated[
        Path | None, typer.Option(metavar="DIR", help="Folder.", show_default="results/c-<WHAT>")
    ] = None,
    config: Config = None,
    single: Annotated[
        bool, typer.Option("--float", help="float and 32-bit integers, not double and 64.")
    ] = False,
    overwrite: Annotated[
        bool, typer.Option("--overwrite", help="Replace an earlier export.")
    ] = False,
) -> None:
    """Write C99 from kernels: a struct a NamedTuple, a function a kernel (docs/export.md).

    No allocation, no library but libm. In double the functions give the bits of their kernels.
    """
    from macromicro.export import catalogue, files
    from macromicro.export.example import Example, readme
    from macromicro.runs import folder

    written = files.written(catalogue.unit(what, config), single)
    name = written.name
    texts = {
        f"{name}.h": written.header,
        f"{name}.c": written.code,
        "main.c": Example(written).text(),
        "README.md": readme(written),
    }
    place = out or Path("results") / f"c-{name}"
    names = tuple(texts)
    folder.check(place, 2_000_000, overwrite=overwrite, names=names)
    with folder.held(place, overwrite=overwrite, names=names):
        for file, text in texts.items():
            (place / file).write_text(text, encoding="utf-8")
    print(f"{written.unit.title}: {', '.join(made.name for made in written.entries)}")
    print(f"results: {place}")


@app.command()
def fmu(
    what: What,
    out: Annotated[
        Path | None, typer.Option(metavar="FILE", help="The FMU.", show_default="<WHAT>.fmu")
    ] = None,
    config: Config = None,
    fmi: Annotated[
        int, typer.Option(parser=whole, metavar="N", help="Version of FMI: 2 or 3.")
    ] = 2,
    overwrite: Annotated[
        bool, typer.Option("--overwrite", help="Replace an earlier file.")
    ] = False,
) -> None:
    """Write a co-simulation FMU from the exported C, for Simulink or FMPy (docs/export.md).

    It holds the sources and a binary for Linux x86_64, which cc makes here; no Python.
    """
    from macromicro.errors import InputError
    from macromicro.export import catalogue, files
    from macromicro.export import fmu as units

    if fmi not in units.VERSIONS:
        raise InputError("--fmi", fmi, "2 or 3")
    written = files.written(catalogue.unit(what, config))
    place = out or Path(f"{written.name}.fmu")
    if place.exists() and not overwrite:
        raise InputError("--out", str(place), "a file that is not there yet, or --overwrite")
    face = units.write(written, place, fmi)
    numbers = dict.fromkeys(("input", "output", "parameter"), 0)
    for each in face.variables:
        numbers[each.causality] = numbers.get(each.causality, 0) + 1
    print(
        f"{written.unit.title}: {numbers['input']} inputs, {numbers['output']} outputs, "
        f"{numbers['parameter']} tunable parameters, period {written.unit.period:g} s"
    )
    print(f"results: {place}")


@app.command("hex")
def hex_(
    out: Annotated[Path, typer.Option(metavar="FILE", help="The file to flash.")] = Path("uno.hex"),
    overwrite: Annotated[
        bool, typer.Option("--overwrite", help="Replace an earlier file.")
    ] = False,
) -> None:
    """Write the built firmware for an Arduino Uno or Nano (docs/firmware.md), no compiler needed.

    FILE.sha256 beside it has its SHA-256, as `sha256sum --check` reads it.
    """
    from macromicro.errors import InputError
    from macromicro.rig.board import prebuilt

    if out.exists() and not overwrite:
        raise InputError("--out", str(out), "a file that is not there yet, or --overwrite")
    try:
        digest = prebuilt.write(out)
    except OSError as error:
        raise InputError(
            "--out", str(out), f"a file that can be written: {error.strerror}"
        ) from None
    print(f"SHA-256: {digest}")
    print(f"results: {out}")
