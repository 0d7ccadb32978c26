"""``macromicro export``: kernels as C99 and FMU, and the firmware of a board."""

from __future__ import annotations

from pathlib import Path

import typer

from macromicro.commands.group import Group
from macromicro.commands.options import command

app = typer.Typer(
    name="export",
    cls=Group,
    help=(
        "Write control code as C99 or FMU, or a board's firmware. Laws,"
        " guards, observers and plants become C99 for a "
        "microcontroller, or FMUs."
    ),
    no_args_is_help=True,
    rich_markup_mode=None,
)


@command(app, "list")
def list_(config: Path | None = None) -> None:
    """Print what can be exported.

    With --config the list is that of the file's machine, else of all machines.
    """
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


@command(app)
def c(
    what: str,
    out: Path | None = None,
    config: Path | None = None,
    single: bool = False,
    systems: str | None = None,
    overwrite: bool = False,
) -> None:
    """Write C99 from kernels (docs/export.md).

    Each NamedTuple becomes a struct, each kernel a function. The code allocates no memory and needs
    no library but libm. In double precision it returns the same bits as the kernels. With --for a
    shared library for each system is written, too.
    """
    from macromicro.export import building, catalogue, files
    from macromicro.runs import folder

    wanted = building.systems(systems)
    written = files.write_unit(catalogue.unit(what, config), single)
    name = written.name
    texts = {f"{name}.h": written.header, f"{name}.c": written.code}
    content = {file: text.encode() for file, text in texts.items()}
    content["README.md"] = written.readme().encode()
    if wanted:
        content |= building.libraries(name, texts, wanted)
    place = folder.choose_folder(out, Path("results") / f"c-{name}", overwrite=overwrite)
    names = tuple(content)
    folder.check(place, 2_000_000, overwrite=overwrite, names=names)
    with folder.locked(place, overwrite=overwrite, names=names):
        for file, data in content.items():
            (place / file).parent.mkdir(exist_ok=True)
            (place / file).write_bytes(data)
    print(f"{written.unit.title}: {', '.join(made.name for made in written.entries)}")
    print(f"results: {place}")


@command(app)
def fmu(
    what: str,
    out: Path | None = None,
    config: Path | None = None,
    systems: str | None = None,
    overwrite: bool = False,
) -> None:
    """Write a co-simulation FMU (FMI 2.0) for Simulink or FMPy.

    It is made from the exported C (docs/export.md) and contains the sources and a library for this
    system, or for each system of --for. It needs no Python.
    """
    from macromicro.export import building, catalogue, files
    from macromicro.export import fmu as units

    written = files.write_unit(catalogue.unit(what, config))
    place = out or Path(f"{written.name}.fmu")
    _check_new(place, overwrite)
    wanted = building.systems(systems)
    face = units.write(written, place, wanted)
    numbers = dict.fromkeys(("input", "output", "parameter"), 0)
    for each in face.variables:
        numbers[each.causality] = numbers.get(each.causality, 0) + 1
    print(
        f"{written.unit.title}: {numbers['input']} inputs, {numbers['output']} outputs, "
        f"{numbers['parameter']} tunable parameters, period {written.unit.period:g} s"
    )
    for name in set(wanted) & set(building.UNNAMED):
        library = f"binaries/{building.SYSTEMS[name].folder}"
        print(f"{name}: FMI 2.0 has no folder for it; the library is in {library}, as in FMI 3.0")
    print(f"results: {place}")


@command(app, "hex")
def hex_(out: Path = Path("uno.hex"), overwrite: bool = False) -> None:
    """Write the built firmware for an Arduino Uno or Nano.

    No compiler is needed (docs/board.md).
    FILE.sha256 beside it holds its SHA-256 for `sha256sum --check`.
    """
    from macromicro.errors import ProblemError
    from macromicro.rig.board import prebuilt

    _check_new(out, overwrite)
    try:
        digest = prebuilt.write(out)
    except OSError as error:
        raise ProblemError("--out", f"cannot write {out}: {error.strerror}") from None
    print(f"SHA-256: {digest}")
    print(f"results: {out}")


def _check_new(place: Path, overwrite: bool) -> None:
    from macromicro.errors import ProblemError

    if place.exists() and not overwrite:
        remedy = "Choose another file or add --overwrite."
        raise ProblemError("--out", f"{place} already exists", remedy)
