#!/usr/bin/python3
"""Overlaps of 200 pairs of cubes and irregular polyhedra, measured by Turbid, by YADE and by Qhull; masses and inertia.

    TURBID=turbid validation/engines/polyhedra.py [DIRECTORY]      # a few minutes; DIRECTORY keeps the runs

Turbid moves the second body of a pair towards the first at constant velocity, with contacts too soft to be felt. YADE is led along
the same path in small steps, from where the bodies are apart: bodies that overlap in its first step it measures wrongly. Qhull
intersects the half-spaces of both and decides where the two differ. Writes polyhedra.csv and inertia.csv beside this file and
prints the table. Needs Debian's `yade`, which brings numpy and scipy for Debian's Python.
"""
import json
import sys
import tempfile
from pathlib import Path

HERE = Path(__file__).resolve().parent
sys.path.insert(0, str(HERE.parents[1] / "ffi/engines"))
if sys.argv[1:2] == ["--engine"]:  # Started by Turbid: keeps its set-up message, and refuses.
    import protocol

    class Keeper:
        hello = {"name": "keeper", "shapes": ["polyhedron"], "walls": ["plane"], "orientations": True}

        def set_up(self, case, _bodies):
            Path(sys.argv[2]).write_text(json.dumps(case))
            raise protocol.Refusal("the set-up is kept")

    protocol.serve(Keeper())
    sys.exit()

import numpy as np  # noqa: E402
import vtp  # noqa: E402
from cases import numbers, paths, run, write  # noqa: E402
from pairs import EDGE, KINDS, STEPS, bodies, centroid, intersection, pair  # noqa: E402
from yade_pairs import Yade, approached, rebound, solid  # noqa: E402

DENSITY, BOX, STEP = 2500.0, 4 * EDGE, 1e-5  # kg/m^3, m, s
TOLERANCE, EXACT = 1e-6, 1e-12
COLUMNS = ["pair", "kind", "overlaps", "volume (m^3)", "volume, YADE (m^3)", "volume, Qhull (m^3)", "volume, Turbid - YADE (-)",
           "centroid, Turbid - YADE (-)", "volume, Turbid - Qhull (-)", "centroid, Turbid - Qhull (-)",
           "volume, YADE - Qhull (-)", "centroid, YADE - Qhull (-)", "volume, YADE in metres (-)",
           "largest volume that YADE in metres does not find (m^3)", "volume, YADE placed at once (-)",
           "normals apart (degrees)", "Turbid's force over volume (N/m^3)"]


def section(points, particles):
    """A kind of particles of a case: vertices, and a list of (position, orientation, velocity)."""
    listed = "".join(f"  {{ position = {numbers(x)}, orientation = {{ quaternion = {numbers(q)} }}, velocity = {numbers(v)} }},\n"
                     for x, q, v in particles)
    shape = "[" + ", ".join(map(numbers, points)) + "]"
    return f"[[particles]]\nshape = {{ polyhedron = {{ vertices = {shape} }} }}\ndensity = {DENSITY}\nlist = [\n{listed}]\n"


def turbid(directory, sections, box, more=""):
    return run(directory, f"""[domain]
size = [{box}, {box}, {box}]
periodic = [true, true, true]
[dry]
time_step = {STEP}
enlargement = 0
{"".join(sections)}[contact]
youngs_modulus = 1e-12
friction_static = 0
friction_kinetic = 0
[driving]
gravity = 0
[run]
end = {{ steps = {STEPS} }}
threads = 1
[output]
series_every = {{ steps = 1 }}
particles_every = "never"
contacts_every = {{ steps = 1 }}
surfaces_every = "never"
picture_every = "never"
checkpoint_every = "never"
{more}""")


def angle(a, b):
    """Between two vectors (degrees)."""
    return np.degrees(np.arctan2(np.linalg.norm(np.cross(a, b)), a @ b))


def overlaps(directory, number, kind, shapes):
    """A row of polyhedra.csv."""
    kinds, turns, start, step = pair(kind, shapes)
    points = [shapes[k] for k in kinds]
    where = np.full(3, BOX / 2) - 0.5 * start
    sections = [section(p, [(x, r.as_quat(), v)]) for p, r, x, v in
                zip(points, turns, (where, where + start), (np.zeros(3), step / STEP))]
    outcome = turbid(directory, sections, BOX)
    assert outcome.returncode == 0, outcome.stderr
    path = np.array([[[row[c] for c in "xyz"] for row in rows] for rows in paths(directory).values()]).swapaxes(0, 1)
    measured = zip(approached(points, turns, path), approached(points, turns, path, scale=1.0), path)
    size, worst, count = min(centroid(p)[0] for p in points) ** (1 / 3), np.zeros(8), 0
    for n, (seen, metres, now) in enumerate(measured, 1):
        # A file has the contacts that gave the forces of the step: those at its beginning.
        found = vtp.read(directory / f"out/contacts/contacts_{n:010}.vtp")
        if n < 4:
            assert n > 2 or not found and not seen[0], "apart, but in contact"
            continue
        volume, point, normal = found["volume"][0], np.array(found["Points"]), np.array(found["normal"])
        exact = intersection(*(r.apply(p) + x for r, p, x in zip(turns, points, now)), point)
        apart = lambda a, b: [abs(a[0] - b[0]) / exact[0], np.linalg.norm(a[1] - b[1]) / size]
        own = volume, point
        worst, count = np.maximum(worst, [*apart(own, seen), *apart(own, exact), *apart(seen, exact),
                                    apart(metres, exact)[0], 0.0 if metres[0] else exact[0]]), count + 1
    placed = Yade(points, turns).measure(*now)
    if "axes" in kind:
        x, y, z = np.abs(now[1] - now[0]) / EDGE
        slope = -np.array([(1 - y) * (1 - z), (1 - x) * (1 - z), (1 - x) * (1 - y)])
        closed = EDGE ** 3 * (1 - x) * (1 - y) * (1 - z)
        print(f"pair {number}, closed form: volume {volume / closed - 1:.1e} (Turbid), {seen[0] / closed - 1:.1e} (YADE); normal off "
              f"its gradient by {angle(abs(normal), abs(slope)):.6f}, {angle(abs(seen[2]), abs(slope)):.2f} degrees")
    return [number, kind, count, volume, seen[0], exact[0], *worst, apart(placed, exact)[0], min(angle(normal, v) for v in
            (seen[2], -seen[2])), found["force_magnitude"][0] / volume]


