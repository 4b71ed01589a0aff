"""Weights of `pdr_engine.body.length.network`; made of msindoor20 by `proving_ground.evaluation.train_body`."""

import numpy as np

from pdr_engine.body.length.network import Network

NETWORK = Network(
    hidden=np.array(
        [
            [0.054236, 0.115803, 0.000000, -0.092071],
            [0.135411, 0.689818, 0.000000, 0.939739],
            [0.054225, 0.116046, 0.000000, -0.092783],
            [-0.565561, -0.098038, -0.000000, 0.478913],
        ]
    ),
    output=np.array([0.193266, 0.691038, 0.194184, 0.403221, -0.675045]),
)
