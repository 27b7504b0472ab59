"""Parameters with intervals that hold where residuals are coloured."""

from cspm_ident.estimation.estimate import Estimate, Interval
from cspm_ident.estimation.identifiability import Direction
from cspm_ident.estimation.instruments import Exogeneity, InstrumentalSolution, fit_instruments
from cspm_ident.estimation.linear import Solution, fit_linear
from cspm_ident.estimation.nonlinear import fit
from cspm_ident.estimation.parameter import Parameter, Prior
from cspm_ident.estimation.problem import Problem
from cspm_ident.estimation.profile import Profile, find_profile
from cspm_ident.estimation.record import Record

__all__ = [
    "Direction",
    "Estimate",
    "Exogeneity",
    "InstrumentalSolution",
    "Interval",
    "Parameter",
    "Prior",
    "Problem",
    "Profile",
    "Record",
    "Solution",
    "find_profile",
    "fit",
    "fit_instruments",
    "fit_linear",
]