def inertia(directory, shapes):
    """Rows of inertia.csv: mass and principal moments of Turbid, each over those of YADE, less one."""
    spots = BOX * (np.arange(len(shapes)) + 0.5)
    sections = [section(p, [((x, BOX, BOX), (0, 0, 0, 1), (0, 0, 0))]) for p, x in zip(shapes, spots)]
    engine = f'[dem]\nengine = {{ command = ["/usr/bin/python3", "{HERE}/polyhedra.py", "--engine", "set_up.json"] }}\n'
    kept = (directory / "set_up.json").resolve()
    outcome = turbid(directory, sections, BOX * len(shapes), engine.replace("set_up.json", str(kept)))
    assert kept.exists(), outcome.stderr
    rows = []
    for number, (template, points) in enumerate(zip(json.loads(kept.read_text())["templates"], shapes)):
        own = np.array([template["mass"], *sorted(template["inertia"])])
        # YADE does not diagonalise tensors as small as those of millimetres in metres.
        ratios = []
        for scale in (1 / EDGE, 1.0):
            state = solid(points, DENSITY, scale).state
            ratios.append(own / [state.mass / scale ** 3, *(i / scale ** 5 for i in sorted(state.inertia))] - 1)
        rows.append([number, len(points), *own, *ratios[0], abs(ratios[1]).max()])
    return rows


def main(directory):
    shapes, rows = bodies(), []
    solids = inertia(directory / "inertia", shapes)
    axes = ["a", "b", "c"]
    write("inertia.csv", ["body", "vertices", "mass (kg)", *(f"I_{a} (kg m^2)" for a in axes), "mass, Turbid / YADE - 1",
                          *(f"I_{a}, Turbid / YADE - 1" for a in axes), "worst, YADE in metres"], solids)
    heavy = max(abs(x) for row in solids for x in row[6:10])
    print(f"masses and principal moments of {len(solids)} bodies: within {heavy:.1e} of YADE's, {EXACT:.0e} allowed "
          f"(within {max(row[10] for row in solids):.1e} if YADE has metres)")
    for kind, count in KINDS.items():
        for _ in range(count):
            rows.append(overlaps(directory / f"{len(rows):03}", len(rows), kind, shapes))
    write("polyhedra.csv", COLUMNS, rows)
    print("\n| pairs | overlaps | " + " | ".join(COLUMNS[6:16]) + " |\n" + "|---" * 12 + "|")
    for kind in [*KINDS, "all"]:
        mine = [row for row in rows if kind in (row[1], "all")]
        worst = [f"{max(row[i] for row in mine):.1e}" for i in range(6, 16)]
        print(f"| {kind} | {sum(row[2] for row in mine)} | " + " | ".join(worst) + " |")
    for what, i in ("in metres", 12), ("placed at once", 14):
        wrong = [row for row in rows if row[i] > TOLERANCE]
        print(f"YADE {what}: {len(wrong)} of {len(rows)} volumes wrong, {sum(row[i] == 1 for row in wrong)} not found")
    forces = [row[16] for row in rows]
    print(f"largest over smallest force per volume: 1 (YADE's law), {max(forces) / min(forces):.1f} (Turbid's)")
    for aside in ((0.0, 0.0), (0.3, 0.2), (0.4, 0.0)):
        print(f"YADE: cube on cube, face on face, shifted by {aside} edges: {rebound(shapes[0], aside):.4f} of the energy after a rebound")
    missed = [row for row in rows if max(row[6:8]) > TOLERANCE]
    wrong = [row for row in missed if max(row[8:10]) > TOLERANCE]
    print(f"\n{len(missed)} of {len(rows)} pairs beyond {TOLERANCE:.0e}; Qhull says that Turbid is wrong in {len(wrong)} of them")
    sys.exit(3 if wrong or heavy > EXACT else 0)


if len(sys.argv) > 1:
    main(Path(sys.argv[1]))
else:
    with tempfile.TemporaryDirectory() as scratch:
        main(Path(scratch))
