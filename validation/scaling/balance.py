"""Time of a run whose particles settle to a bed, with blocks that are cut once and with blocks that follow the particles.

    python3 validation/scaling/balance.py target/release/turbid [PAIRS [STOKES_TIMES]]

Runs take turns; prints the times of each pair, their ratio, and whether the states are the same to the bit.
"""

import json
import statistics
import subprocess
import sys
import tempfile
from pathlib import Path

CASE = """
[domain]
size = { diameters = [6, 6, 24] }
periodic = [true, true, false]
[fluid]
density = 1000.0
archimedes = 1000
[lattice]
cells_per_diameter = 9
relaxation_time = 0.55
[[particles]]
shape.sphere.diameter = 1e-3
density = 2500.0
volume_fraction = 0.15
[contact]
substeps = 3
[run]
end = { stokes_times = 150 }
[output]
fields_every = "never"
particles_every = "never"
contacts_every = "never"
picture_every = "never"
checkpoint_every = "never"
"""


def run(turbid: str, folder: Path, kind: str, end: str) -> tuple[float, str]:
    """Time (s) of a run, and the hash of its state at the end."""
    out = folder / kind
    options = ["--set", f"run.load_balancing={kind}", "--set", f"run.end.stokes_times={end}", "--threads", "2"]
    command = [turbid, "run", str(folder / "bed.toml"), *options, "--out", str(out), "--overwrite", "--quiet"]
    subprocess.run(command, check=True, stderr=subprocess.DEVNULL)
    summary = json.loads((out / "summary.json").read_text())
    return summary["wall_seconds"], summary["state_hash"]


def main() -> None:
    turbid = str(Path(sys.argv[1]).resolve())
    pairs, end = int((sys.argv[2:] or ["5"])[0]), (sys.argv[3:] or ["150"])[0]
    ratios = []
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        (folder / "bed.toml").write_text(CASE)
        for n in range(pairs):
            kinds = ["static", "dynamic"] if n % 2 == 0 else ["dynamic", "static"]
            found = {kind: run(turbid, folder, kind, end) for kind in kinds}
            (static, one), (dynamic, other) = found["static"], found["dynamic"]
            ratios.append(static / dynamic)
            same = "same state" if one == other else "OTHER STATE"
            print(f"static {static:7.2f} s, dynamic {dynamic:7.2f} s, ratio {ratios[-1]:.3f}, {same}", flush=True)
    print(f"median ratio {statistics.median(ratios):.3f} of {pairs} pairs")


main()
