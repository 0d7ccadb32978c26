"""Write the firmware's generated C: python -m boardcode --out FOLDER."""

from __future__ import annotations

import argparse
from pathlib import Path

from boardcode import headers
from macromicro.export import catalogue, files


def main() -> None:
    """Write all of it."""
    parser = argparse.ArgumentParser(prog="boardcode", description=__doc__)
    parser.add_argument("--out", type=Path, required=True)
    out: Path = parser.parse_args().out
    out.mkdir(parents=True, exist_ok=True)
    unit = catalogue.unit("two_stage.board")
    written = files.write_unit(unit, single=True)
    params = unit.given["params"]
    texts = {
        f"{written.name}.h": written.header,
        f"{written.name}.c": written.code,
        "protocol.h": headers.protocol_h(params),
        "pins.h": headers.pins_h(),
        "parameters.h": headers.parameters_h(params),
    }
    for name, text in texts.items():
        file = out / name
        if not file.exists() or file.read_text("utf-8") != text:  # make: what is the same is old
            file.write_text(text, "utf-8")


if __name__ == "__main__":
    main()
