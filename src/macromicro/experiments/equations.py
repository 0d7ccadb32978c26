"""The thesis' numbered equations, each with what measures or shows it here."""

from __future__ import annotations

_PREISACH = "preisach-geometry"

# Number: claims that measure it, or else the figure, table, diagram or procedure that shows it.
EQUATIONS: dict[str, tuple[str, ...]] = {
    "2.1": ("(2.1)",),
    **{f"2.{k}": (_PREISACH,) for k in range(2, 11)},
    "2.11": ("S2", _PREISACH),
    "3.1": ("D1",),
    # The motor: no claim measures its constants one by one, the diagrams show what they make.
    "4.1": ("4.3",),
    "4.2": ("4.6",),
    "4.3": ("M4a", "M4b"),
    "4.4": ("M5",),
    "4.5": ("M6a", "M6b"),
    "4.6": ("M3b",),
    "4.7": ("M6a", "M6b"),
    "4.8": ("M6a", "M6b"),
    "4.9": ("M11b",),
    "4.10": ("M11",),
    "5.1": ("S2",),
    "5.2": ("S5a", "S5b"),
    "5.3": ("S5a",),
    "5.4": ("S5b",),
    "5.5": ("S5b",),
    "5.6": ("S7",),
    "5.7": ("S9",),
    "5.8": ("S9",),
    "5.9": ("S8",),
}
