"""Does the cost of a particle and of a covered cell grow with their number where sizes differ by ten?

    python3 validation/scaling/sizes.py target/release/turbid [ROUNDS]

Equal spheres beside spheres of two sizes, 1 to 10, half of the volume each; a box and one of eight times its volume; with fluid and without.
Runs take turns; prints medians of one thread.
"""

import json
import statistics
import subprocess
import sys
import tempfile
from pathlib import Path

SPHERES = """
[[particles]]
shape.sphere.diameter = {diameter}
density = 2500.0
volume_fraction = {fraction}
granular_temperature = 1e-4
"""
BOX = """
[domain]
size = [{edge}, {edge}, {edge}]
periodic = [true, true, true]
[run]
end = {{ steps = 1000 }}
"""
WET = """
[fluid]
density = 1000.0
viscosity = 1e-6
[lattice]
cells_per_diameter = 5
relaxation_time = 0.55
[contact]
substeps = 3
[driving]
gravity = 0
"""
DRY = """
[dry]
impact_speed = 0.05
"""
# Edge of the smaller box (m), solid volume fraction, steps of a sample.
KINDS = {"with fluid": (WET, 0.02, 0.2, 20), "without": (DRY, 0.0276, 0.5, 50)}
SIZES = {"equal": [1e-3], "1 to 10": [1e-3, 1e-2]}


def bench(turbid: str, case: Path, steps: int) -> dict:
    command = [turbid, "bench", str(case), "--threads", "1", "--steps", str(steps), "--json"]
    return json.loads(subprocess.run(command, check=True, capture_output=True, text=True).stdout)


def main() -> None:
    turbid, rounds = str(Path(sys.argv[1]).resolve()), int((sys.argv[2:] or ["3"])[0])
    found: dict = {}
    with tempfile.TemporaryDirectory() as name:
        case = Path(name) / "case.toml"
        for _ in range(rounds):
            for kind, (text, edge, fraction, steps) in KINDS.items():
                for sizes, diameters in SIZES.items():
                    for times in [1, 2]:
                        spheres = [SPHERES.format(diameter=d, fraction=fraction / len(diameters)) for d in diameters]
                        case.write_text(BOX.format(edge=times * edge) + text + "".join(spheres))
                        found.setdefault((kind, sizes, times), []).append(bench(turbid, case, steps))
    print("| spheres | sizes | particles | motion and contacts, ns a particle | contacts, of all | a covered cell, ns |")
    print("|---|---|---|---|---|---|")
    for (kind, sizes, _), reports in found.items():
        count = reports[0]["particles"]
        dem = statistics.median(report["stages"]["dem"] for report in reports) / count * 1e9
        cells = [report["nanoseconds_per_covered_cell"] for report in reports]
        covered = f"{statistics.median(cells):.1f}" if None not in cells else ""
        print(f"| {kind} | {sizes} | {count} | {dem:.0f} | {reports[0]['contacts'] / count:.3f} | {covered} |")


if __name__ == "__main__":
    main()
