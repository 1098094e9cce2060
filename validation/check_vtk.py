#!/usr/bin/env python3
"""Opens every .vti, .vtp, .pvti, .pvtp and .pvd of an output directory with VTK's own readers and checks what is in them.

    python3 -m venv vtkenv && vtkenv/bin/pip install vtk pyvista
    vtkenv/bin/python validation/check_vtk.py OUTPUT_DIRECTORY

Checks: arrays, components, sizes and units; all values finite; solid fraction within 0..1, solid where the particles of
the same step are, and of their volume; particle speeds and mean velocity equal to the row of series.csv with the
same step; masses of one density for each kind; surfaces of particles as large and turned as `size` and `orientation` of their points say, which draw the same
glyphs; contacts have unit normals, forces that are the sum of their parts, partners that are particles or walls, and points near both; force chains lead
from particles to contacts; an index (.pvti, .pvtp) names all pieces of its folder and no others; walls are polygons inside of
the box that they bound; files and times of a .pvd agree with the files themselves and with series.csv (through pyvista's
reader too if it is installed and knows the files: not .pvtp). Prints a table; exit status 1 if anything is wrong.
"""

import csv
import re
import sys
import xml.etree.ElementTree as ElementTree
from pathlib import Path

import numpy as np
from vtkmodules.util.numpy_support import vtk_to_numpy
from vtkmodules.vtkIOXML import (vtkXMLImageDataReader, vtkXMLPImageDataReader, vtkXMLPolyDataReader,
                                 vtkXMLPPolyDataReader)
from vtkmodules.vtkFiltersSources import vtkCubeSource
from vtkmodules.vtkRenderingCore import vtkGlyph3DMapper
from vtkmodules.vtkCommonCore import vtkOutputWindow, vtkStringOutputWindow

try:
    import pyvista
except ImportError:
    pyvista = None

FIELDS = {"velocity": 3, "pressure": 1, "solid_fraction": 1}
SURFACES = {"id": 1, "kind": 1, "equivalent_diameter": 1, "speed": 1, "velocity": 3, "angular_velocity": 3,
            "contact_force": 3}
POINTS = {**SURFACES, "volume": 1, "mass": 1, "size": 3, "orientation": 4, "contact_torque": 3}
FLUID_ON_POINTS = {"hydrodynamic_force": 3, "hydrodynamic_torque": 3}
CONTACTS = {"first": 1, "second": 1, "normal": 3, "force": 3, "force_magnitude": 1, "normal_force": 1, "tangential_force": 3,
            "depth": 1, "volume": 1, "parts": 2, "image": 3}
CHAINS = {"id": 1, "force_magnitude": 1}
READERS = {".vti": vtkXMLImageDataReader, ".pvti": vtkXMLPImageDataReader, ".vtp": vtkXMLPolyDataReader,
           ".pvtp": vtkXMLPPolyDataReader}
WALLS = {"wall": 1, "velocity": 3, "Normals": 3}
WEAR = {"wall": 1, "contact_impulse": 3, "normal_impulse": 1, "mean_pressure": 1, "friction_work": 1, "mean_friction_power": 1}
SINGLE = 1e-5  # relative error that single precision is allowed

problems = []


def check(condition, path, text):
    if not condition:
        problems.append(f"{path}: {text}")
    return condition


def is_index(path):
    return path.suffix.startswith(".p")


def files(directory, suffix):
    """Files of this kind, and indices of files in pieces; the pieces themselves are read through them."""
    found = [*directory.rglob(f"*{suffix}"), *directory.rglob(f"*{suffix.replace('.', '.p')}")]
    return sorted(path for path in found if not re.search(r"_p\d+$", path.stem))


