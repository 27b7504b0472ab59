"""The calm sea with a cable that creeps; the file of the machine knows nothing of it."""

import numpy as np

from cspm_ident.diagnosis.residuals.regressors import Candidate, Place
from cspm_sim.effects import Channel, catalogue

TRUE = np.array([2e-3, 0.0])
CREPT, HEALTHY = Place(Channel.TENSION, "sway_2"), Place(Channel.TENSION, "sway_3")
CREEP = """  - effect: cable_creep
    elements: [sway_2]
    parameters: {compliance: 2.0e-3, time_constant: 3.0}
"""
CREEPING = Candidate(catalogue()["cable_creep"], "sway_2", (("time_constant", 3.0),))
START_S = 12.0
