"""Identification from recordings only; the bench's parameters are never read."""

from typing import TYPE_CHECKING

from macromicro.lazy import front_door

if TYPE_CHECKING:
    from macromicro.identify.axis import Axis as Axis
    from macromicro.identify.axis import simulate as simulate
    from macromicro.identify.axis_fit import DriveFit as DriveFit
    from macromicro.identify.axis_fit import Filtering as Filtering
    from macromicro.identify.axis_fit import drive as drive
    from macromicro.identify.axis_inverse import STRUCTURES as STRUCTURES
    from macromicro.identify.axis_inverse import Estimate as Estimate
    from macromicro.identify.deadzone import DeadZone as DeadZone
    from macromicro.identify.deadzone import DiscontinuousDeadZone as DiscontinuousDeadZone
    from macromicro.identify.deadzone import Side as Side
    from macromicro.identify.deadzone import Trial as Trial
    from macromicro.identify.deadzone import dead_zone as dead_zone
    from macromicro.identify.deadzone import discontinuous_dead_zone as discontinuous_dead_zone
    from macromicro.identify.hall import calibrate as calibrate
    from macromicro.identify.kinds import KINDS as KINDS
    from macromicro.identify.kinds import from_files as from_files
    from macromicro.identify.linear import LinearFit as LinearFit
    from macromicro.identify.linear import Whiteness as Whiteness
    from macromicro.identify.linear import box_jenkins as box_jenkins
    from macromicro.identify.linear import gls as gls
    from macromicro.identify.linear import least_squares as least_squares
    from macromicro.identify.linear import mls as mls
    from macromicro.identify.linear import output_error as output_error
    from macromicro.identify.linear import sriv as sriv
    from macromicro.identify.notices import ConvergenceWarning as ConvergenceWarning
    from macromicro.identify.notices import DataWarning as DataWarning
    from macromicro.identify.notices import ResampledWarning as ResampledWarning
    from macromicro.identify.notices import RestWarning as RestWarning
    from macromicro.identify.notices import SaturationWarning as SaturationWarning
    from macromicro.identify.notices import UnstableWarning as UnstableWarning
    from macromicro.identify.play_operators import Loop as Loop
    from macromicro.identify.play_operators import load_plays as load_plays
    from macromicro.identify.play_operators import plays as plays
    from macromicro.identify.records import average_runs as average_runs
    from macromicro.identify.records import differentiated as differentiated
    from macromicro.identify.records import integrated as integrated
    from macromicro.identify.records import lowpassed as lowpassed
    from macromicro.identify.result import Result as Result
    from macromicro.identify.runs import Run as Run

# Public names by the module that defines them. For type checkers: also import them above.
_HOMES = {
    name: module
    for module, names in {
        "axis": "Axis simulate",
        "axis_fit": "DriveFit Filtering drive",
        "axis_inverse": "Estimate STRUCTURES",
        "deadzone": "DeadZone DiscontinuousDeadZone Side Trial dead_zone discontinuous_dead_zone",
        "hall": "calibrate",
        "kinds": "KINDS from_files",
        "linear": "LinearFit Whiteness box_jenkins gls least_squares mls output_error sriv",
        "notices": "ConvergenceWarning DataWarning ResampledWarning RestWarning"
        " SaturationWarning UnstableWarning",
        "play_operators": "Loop load_plays plays",
        "records": "average_runs differentiated integrated lowpassed",
        "result": "Result",
        "runs": "Run",
    }.items()
    for name in names.split()
}

__getattr__, __dir__ = front_door(__name__, _HOMES)