def read(path):
    """Output of the VTK reader for a file; what VTK has to complain about is a problem."""
    reader = READERS[path.suffix]()
    if is_index(path):
        named = [path.parent / piece.get("Source") for piece in ElementTree.parse(path).getroot().iter("Piece")]
        there = path.with_suffix("").iterdir()
        check(sorted(named) == sorted(there), path, "does not name the pieces that are there")
    window = vtkStringOutputWindow()
    vtkOutputWindow.SetInstance(window)
    reader.SetFileName(str(path))
    reader.Update()
    said = window.GetOutput().strip()
    check(not said, path, f"VTK says {said!r}")
    data = reader.GetOutput()
    units = data.GetFieldData().GetAbstractArray("units")
    if check(units is not None, path, "no units"):
        named = [units.GetValue(i).split(": ")[0] for i in range(units.GetNumberOfValues())]
        both = data.GetPointData(), data.GetCellData()
        there = [part.GetArrayName(i) for part in both for i in range(part.GetNumberOfArrays())]
        check(sorted(named) == sorted(there), path, f"units of {named}, arrays {there}")
    return data


def arrays(path, data, tuples, expected):
    """Arrays of point or cell data by name, checked for size and for values that are not finite."""
    found = {}
    for name, components in expected.items():
        array = data.GetArray(name)
        if not check(array is not None, path, f"no array {name}"):
            continue
        check(array.GetNumberOfComponents() == components, path, f"{name} has the wrong number of components")
        check(array.GetNumberOfTuples() == tuples, path, f"{name} has {array.GetNumberOfTuples()} of {tuples} values")
        values = vtk_to_numpy(array)
        check(np.isfinite(values).all(), path, f"{name} is not finite everywhere")
        found[name] = values
    return found


def step_of(path):
    return int(re.search(r"(\d+)\.\w+$", path.name).group(1))


def read_series(directory):
    """Rows of series.csv by step, columns by name without unit."""
    path = directory / "series.csv"
    if not path.exists():
        return {}
    with path.open(newline="") as file:
        rows = list(csv.reader(file))
    names = [name.split(" (")[0] for name in rows[0]]
    check(all(len(row) == len(names) for row in rows), path, "rows of different length")
    return {int(row[0]): dict(zip(names, (float(cell or "nan") for cell in row))) for row in rows[1:] if len(row) == len(names)}


def check_fields(path, series):
    image = read(path)
    cells = image.GetNumberOfCells()
    check(cells > 0, path, "no cells")
    values = arrays(path, image.GetCellData(), cells, FIELDS)
    if set(values) != set(FIELDS) or cells == 0:
        return None, "unreadable"
    spacing = np.array(image.GetSpacing())
    check((spacing == spacing[0]).all() and spacing[0] > 0, path, f"cells are not cubes: {spacing}")
    solid = values["solid_fraction"]
    check(solid.min() >= 0 and solid.max() <= 1, path, f"solid fraction in {solid.min()}..{solid.max()}")
    time = image.GetFieldData().GetArray("TimeValue")
    if check(time is not None and time.GetNumberOfTuples() == 1, path, "no TimeValue"):
        time = time.GetValue(0)
        row = series.get(step_of(path))
        check(row is None or row["t"] == time, path, f"TimeValue {time} but series.csv says {row and row['t']}")
    speed = np.linalg.norm(values["velocity"], axis=1)
    size = " x ".join(str(n - 1) for n in image.GetDimensions())
    summary = (
        f"{size} cells, |u| <= {speed.max():.4g} m/s, "
        f"p {values['pressure'].min():.4g}..{values['pressure'].max():.4g} Pa, solid {solid.mean():.5f}"
    )
    return (image, values, time), summary


