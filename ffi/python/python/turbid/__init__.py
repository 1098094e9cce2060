"""Particle-resolved suspension dynamics: rigid convex bodies in a lattice Boltzmann fluid, coupled both ways.

Everything is in SI units. A :class:`Simulation` steps a case in this process; :func:`run` runs one to its end and writes all files,
as the program ``turbid`` does; :func:`read_series` and :func:`read_summary` read them. Failures are :class:`Error`.
"""

from ._turbid import Error, __version__
from .results import read_series, read_summary, run
from .simulation import LOAD, PARTICLE, Fields, Simulation

__all__ = [
    "Error",
    "Fields",
    "LOAD",
    "PARTICLE",
    "Simulation",
    "__version__",
    "read_series",
    "read_summary",
    "run",
]
