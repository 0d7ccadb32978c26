"""The package's front door: light to open, and it leads where it says."""

import ast
import json
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

import macromicro

HEAVY = ("h5py", "matplotlib", "numba", "pandas", "pint", "pyarrow", "pydantic", "scipy", "xarray")

IMPORT = "import macromicro"
HELP = """
from macromicro.cli import main
sys.argv = ["macromicro", "--help"]
try:
    main()
except SystemExit as end:
    assert not end.code, end.code
"""


@pytest.mark.parametrize("action", [IMPORT, HELP], ids=["import", "help"])
def test_loads_nothing_heavy(action: str) -> None:
    """Who only asks for help, or for one name, does not pay for the compiler and the plots."""
    script = f"import json, sys\n{action}\nprint(json.dumps(sorted(sys.modules)), file=sys.stderr)"
    done = subprocess.run(
        [sys.executable, "-c", script], capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
    loaded = set(json.loads(done.stderr.splitlines()[-1]))
    assert "macromicro" in loaded
    assert loaded.isdisjoint(HEAVY), sorted(loaded.intersection(HEAVY))


def test_profiles_need_the_front_door_alone() -> None:
    script = "import macromicro; print(macromicro.motion.trapezoid(1.0, 1.0, 1.0).duration)"
    done = subprocess.run(
        [sys.executable, "-c", script], capture_output=True, text=True, check=False
    )
    assert done.stdout == "2.0\n", done.stderr


def test_runs_as_a_module() -> None:
    done = subprocess.run(
        [sys.executable, "-m", "macromicro", "--help"], capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
    assert "run" in done.stdout


@pytest.mark.parametrize("name", sorted(macromicro._HOMES))
def test_every_public_name_leads_to_its_definition(name: str) -> None:
    found = getattr(macromicro, name)
    if macromicro._HOMES[name]:
        assert found.__name__ == name
        assert found.__module__.startswith("macromicro.")
    else:
        assert found.__name__ == f"macromicro.{name}"
    assert name in dir(macromicro)


def test_unknown_name_is_an_attribute_error() -> None:
    with pytest.raises(AttributeError, match="no attribute 'Recorded'"):
        _ = macromicro.Recorded


PACKAGE = Path(str(macromicro.__file__)).parent


def imported(file: Path) -> Iterator[str]:
    """Dotted names that a module imports from this package, without the package's name."""
    for node in ast.walk(ast.parse(file.read_text(encoding="utf-8"))):
        if isinstance(node, ast.ImportFrom) and (node.module or "").startswith("macromicro."):
            module = str(node.module).removeprefix("macromicro.")
            yield from (f"{module}.{each.name}" for each in node.names)


def test_a_private_module_is_imported_within_its_package_alone() -> None:
    taken = []
    for file in sorted(PACKAGE.rglob("*.py")):
        room = file.relative_to(PACKAGE).parts[0]
        for name in imported(file):
            first, *modules = name.split(".")
            private = any(part.startswith("_") for part in modules[:-1])
            whole = PACKAGE.joinpath(first, *modules).with_suffix(".py")
            if (private or (modules[-1].startswith("_") and whole.exists())) and first != room:
                taken.append(f"{file.relative_to(PACKAGE)}: {name}")
    assert taken == []