def check_points(path, series):
    """Bodies of a file of points as (centre, velocity, angular velocity, volume), and a summary."""
    data = read(path)
    points = data.GetNumberOfPoints()
    wet = data.GetPointData().HasArray("hydrodynamic_force")
    expected = {**POINTS, **(FLUID_ON_POINTS if wet else {})}
    values = arrays(path, data.GetPointData(), points, expected)
    check(data.GetNumberOfVerts() == points, path, f"{data.GetNumberOfVerts()} vertices for {points} particles")
    if points == 0:
        return [], "0 particles"
    if set(values) != set(expected):
        return None, "unreadable"
    places = points_of(data)
    check(data.GetPoints().GetData().GetDataTypeAsString() == "double", path, "points are not in double precision")
    check(np.isfinite(places).all(), path, "points are not finite")
    check(len(np.unique(values["id"])) == points, path, "a particle is there twice")
    check(is_index(path) or (np.diff(values["id"].astype(np.int64)) > 0).all(), path, "particles are not in order")
    check(np.allclose(np.linalg.norm(values["orientation"], axis=1), 1, atol=1e-9), path, "orientations are not of unit length")
    volumes = np.pi / 6 * values["equivalent_diameter"] ** 3
    check(np.allclose(volumes, values["volume"], rtol=1e-9, atol=0), path, "volume is not that of equivalent_diameter")
    for kind in np.unique(values["kind"]):
        density = (values["mass"] / values["volume"])[values["kind"] == kind]
        check(np.allclose(density, density[0], rtol=1e-12, atol=0), path, f"kind {kind} has several densities")
    filled = volumes / values["size"].prod(axis=1)
    check((filled > 0).all() and (filled < 1 + 1e-9).all(), path, "a body is larger than its box")
    speed = np.linalg.norm(values["velocity"], axis=1)
    check(np.allclose(speed, values["speed"], rtol=1e-12, atol=0), path, "speed is not |velocity|")
    row = series.get(step_of(path))
    compared = compare_motion(path, row, values["velocity"], speed)
    glyphs = check_glyphs(path, data, values)
    bodies = list(zip(places, values["velocity"], values["angular_velocity"], volumes))
    kinds = len(np.unique(values["kind"]))
    return bodies, f"{points} particles of {kinds} kinds, speed <= {speed.max():.4g} m/s ({compared}){glyphs}"


def check_glyphs(path, data, values):
    """Holds the boxes that ParaView's 3D Glyphs make of `size` and `orientation` against the surfaces of the same step."""
    beside = sibling(path, path.parent.parent / "surfaces", "particles_", "surfaces_")
    if beside is None:
        return ""
    cube = vtkCubeSource()
    cube.Update()
    mapper = vtkGlyph3DMapper()
    mapper.SetInputData(data)
    mapper.SetSourceData(cube.GetOutput())
    mapper.SetScaleModeToScaleByVectorComponents()
    mapper.SetScaleArray("size")
    mapper.SetOrientationModeToQuaternion()
    mapper.SetOrientationArray("orientation")
    drawn = np.array(mapper.GetBounds()).reshape(3, 2)
    surface = read(beside)
    ids, corners = vtk_to_numpy(surface.GetPointData().GetArray("id")), points_of(surface)
    low, high = corners.min(axis=0), corners.max(axis=0)
    largest = np.linalg.norm(values["size"], axis=1).max()
    check((np.abs(drawn[:, 0] - low) < largest).all() and (np.abs(drawn[:, 1] - high) < largest).all(), path,
          f"glyphs fill {drawn.tolist()}, surfaces {low} to {high}")
    places = points_of(data)
    for number, centre, size, (w, *v) in zip(values["id"], places, values["size"], values["orientation"]):
        arms, v = corners[ids == number] - centre, -np.array(v)
        turned = arms + 2 * np.cross(v, np.cross(v, arms) + w * arms)
        ratio = (turned.max(axis=0) - turned.min(axis=0)) / size
        if not check((ratio > 0.9).all() and (ratio < 1 + SINGLE).all(), path,
                     f"the surface of particle {number} fills {ratio} of its size"):
            break
    return ", surfaces as glyphs"


def compare_motion(path, row, velocity, speed):
    """Speeds and mean velocity as in a row of series.csv."""
    if row is None:
        return "no such step in series.csv"
    tolerance = SINGLE * speed.max() + 1e-300
    check(abs(speed.max() - row["max_particle_speed"]) <= tolerance, path,
          f"largest speed {speed.max()} but series.csv says {row['max_particle_speed']}")
    check(abs(speed.mean() - row["mean_particle_speed"]) <= tolerance, path,
          f"mean speed {speed.mean()} but series.csv says {row['mean_particle_speed']}")
    for i, axis in enumerate("xyz"):
        expected = row[f"mean_particle_velocity_{axis}"]
        check(abs(velocity[:, i].mean() - expected) <= tolerance, path,
              f"mean velocity {axis} {velocity[:, i].mean()} but series.csv says {expected}")
    return "as in series.csv"


