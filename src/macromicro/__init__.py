"""Design, simulate, identify, tune and run a two-stage linear positioner."""

from typing import TYPE_CHECKING

from macromicro.lazy import front_door

if TYPE_CHECKING:
    from macromicro import motion as motion
    from macromicro.api import load_settings as load_settings
    from macromicro.api import moves as moves
    from macromicro.api import run as run
    from macromicro.api import tracking as tracking
    from macromicro.errors import ArrivalWarning as ArrivalWarning
    from macromicro.errors import InputError as InputError
    from macromicro.recording import Recording as Recording
    from macromicro.remote.asynchronous import AsyncMachine as AsyncMachine
    from macromicro.remote.machine import connect as connect
    from macromicro.settings import Settings as Settings
    from macromicro.studies import calibrate as calibrate
    from macromicro.studies import robust as robust
    from macromicro.studies import sweep as sweep
    from macromicro.studies import tune as tune
    from macromicro.traces import overlay as overlay

__version__ = "0.1.0"

# Public name -> the module here that defines it, "" for a module. For type checkers: also
# import it above.
_HOMES = {
    "ArrivalWarning": "errors",
    "AsyncMachine": "remote.asynchronous",
    "InputError": "errors",
    "Recording": "recording",
    "Settings": "settings",
    "connect": "remote.machine",
    "load_settings": "api",
    "motion": "",
    "moves": "api",
    "overlay": "traces",
    "calibrate": "studies",
    "robust": "studies",
    "run": "api",
    "sweep": "studies",
    "tracking": "api",
    "tune": "studies",
}

__getattr__, __dir__ = front_door(__name__, _HOMES)
