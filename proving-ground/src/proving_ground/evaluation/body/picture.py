"""A picture for the manual: height and movement class of every step of a simulated walk, over the truth."""

from pathlib import Path

import numpy as np

from pdr_engine.body import BodySettings
from proving_ground.evaluation.body.classes import CLASSES, course, told
from proving_ground.evaluation.body.recorded_run import walk_body
from proving_ground.evaluation.body.wearers import walked, worn
from proving_ground.evaluation.plots import STYLE, TRUTH
from proving_ground.people import Person
from proving_ground.sensors import Air

_SEED = 3


def save_classes(path: Path) -> None:
    """The course of all classes by one drawn person with a unit on the chest."""
    import matplotlib as mpl

    mpl.use("Agg")
    from matplotlib import pyplot as plt

    person = Person.drawn(np.random.default_rng(_SEED))
    motion = walked(person, list(course(crawls=True)), _SEED)
    run = worn(motion, "chest", _SEED, "consumer", Air(origin_height_m=420.0, seed=_SEED))
    steps = walk_body(run, BodySettings()).steps
    at_s = np.arange(0.0, motion.duration_s, 0.2)
    with plt.style.context(STYLE):
        figure, (height, kind) = plt.subplots(2, 1, figsize=(10.0, 5.0), sharex=True, layout="constrained")
        height.plot(at_s, motion.torso.ground_m(at_s), color=TRUTH, linewidth=2.6, alpha=0.45, label="truth")
        known = [(step.time_ns * 1e-9, step.height.height_m) for step in steps if step.height is not None]
        time_s, height_m = np.array(known).T
        height.plot(time_s, height_m - height_m[0], ".", markersize=3, label="steps")
        height.set(ylabel="height, m")
        height.legend(loc="upper left")
        names = [told(step) for step in steps]
        rows = [CLASSES.index(name) if name in CLASSES else -1 for name in names]
        kind.plot([step.time_ns * 1e-9 for step in steps], rows, ".", markersize=4)
        kind.set(xlabel="s", yticks=range(len(CLASSES)), yticklabels=CLASSES)
        kind.grid(visible=True)
        figure.savefig(path, dpi=90)
        plt.close(figure)