def check_surfaces(path, series):
    surface = read(path)
    points = surface.GetNumberOfPoints()
    values = arrays(path, surface.GetPointData(), points, SURFACES)
    if points == 0:
        return "0 particles"
    if set(values) != set(SURFACES):
        return "unreadable"
    places = vtk_to_numpy(surface.GetPoints().GetData()).astype(float)
    check(np.isfinite(places).all(), path, "points are not finite")
    triangles = vtk_to_numpy(surface.GetPolys().GetConnectivityArray()).reshape(-1, 3)
    check(len(triangles) == surface.GetNumberOfPolys(), path, "not only triangles")
    ids, first, owner = np.unique(values["id"], return_index=True, return_inverse=True)
    for name in SURFACES:
        check((values[name] == values[name][first][owner]).all(), path, f"{name} varies on one particle")
    check((owner[triangles] == owner[triangles[:, :1]]).all(), path, "a triangle joins two particles")
    velocity = values["velocity"][first].astype(float)
    speed = np.linalg.norm(velocity, axis=1)
    check(np.allclose(speed, values["speed"][first], rtol=SINGLE, atol=0), path, "speed is not |velocity|")
    centres = np.array([places[owner == i].mean(axis=0) for i in range(len(ids))])
    a, b, c = (places[triangles[:, i]] - centres[owner[triangles[:, 0]]] for i in range(3))
    volumes = np.bincount(owner[triangles[:, 0]], weights=np.einsum("ij,ij->i", a, np.cross(b, c)) / 6)
    check((volumes > 0).all(), path, "a surface is inside out")
    sizes = np.pi / 6 * values["equivalent_diameter"][first].astype(float) ** 3
    ratio = volumes / sizes
    check((ratio > 0.85).all() and (ratio < 1.001).all(), path,
          f"surfaces hold {ratio.min():.4f} to {ratio.max():.4f} of the volume of their equivalent sphere")
    normals = surface.GetPointData().GetArray("Normals")
    if normals is not None:
        normals = vtk_to_numpy(normals)
        check(np.allclose(np.linalg.norm(normals, axis=1), 1, atol=SINGLE), path, "normals are not of unit length")
    smooth = "" if normals is None else "smooth, "
    compared = compare_motion(path, series.get(step_of(path)), velocity, speed)
    kinds = len(np.unique(values["kind"]))
    return f"{len(ids)} surfaces of {kinds} kinds, {smooth}speed <= {speed.max():.4g} m/s ({compared})"


def points_of(data):
    """Points as an array of rows; VTK has none at all for an empty piece."""
    if data.GetNumberOfPoints() == 0:
        return np.zeros((0, 3))
    return vtk_to_numpy(data.GetPoints().GetData()).astype(float)


def sibling(path, folder, prefix, other):
    """The file of the same step in another folder, in one or in pieces, if there is one."""
    name = path.stem.replace(prefix, other)
    return next((file for suffix in (".vtp", ".pvtp") if (file := folder / (name + suffix)).exists()), None)


def particles_beside(path, prefix):
    """Ids, centres and half diagonals of the particle file of the same step, or nothing."""
    path = sibling(path, path.parent.parent / "particles", prefix, "particles_")
    if path is None:
        return None
    data = read(path)
    if data.GetNumberOfPoints() == 0:
        return {}
    ids, sizes = (vtk_to_numpy(data.GetPointData().GetArray(name)) for name in ("id", "size"))
    return {int(i): (centre, np.linalg.norm(size) / 2) for i, centre, size in zip(ids, points_of(data), sizes)}


