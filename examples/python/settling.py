"""A suspension settles, with a live plot of its settling velocity.

``python examples/python/settling.py`` opens a window; without a display it writes ``settling.png`` to the current folder.
``--short`` runs a smaller case in seconds. Needs matplotlib.
"""

import argparse
import os

import numpy as np

import turbid


def case(short):
    """A periodic box with glass spheres in oil, as a dict with the keys of a case file."""
    return {
        "domain": {"size": [4e-3, 4e-3, 6e-3]},
        "fluid": {"density": 1000.0, "viscosity": 1e-5},
        "lattice": {"cells_per_diameter": 4 if short else 8, "relaxation_time": 0.6},
        "particles": [{"shape": {"sphere": {"diameter": 1e-3}}, "density": 2500.0, "volume_fraction": 0.05, "seed": 1}],
        "run": {"end": {"time": 0.02 if short else 0.2}},
    }


def main(short=False, picture="settling.png"):
    """Returns the settling velocity at the end relative to the mixture (m/s)."""
    import matplotlib

    shown = bool(os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY")) and not short
    if not shown:
        matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    simulation = turbid.Simulation(case(short))
    times, velocities = [], []
    figure, axes = plt.subplots()
    (line,) = axes.plot([], [])
    axes.set_xlabel("time (s)")
    axes.set_ylabel("settling velocity (m/s)")

    def watch(simulation):
        flux, _ = simulation.mean_flow()
        times.append(simulation.time)
        velocities.append(flux[2] - np.average(simulation.velocities[:, 2], weights=simulation.volumes))
        if shown:
            line.set_data(times, velocities)
            axes.relim()
            axes.autoscale_view()
            plt.pause(0.001)

    simulation.run(callback=watch, every=10)
    if shown:
        plt.show()
    else:
        line.set_data(times, velocities)
        axes.relim()
        axes.autoscale_view()
        figure.savefig(picture)
        print(f"wrote {picture}")
    print(f"settling velocity: {velocities[-1]:.4f} m/s")
    return velocities[-1]


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--short", action="store_true", help="a smaller case, in seconds")
    parser.add_argument("--picture", default="settling.png", help="file of the plot without a display")
    main(**vars(parser.parse_args()))
