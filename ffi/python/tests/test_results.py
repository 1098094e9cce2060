"""Whole runs and the files that they write."""

import json
import os
import signal
import threading

import numpy as np
import pytest
import turbid


def test_a_run_writes_its_files_and_they_are_read_back(case, tmp_path):
    case["output"] = {"directory": str(tmp_path / "out"), "series_every": {"steps": 10}}
    summary = turbid.run(case)
    assert summary["steps"] == 40 and summary["particles"] == 2 and not summary["interrupted"]
    assert turbid.read_summary(tmp_path / "out") == json.loads(json.dumps(summary))
    series = turbid.read_series(tmp_path / "out", as_frame=False)
    np.testing.assert_array_equal(series["step"], [0, 10, 20, 30, 40])
    assert (np.diff(series["settling_velocity_over_stokes"]) > 0).all()
    assert all(column.shape == (5,) for column in series.values())
    paths = turbid.read_series(tmp_path / "out", file="particle_series.csv", as_frame=False)
    assert set(paths["step"]) == {0, 10, 20, 30, 40}
    with pytest.raises(turbid.Error, match="overwrite|replace|results"):
        turbid.run(case)
    assert turbid.run(case, overwrite=True, threads=2)["state_hash"] == summary["state_hash"]


def test_a_series_is_a_frame_where_pandas_is(case, tmp_path):
    pandas = pytest.importorskip("pandas")
    turbid.run(case, options=[f"output.directory={tmp_path / 'out'}"])
    frame = turbid.read_series(tmp_path / "out")
    assert isinstance(frame, pandas.DataFrame) and frame.attrs["units"]["t"] == "s"


def test_without_pandas_a_frame_is_refused_and_the_default_is_a_dict(case, tmp_path, monkeypatch):
    monkeypatch.setitem(__import__("sys").modules, "pandas", None)
    turbid.run(case, options=[f"output.directory={tmp_path / 'out'}"])
    assert isinstance(turbid.read_series(tmp_path / "out"), dict)
    with pytest.raises(ImportError):
        turbid.read_series(tmp_path / "out", as_frame=True)


def test_ctrl_c_stops_a_run_with_its_files_closed(case, tmp_path, request):
    # A process that was started in the background ignores it.
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    request.addfinalizer(lambda: signal.signal(signal.SIGINT, before))
    case["run"]["end"] = {"steps": 10**7}
    case["output"] = {"directory": str(tmp_path / "out"), "series_every": {"steps": 10}}
    threading.Timer(0.5, os.kill, (os.getpid(), signal.SIGINT)).start()
    with pytest.raises(KeyboardInterrupt):
        turbid.run(case)
    assert turbid.read_summary(tmp_path / "out")["interrupted"]
    assert len(turbid.read_series(tmp_path / "out", as_frame=False)["step"]) > 1


def test_a_case_that_is_not_possible_writes_nothing(case, tmp_path):
    case["output"] = {"directory": str(tmp_path / "out")}
    case["fluid"]["density"] = -1.0
    with pytest.raises(turbid.Error) as error:
        turbid.run(case)
    assert error.value.key == "fluid.density" and not (tmp_path / "out").exists()
