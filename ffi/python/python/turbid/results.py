"""Whole runs, and the files that they write."""

import json
import os
from typing import Any, Dict, Iterable, Mapping, Optional, Union

import numpy as np

from . import _turbid

Case = Union[str, "os.PathLike[str]", Mapping[str, Any]]
"""A case: the path of a file, the text of one, or a dict with its keys."""


def _plain(value: Any) -> Any:
    """What JSON has for a value of a case."""
    if isinstance(value, os.PathLike):
        return os.fspath(value)
    if isinstance(value, (np.ndarray, np.generic)):
        return value.tolist()
    kind = type(value).__name__
    raise ValueError(f"case: expected dicts, lists, texts, numbers, paths and arrays of numpy, got {kind}")


def split_case(case: Case) -> "tuple[str, str]":
    """Returns the form of a case (``"path"``, ``"toml"`` or ``"json"``) and its text."""
    if isinstance(case, os.PathLike):
        return "path", os.fspath(case)
    if isinstance(case, str):
        return ("path" if case.endswith(".toml") and "\n" not in case else "toml"), case
    if isinstance(case, Mapping):
        return "json", json.dumps(case, allow_nan=False, default=_plain)
    raise ValueError(f"case: expected a path, a text or a dict, got {type(case).__name__}")


def run(
    case: Case, *, options: Iterable[str] = (), threads: Optional[int] = None, overwrite: bool = False
) -> Dict[str, Any]:
    """Runs a case to its end, writes all its files and returns the summary (``summary.json``).

    ``options`` replace keys, as ``--set`` of the program: ``["output.directory=out"]``. ``threads`` is the number of ranks, all
    cores by default. With ``overwrite`` results of an earlier run are replaced. Ctrl-C stops the run with its files closed.

    Raises :class:`turbid.Error` as the program does, and ``ValueError`` for a dict that is no case.
    """
    return json.loads(_turbid.run(*split_case(case), list(options), threads, overwrite))


def read_series(
    directory: "Union[str, os.PathLike[str]]", *, file: str = "series.csv", as_frame: Optional[bool] = None
) -> Any:
    """Reads the time series of a run from its output directory.

    Keys are the names of the columns without their units: ``"t"`` (s), ``"settling_velocity_over_stokes"`` (-),
    ``"net_flux_z"`` (m/s); values are arrays of shape (rows,), with NaN where the file has nothing. ``file`` may also be
    ``"particle_series.csv"``. Returns a ``pandas.DataFrame`` where pandas is installed, else a dict; ``as_frame`` decides it.
    The units are in the first line of the file, and in ``frame.attrs["units"]``.
    """
    path = os.path.join(directory, file)
    with open(path, encoding="utf-8") as lines:
        heads = next(lines).strip().split(",")
        rows = np.genfromtxt(lines, delimiter=",", ndmin=2)
    names = [head.partition(" (")[0] for head in heads]
    if rows.size == 0:
        rows = np.empty((0, len(names)))
    columns = {name: rows[:, at] for at, name in enumerate(names)}
    if as_frame is False:
        return columns
    try:
        import pandas
    except ImportError:
        if as_frame:
            raise
        return columns
    frame = pandas.DataFrame(columns)
    frame.attrs["units"] = {name: head.partition(" (")[2].rstrip(")") for name, head in zip(names, heads)}
    return frame


def read_summary(directory: "Union[str, os.PathLike[str]]") -> Dict[str, Any]:
    """Reads the summary of a run, ``summary.json``, from its output directory."""
    with open(os.path.join(directory, "summary.json"), encoding="utf-8") as file:
        return json.load(file)