def check_contacts(path, series):
    data = read(path)
    points = data.GetNumberOfPoints()
    check(data.GetNumberOfVerts() == points, path, f"{data.GetNumberOfVerts()} vertices for {points} contacts")
    values = arrays(path, data.GetPointData(), points, CONTACTS)
    if set(values) != set(CONTACTS):
        return "unreadable"
    if points == 0:
        return "0 contacts"
    first, second = values["first"], values["second"]
    order = np.stack([first, np.where(second < 0, np.int64(2) ** 62 + second, second)], axis=1)
    check(len(np.unique(order, axis=0)) == points, path, "a contact is there twice")
    # Pieces are in order each for itself.
    check(is_index(path) or (np.lexsort(order.T[::-1]) == np.arange(points)).all(), path, "contacts are not in order")
    force = np.linalg.norm(values["force"].astype(float), axis=1)
    check(np.allclose(force, values["force_magnitude"], rtol=SINGLE, atol=0), path, "force_magnitude is not |force|")
    check(np.allclose(np.linalg.norm(values["normal"], axis=1), 1, atol=SINGLE), path, "normals are not of unit length")
    parts = values["tangential_force"] - values["normal_force"][:, None] * values["normal"]
    check(np.abs(parts - values["force"]).max() <= SINGLE * force.max(), path, "force is not the sum of its parts")
    check((values["depth"] > 0).all() and (values["volume"] > 0).all(), path, "an overlap is empty")
    bodies = particles_beside(path, "contacts_")
    if bodies is not None:
        ids = np.concatenate([first, second[second >= 0]])
        check(all(int(i) in bodies for i in ids), path, "a contact of a particle that does not exist")
    row = series.get(step_of(path))
    if row is not None and (second < 0).any():
        on_walls = -values["force"][second < 0].astype(float).sum(axis=0)
        expected = np.array([row[f"wall_force_{axis}"] for axis in "xyz"])
        check(np.abs(on_walls - expected).max() <= 1e-4 * force.sum(), path,
              f"force on walls {on_walls} but series.csv says {expected}")
    walls = int((second < 0).sum())
    return f"{points} contacts, {walls} with walls, force <= {force.max():.4g} N, depth <= {values['depth'].max():.4g} m"


def check_chains(path):
    data = read(path)
    points = data.GetNumberOfPoints()
    check(2 * data.GetNumberOfLines() == points, path, f"{data.GetNumberOfLines()} lines for {points} ends")
    values = arrays(path, data.GetPointData(), points, CHAINS)
    if points == 0 or set(values) != set(CHAINS):
        return "0 lines"
    places = points_of(data).reshape(-1, 2, 3)
    check((values["id"][::2] == values["id"][1::2]).all(), path, "a line of two particles")
    bodies = particles_beside(path, "force_chains_")
    if bodies:
        for ends, number in zip(places, values["id"][::2]):
            reach = bodies[int(number)][1]
            if not check(np.linalg.norm(ends[1] - ends[0]) < 1.2 * reach, path, f"a line leaves particle {number}"):
                break
    return f"{len(places)} lines"


def check_walls(path):
    data = read(path)
    points = data.GetNumberOfPoints()
    values = arrays(path, data.GetPointData(), points, WALLS)
    if not check(points > 0 and data.GetNumberOfPolys() > 0, path, "no polygons") or set(values) != set(WALLS):
        return "unreadable"
    normals = values["Normals"].astype(float)
    check(np.allclose(np.linalg.norm(normals, axis=1), 1, atol=SINGLE), path, "normals are not of unit length")
    low, high = points_of(data).min(axis=0), points_of(data).max(axis=0)
    size = " x ".join(f"{length:.4g}" for length in high - low)
    speed = np.linalg.norm(values["velocity"], axis=1).max()
    return f"{len(np.unique(values['wall']))} walls of {data.GetNumberOfPolys()} polygons within {size} m, speed <= {speed:.4g} m/s"


def check_wear(path):
    data = read(path)
    points = data.GetNumberOfPoints()
    values = arrays(path, data.GetPointData(), points, WEAR)
    if not check(points == 3 * data.GetNumberOfPolys() > 0, path, "no facets of three points") or set(values) != set(WEAR):
        return "unreadable"
    check((values["normal_impulse"] >= 0).all(), path, "a normal impulse is negative")
    friction, normal = values["friction_work"][::3].sum(dtype=float), values["normal_impulse"][::3].sum(dtype=float)
    return f"{points // 3} facets, normal impulse {normal:.4g} N s, work of friction {friction:.4g} J"


