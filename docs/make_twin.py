"""Writes the page in which the two-stage machine runs as WebAssembly.

python docs/make_twin.py [FILE]

FILE is build/twin.html by default. `ziglang` compiles it (pip install 'macromicro[cross]').
"""

from __future__ import annotations

import base64
import json
import string
import subprocess
import sys
from pathlib import Path
from tempfile import TemporaryDirectory

import twin

from macromicro import __version__
from macromicro.export import files, fmu
from macromicro.extras import require
from macromicro.settings import Settings

OUT = Path("build/twin.html")
TEMPLATE = Path(__file__).with_name("twin.template.html")
TOKEN = "{twin}"
FLAGS = (
    *("-target", "wasm32-wasi", "-mexec-model=reactor", "-std=c99", "-O2", "-ffp-contract=off"),
    *("-s", "-Wl,--export-dynamic,--export=malloc"),
)


def page() -> str:
    """The page, with its code."""
    require("the twin's page", "ziglang", "cross")
    written = files.write_unit(twin.unit())
    face = fmu.Interface(written)
    texts = {
        "fmi2.c": fmu.interface_code(face, TOKEN),
        "twin.h": written.header,
        "twin.c": written.code,
    }
    numbers = {each.name: k for k, each in enumerate(face.variables, 1)}
    return string.Template(TEMPLATE.read_text(encoding="utf-8")).substitute(
        version=__version__,
        variables=json.dumps(numbers, separators=(",", ":")),
        code=base64.b64encode(assembled(texts)).decode(),
        period=repr(written.unit.period),
        token=TOKEN,
        pitch=repr(Settings().sensors.encoder.pitch),
    )


def assembled(texts: dict[str, str]) -> bytes:
    """The C files as one WebAssembly module."""
    with TemporaryDirectory() as folder:
        for name, text in texts.items():
            Path(folder, name).write_text(text, encoding="utf-8")
        command = [sys.executable, "-m", "ziglang", "cc", *FLAGS, "fmi2.c", "twin.c", "-lm"]
        subprocess.run([*command, "-o", "twin.wasm"], cwd=folder, check=True)
        return Path(folder, "twin.wasm").read_bytes()


def main() -> None:
    out = Path(sys.argv[1]) if len(sys.argv) > 1 else OUT
    text = page()
    out.parent.mkdir(parents=True, exist_ok=True)
    out.write_text(text, encoding="utf-8")
    print(out)


if __name__ == "__main__":
    main()
