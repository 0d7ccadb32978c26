"""A recording judged by itself: its settings, and the results of its moves."""

from __future__ import annotations

from typing import Any

from macromicro.design import served
from macromicro.design.response import MoveResult
from macromicro.errors import InputError
from macromicro.recording import Recording
from macromicro.runs import programmed
from macromicro.schema.par import entries, replaced
from macromicro.schema.text import parsed_toml
from macromicro.settings import Settings

_MOVES = ("move", "phase", "macro_reference", "micro_reference")


def settings_of(recording: Recording) -> Settings:
    """The settings that a recording holds."""
    found = Settings()
    text = recording.attributes.get("settings")
    if not isinstance(text, str):
        return found
    try:
        told = parsed_toml(text, "settings")
    except InputError:
        return found
    for entry in entries(found):
        raw = _at(told, entry.path)
        if raw is None:
            continue
        try:
            found = replaced(found, entry.path, entry.read(raw, entry.path))
        except InputError:
            continue
    return found


def _at(table: Any, path: str) -> Any:
    for name in path.split("."):
        table = table.get(name) if isinstance(table, dict) else None
    return table


def has_moves(recording: Recording) -> bool:
    """Whether a recording has the columns for moves."""
    return served.is_live(recording) or all(name in recording for name in _MOVES)


def moves(recording: Recording, settings: Settings | None = None) -> list[MoveResult]:
    """Results of all moves, from the recording alone."""
    if not len(recording):
        return []
    settings = settings_of(recording) if settings is None else settings
    if served.is_live(recording):
        found = served.served_moves(recording)
        done = programmed.moves_of(found.recording, found.programme, settings)
        return [move._replace(complete=not found.cut[move.move]) for move in done]
    begun, what = served.ran(recording)
    done = programmed.moves_of(recording, what, settings)
    return [move for move in done if begun[move.move]]
