"""A parameter sweep on all cores: the settling velocity of a suspension over its volume fraction.

``python examples/python/sweep.py`` runs one case for each volume fraction, each on one thread, as many at a time as there are cores,
and prints a table. ``--short`` takes two small cases. A table of results is also what ``turbid study`` makes, from one file.
"""

import argparse
import multiprocessing
import tempfile
from pathlib import Path

import turbid


def settle(task):
    """Runs one case in a process of its own: volume fraction and settling velocity over the Stokes velocity."""
    fraction, end, directory = task
    case = {
        "domain": {"size": {"diameters": [4, 4, 6]}},
        "fluid": {"density": 1000.0, "archimedes": 20},
        "lattice": {"cells_per_diameter": 6, "relaxation_time": 0.6},
        "particles": [
            {"shape": {"sphere": {"diameter": 1e-3}}, "density": 2500.0, "volume_fraction": fraction, "seed": 1}
        ],
        "run": {"end": {"stokes_times": end}},
        "output": {"directory": str(directory / f"phi{fraction}")},
    }
    turbid.run(case, threads=1, overwrite=True)
    series = turbid.read_series(directory / f"phi{fraction}", as_frame=False)["settling_velocity_over_stokes"]
    return fraction, float(series[len(series) // 2 :].mean())


def main(short=False, directory=None):
    """Returns the settling velocity over the Stokes velocity, by volume fraction."""
    fractions, end = ([0.05, 0.2], 1.0) if short else ([0.02, 0.05, 0.1, 0.2, 0.3], 10.0)
    with tempfile.TemporaryDirectory() as scratch:
        folder = Path(directory or scratch)
        tasks = [(fraction, end, folder) for fraction in fractions]
        # Processes that start anew: threads of a simulation do not live on in a copy of its process.
        with multiprocessing.get_context("spawn").Pool() as pool:
            results = dict(pool.imap(settle, tasks))
    print("volume fraction  settling velocity / Stokes velocity")
    for fraction, velocity in results.items():
        print(f"{fraction:15.2f}  {velocity:35.4f}")
    return results


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--short", action="store_true", help="two small cases")
    parser.add_argument("--directory", help="folder for the files of the runs, else none is kept")
    main(**vars(parser.parse_args()))
