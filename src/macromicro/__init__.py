"""Design, simulate, identify, tune and run a two-stage linear positioner.

The names below are loaded when they are first used, so that importing the package
costs next to nothing.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from macromicro.api import load_settings as load_settings
    from macromicro.api import moves as moves
    from macromicro.api import run as run
    from macromicro.errors import InputError as InputError
    from macromicro.recording import Recording as Recording
    from macromicro.settings import Settings as Settings

__version__ = "0.1.0"

# Public name -> the module that defines it. For type checkers: also import it above.
_HOMES = {
    "InputError": "macromicro.errors",
    "Recording": "macromicro.recording",
    "Settings": "macromicro.settings",
    "load_settings": "macromicro.api",
    "moves": "macromicro.api",
    "run": "macromicro.api",
}


def __getattr__(name: str) -> Any:
    if name not in _HOMES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    value = getattr(import_module(_HOMES[name]), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted({*globals(), *_HOMES})