def check_together(path, fields, bodies):
    """Fluid and particles of one step: solid volume, and where the particles are."""
    image, values, _ = fields
    if not bodies:
        check(values["solid_fraction"].max() == 0, path, "solid without particles")
        return "no solid"
    dx = image.GetSpacing()[0]
    cells = np.array(image.GetDimensions()) - 1
    size = cells * dx
    # Ramps on a coarse grid are a little larger than the bodies.
    ratio = values["solid_fraction"].sum(dtype=float) * dx**3 / sum(body[3] for body in bodies)
    check(0.85 < ratio < 1.25, path, f"solid volume is {ratio:.3f} times that of the particles")
    solid = values["solid_fraction"].reshape(cells[::-1])
    index = [np.floor(np.mod(body[0], size) / dx).astype(int) % cells for body in bodies]
    missing = sum(solid[tuple(i[::-1])] < 1 for i in index)
    check(missing == 0, path, f"{missing} particles have no solid at their centre")
    velocity = values["velocity"].reshape(*cells[::-1], 3)
    own = np.array([body[1] for body in bodies])
    there = np.array([velocity[tuple(i[::-1])] for i in index])
    # Only told: a centre lies up to half a cell from the centre of its cell, and coupling is not exact.
    slip = np.abs(there - own).max() / max(np.abs(own).max(), 1e-300)
    return f"solid volume / particles' volume {ratio:.4f}, |u - u_particle| <= {slip:.2g} of the fastest at centres"


def check_collection(path, times, series):
    entries = ElementTree.parse(path).getroot().findall("./Collection/DataSet")
    last = -np.inf
    for entry in entries:
        file, time = path.parent / entry.get("file"), float(entry.get("timestep"))
        check(time > last, path, f"time {time} does not grow")
        last = time
        if not check(file.exists(), path, f"{file} does not exist"):
            continue
        known = times.get(file.resolve())
        check(known is None or known == time, path, f"{file.name} says time {known}, the collection {time}")
        row = series.get(step_of(file))
        check(row is None or row["t"] == time, path, f"{file.name} is at {time} but series.csv says {row and row['t']}")
    if pyvista is not None and entries and not entries[0].get("file").endswith(".pvtp"):
        reader = pyvista.PVDReader(str(path))
        check(reader.time_values == [float(entry.get("timestep")) for entry in entries], path,
              f"pyvista reads the times {reader.time_values}")
        reader.set_active_time_value(reader.time_values[-1])
        check(reader.read().n_blocks == 1, path, "pyvista reads no data")
    # A collection lists all files of the folder that has its name.
    suffix = {"fields.pvd": ".vti"}.get(path.name, ".vtp")
    on_disk = len(files(path.parent / path.stem, suffix))
    check(on_disk == len(entries), path, f"lists {len(entries)} of {on_disk} files")
    return f"{len(entries)} files, t {entries[0].get('timestep')} .. {last} s" if entries else "empty"


def main(directory):
    series = read_series(directory)
    table, times = [], {}
    for path in files(directory, ".vti"):
        result, text = check_fields(path, series)
        table.append((path, text))
        if result is None:
            continue
        times[path.resolve()] = result[2]
        particles = sibling(path, directory / "particles", "fields_", "particles_")
        bodies = check_points(particles, {})[0] if particles is not None else None
        if bodies is not None:
            table.append((path, check_together(path, result, bodies)))
    for path in files(directory, ".vtp"):
        if path.name == "walls.vtp":
            table.append((path, check_walls(path)))
        elif path.name.startswith("contacts_"):
            table.append((path, check_contacts(path, series)))
        elif path.name.startswith("wear_"):
            table.append((path, check_wear(path)))
        elif path.name.startswith("force_chains_"):
            table.append((path, check_chains(path)))
        elif path.name.startswith("particles_"):
            table.append((path, check_points(path, series)[1]))
        else:
            table.append((path, check_surfaces(path, series)))
    for path in sorted(directory.rglob("*.pvd")):
        table.append((path, check_collection(path, times, series)))
    check(table, directory, "no files for VTK here")
    left = [str(path) for path in directory.rglob("*.tmp")]
    check(not left, directory, f"half-written files: {left}")

    width = max((len(str(path.relative_to(directory))) for path, _ in table), default=0)
    for path, text in table:
        print(f"{str(path.relative_to(directory)):{width}}  {text}")
    for problem in problems:
        print(f"WRONG  {problem}")
    print(f"{len(table)} checks of files, {len(problems)} problems, {len(series)} rows in series.csv")
    return 1 if problems else 0


if __name__ == "__main__":
    if len(sys.argv) != 2:
        sys.exit(__doc__)
    sys.exit(main(Path(sys.argv[1])))
