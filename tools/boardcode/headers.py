"""C headers of what protocol.toml, pins.toml and the board's parameters say."""

from __future__ import annotations

from collections.abc import Iterator

from macromicro.rig.board import control, protocol
from macromicro.rig.board.control import Board
from macromicro.rig.board.protocol import BOARD, HOST, SPEC, Message

_C = {
    "u8": "uint8_t",
    "u16": "uint16_t",
    "u32": "uint32_t",
    "i16": "int16_t",
    "i32": "int32_t",
    "f32": "float",
}
_BYTES = {"u8": 1, "u16": 2, "i16": 2, "u32": 4, "i32": 4, "f32": 4}
_SCALARS = ("version", "firmware", "baud", "period", "silence", "decelerate", "full", "table")
_BITS = ("lines", "state", "active", "resets")
_NUMBERS = ("refusals", "faults", "boards")


def _wrapped(name: str, lines: Iterator[str]) -> str:
    guard = f"{name.upper()}_H"
    head = f"/* Made by tools/boardcode: change {name}.toml or the Python that it comes from. */\n"
    return head + "\n".join([f"#ifndef {guard}", f"#define {guard}", "", *lines, "", "#endif", ""])


def protocol_h(params: Board) -> str:
    """Frames, numbers and how frames are read and written.

    Parameters
    ----------
    params : Board
        Whose names the layout covers.

    Returns
    -------
    str
        protocol.h.
    """

    def lines() -> Iterator[str]:
        yield "#include <stdint.h>\n#include <string.h>\n"
        for name in _SCALARS:
            yield f"#define PROTOCOL_{name.upper()} {SPEC[name]}UL"
        yield f"#define LONGEST_HOST {max(message.packer.size for message in HOST.values())}U"
        yield f"#define PROTOCOL_LAYOUT {control.layout(params)}U"
        for kind in _BITS:
            for name, bit in SPEC[kind].items():
                yield f"#define {kind.upper()}_{name.upper()} {1 << bit}U"
        for kind in _NUMBERS:
            for name, number in SPEC[kind].items():
                yield f"#define {kind.upper()}_{name.upper()} {number}U"
        for message in HOST.values():
            yield from _message(message, read=True)
        yield "\n/* Bytes of the fields of a frame of the host; 255: there is none of this id. */"
        yield "static inline uint8_t protocol_size(uint8_t id)\n{\n    switch (id) {"
        for message in HOST.values():
            yield f"    case FRAME_{message.name.upper()}: return SIZE_{message.name.upper()};"
        yield "    default: return 255;\n    }\n}"
        for message in BOARD.values():
            yield from _message(message, read=False)

    return _wrapped("protocol", lines())


def _message(message: Message, *, read: bool) -> Iterator[str]:
    """A message: its id, its size, its struct, and the function for the board's direction."""
    name, upper = message.name, message.name.upper()
    kind = f"{name.capitalize()}Frame"
    yield f"\n#define FRAME_{upper} {message.id}U"
    yield f"#define SIZE_{upper} {message.packer.size}U"
    if not message.fields:
        return
    yield "typedef struct {"
    for field, type_ in message.fields.items():
        yield f"    {_C[type_]} {field};"
    yield f"}} {kind};\n"
    if read:
        yield f"static inline {kind} {name}_read(const uint8_t *from)\n{{\n    {kind} it;"
    else:
        yield f"static inline void {name}_write(const {kind} *it, uint8_t *to)\n{{"
    place = 0
    for field, type_ in message.fields.items():
        size = _BYTES[type_]
        if read:
            yield f"    memcpy(&it.{field}, from + {place}, {size});"
        else:
            yield f"    memcpy(to + {place}, &it->{field}, {size});"
        place += size
    yield "    return it;\n}" if read else "}"


def pins_h() -> str:
    """Port and bit of each pin.

    Returns
    -------
    str
        pins.h.
    """

    def lines() -> Iterator[str]:
        for name, pin in protocol.table("pins").items():
            if name == "board":
                continue
            port, bit = pin["port"][1], pin["port"][2]
            yield f"/* {pin['pin']}: {pin['does']} */"
            yield f"#define {name.upper()}_PORT PORT{port}"
            yield f"#define {name.upper()}_DDR DDR{port}"
            yield f"#define {name.upper()}_IN PIN{port}"
            yield f"#define {name.upper()}_BIT {bit}"

    return _wrapped("pins", lines())


def parameters_h(params: Board) -> str:
    """Where each parameter stands in the exported struct.

    Parameters
    ----------
    params : Board
        Any.

    Returns
    -------
    str
        parameters.h.
    """

    def lines() -> Iterator[str]:
        names = list(control.flat(params))
        alone = [name for name in names if "[" not in name]
        yield '#include <stddef.h>\n\n#include "two_stage_board.h"\n'
        yield f"#define PARAMETERS {len(names)}U"
        yield f"#define PARAMETERS_ALONE {len(alone)}U\n"
        yield "/* Of the numbers outside the Hall sensor's table, which is the rest. */"
        yield "#define PARAMETER_OFFSETS \\"
        offsets = [f"    offsetof(ControlBoard, {name})" for name in alone]
        yield ", \\\n".join(offsets)

    return _wrapped("parameters", lines())
