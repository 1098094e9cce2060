"""The scripts in examples/python, in their short forms, and the example of the README."""

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[3]


def run(script, *arguments):
    path = ROOT / "examples/python" / script
    environment = {name: value for name, value in os.environ.items() if name not in ("DISPLAY", "WAYLAND_DISPLAY")}
    done = subprocess.run(
        [sys.executable, path, "--short", *map(str, arguments)], env=environment, capture_output=True, text=True, timeout=600
    )
    assert done.returncode == 0, done.stderr
    return done.stdout


def test_settling_writes_its_plot_where_there_is_no_display(tmp_path):
    pytest.importorskip("matplotlib")
    picture = tmp_path / "settling.png"
    printed = run("settling.py", "--picture", picture)
    assert picture.read_bytes()[:4] == b"\x89PNG"
    assert 0.01 < float(re.search(r"settling velocity: (\S+) m/s", printed)[1]) < 0.1


def test_a_dem_in_python_lets_spheres_settle():
    last = run("own_dem.py").strip().splitlines()[-1]
    heights = [float(height) for height in last.split("heights")[1].split()[:-1]]
    assert all(0.49 < now < before for now, before in zip(heights, [4.0, 1.5, 2.8]))


def test_a_sweep_shows_that_a_denser_suspension_settles_more_slowly():
    rows = [line.split() for line in run("sweep.py").strip().splitlines()[1:]]
    (few, fast), (many, slow) = [[float(number) for number in row] for row in rows]
    assert few < many and fast > slow > 0


def test_the_example_of_the_readme_prints_a_settling_velocity(tmp_path):
    text = (ROOT / "ffi/python/README.md").read_text()
    (tmp_path / "example.py").write_text(re.search(r"```python\n(.*?)```", text, re.S)[1])
    done = subprocess.run([sys.executable, "example.py"], cwd=tmp_path, capture_output=True, text=True, timeout=600)
    assert done.returncode == 0, done.stderr
    assert 0.01 < float(re.search(r"(\S+) m/s", done.stdout)[1]) < 0.1
