"""Weights of `pdr_engine.body.length.network`, made by `proving_ground.evaluation.body.train` of recorded walks
(msindoor20) and simulated slopes.
"""

import numpy as np

from pdr_engine.body.length.network import Network

NETWORK = Network(
    hidden=np.array(
        [
            [0.030867, 0.170193, -0.689029, -0.300726],
            [-0.082619, 0.677962, 0.587925, 0.496909],
            [-0.826672, 0.623476, -0.869173, -0.010560],
            [-0.686371, -0.048028, 0.054544, 0.412028],
        ]
    ),
    output=np.array([1.173598, 0.664650, -0.521564, 0.816558, -0.285616]),
)
