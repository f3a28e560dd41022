"""Diastole from Python: runs, studies and the rig, by way of the program `diastole` and the daemon's socket.

    import diastole
    run = diastole.simulate("examples/gel.experiment.toml", "gel.run.h5", specimen="gel-7")
    fit = diastole.Study("examples/phantom-a.study.toml").fit()
    fit.parameters["C1_kPa"].value
"""

from diastole.program import DiastoleError, call, program
from diastole.rig import Rig, Sample
from diastole.run import Note, Run, compare, runs, simulate
from diastole.study import Study
from diastole import results

__all__ = ["DiastoleError", "Note", "Rig", "Run", "Sample", "Study", "call", "compare", "program", "results", "runs", "simulate"]
