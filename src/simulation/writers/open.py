"""Opens the results of the run in this folder in ParaView 5.10 or newer, at their last time:

    paraview --script=open.py                  to look round, and to press play
    pvbatch open.py --save picture.png         one picture, without a window

Particles and fluid have one colour map, of their speed. The fluid is shown on two upright slices through the middle of the box, which a
quarter of the particles is cut away for. What is there but hidden (contacts, and force chains where there is a fluid)
stands in the pipeline browser. Every run writes this file anew: to change it, make a copy beside it.
"""

import argparse
import json
import os

from paraview.simple import *  # noqa: F403

# Particles up to which none is cut away.
FEW = 20
# Without surfaces, spheres stretched to the size of a particle stand for these shapes, boxes for all others.
ROUND = {"sphere", "ellipsoid", "capsule", "superellipsoid"}
INK, PAPER, GREY = [0.1, 0.1, 0.1], [1.0, 1.0, 1.0], [0.6, 0.6, 0.6]


def folder():
    """The folder of this file, which a script of ParaView's window knows from the command line only, on Linux."""
    if "__file__" in globals():
        return os.path.dirname(os.path.abspath(__file__))
    with open("/proc/self/cmdline", encoding="utf-8") as file:
        words = [word.removeprefix("--script=") for word in file.read().split("\0")]
    return os.path.dirname(os.path.abspath(next((word for word in words if word.endswith(".py")), "open.py")))


def opened(name):
    """What a file of the run has at its last time, or nothing if it is not there or empty."""
    path = os.path.join(here, name)
    if not os.path.exists(path):
        return None
    if name.endswith(".pvd"):
        data = PVDReader(registrationName=name, FileName=path)
        data.UpdatePipeline(list(data.TimestepValues)[-1])
    else:
        data = XMLPolyDataReader(registrationName=name, FileName=[path])
        data.UpdatePipeline()
    return data if data.GetDataInformation().GetNumberOfPoints() else None


def largest(data, array):
    """The largest value of an array, of its magnitude if it has components."""
    info = data.PointData.GetArray(array) or data.CellData.GetArray(array)
    return info.GetRange(-1 if info.GetNumberOfComponents() > 1 else 0)[1]


def clipped(data, box, inside, name):
    """What lies inside or outside of a box, from its low to its high corner."""
    data = Clip(registrationName=name, Input=data, ClipType="Box", Invert=inside)
    data.ClipType.Position = box[0]
    data.ClipType.Length = [high - low for low, high in zip(*box)]
    return data


def show(data, array="velocity"):
    """Shows data in the colours of one of its arrays."""
    display = Show(data, view)
    ColorBy(display, ("POINTS", array))
    return display


def glyphs(display):
    """Draws points as bodies of their size and orientation."""
    try:
        with open(os.path.join(here, "summary.json"), encoding="utf-8") as file:
            is_round = all(shape["kind"] in ROUND for shape in json.load(file)["shapes"])
    except OSError:  # the run has not ended
        is_round = True
    display.SetRepresentationType("3D Glyphs")
    display.GlyphType = "Sphere" if is_round else "Box"
    if is_round:
        display.GlyphType.ThetaResolution = display.GlyphType.PhiResolution = 24
    display.Scaling, display.ScaleFactor = 1, 1.0
    display.ScaleMode, display.SelectScaleArray = "Vector Components", "size"
    display.Orient, display.OrientationMode, display.SelectOrientationVectors = 1, "Quaternion", "orientation"


def colours(array, title, top, preset):
    """Gives an array a colour map from 0 to its largest value, with a scale beside the picture."""
    table = GetColorTransferFunction(array)
    table.ApplyPreset(preset, True)
    table.RescaleTransferFunction(0.0, top or 1.0)
    table.AutomaticRescaleRangeMode = "Never"
    scale = GetScalarBar(table, view)
    scale.Title, scale.ComponentTitle = title, ""
    scale.TitleColor = scale.LabelColor = INK
    scale.TitleFontSize = scale.LabelFontSize = 18
    scale.LabelFormat = scale.RangeLabelFormat = "%-#.3g"
    scale.WindowLocation, scale.Position, scale.ScalarBarLength = "Any Location", [0.87, 0.3], 0.4
    scale.Visibility = 1


arguments = argparse.ArgumentParser(description="Opens the results of a run in ParaView.")
arguments.add_argument("--save", metavar="PNG", help="picture to write")
arguments.add_argument("--size", default="1200x1000", help="of the picture, in pixels (%(default)s)")
arguments, _ = arguments.parse_known_args()

here = folder()
size = [int(pixels) for pixels in arguments.size.split("x")]
view = GetActiveViewOrCreate("RenderView")
if arguments.save:
    view.ViewSize = size
view.UseColorPaletteForBackground, view.Background = 0, PAPER
view.OrientationAxesLabelColor = INK

names = ["fields.pvd", "surfaces.pvd", "particles.pvd", "contacts.pvd", "force_chains.pvd", "walls.vtp"]
fields, surfaces, points, contacts, chains, walls = map(opened, names)
bodies = surfaces or points
everything = [data for data in (fields, walls, bodies) if data]
if not everything:
    raise SystemExit(f"no results for ParaView in {here}")
GetAnimationScene().UpdateAnimationUsingDataTimeSteps()
GetAnimationScene().GoToLast()

bounds = everything[0].GetDataInformation().GetBounds()
low, high = bounds[0::2], bounds[1::2]
middle = [(a + b) / 2 for a, b in zip(low, high)]
reach = max(b - a for a, b in zip(low, high))
# The quarter before the slices, with room for what sticks out of the box.
quarter = ([middle[0], low[1] - reach, low[2] - reach], [high[0] + reach, middle[1], high[2] + reach])

number = points.GetDataInformation().GetNumberOfPoints() if points else FEW + 1
if bodies:
    visible = bodies
    if fields and number > FEW:
        visible = clipped(bodies, quarter, 0, "particles behind the slices")
    display = show(visible)
    display.Ambient = 0.15
    if not surfaces:
        glyphs(display)
    if chains and not fields:
        ColorBy(display, None)
        display.DiffuseColor, display.Opacity = GREY, 0.06

if fields:
    smooth = CellDatatoPointData(registrationName="fields at points", Input=fields)
    for axis, name in ((0, "slice along y"), (1, "slice along x")):
        plane = Slice(registrationName=name, Input=smooth, SliceType="Plane")
        plane.SliceType.Origin, plane.SliceType.Normal = middle, [float(i == axis) for i in range(3)]
        # A hair wider than the quarter, or rounding decides whether a slice is in it.
        wide = [q - 1e-6 * reach for q in quarter[0]], [q + 1e-6 * reach for q in quarter[1]]
        half = clipped(plane, wide, 1, f"half of the {name}")
        display = show(half)
        display.Ambient, display.Diffuse = 1.0, 0.0
        if bodies:
            edges = Contour(registrationName=f"bodies on the {name}", Input=half, ContourBy=["POINTS", "solid_fraction"])
            edges.Isosurfaces = [0.5]
            display = Show(edges, view)
            ColorBy(display, None)
            display.AmbientColor = display.DiffuseColor = INK
            display.LineWidth = 2.0

if chains:
    tubes = Tube(registrationName="force chains as tubes", Input=chains, Scalars=["POINTS", "force_magnitude"])
    diameter = largest(bodies, "equivalent_diameter") if bodies else 0.02 * reach
    tubes.VaryRadius, tubes.Radius, tubes.RadiusFactor = "By Scalar", 0.01 * diameter, 20.0
    if not fields:
        show(tubes, "force_magnitude")
        colours("force_magnitude", "contact force (N)", largest(chains, "force_magnitude"), "Inferno (matplotlib)")

if walls:
    display = Show(walls, view)
    ColorBy(display, None)
    display.DiffuseColor, display.Opacity = GREY, 0.08
if fields or walls:
    display = Show(Outline(registrationName="box", Input=everything[0]), view)
    display.DiffuseColor = display.AmbientColor = INK

moving = [data for data in (fields, bodies) if data]
if moving:
    speed = max(largest(data, "velocity") for data in moving)
    if not (chains and not fields):
        colours("velocity", "speed (m/s)", speed, "Viridis (matplotlib)")
    time = AnnotateTimeFilter(registrationName="time", Input=moving[0], Format="t = {time:.4g} s")
    display = Show(time, view)
    display.Color, display.WindowLocation, display.FontSize = INK, "Upper Left Corner", 20

view.CameraFocalPoint, view.CameraViewUp = middle, [0.0, 0.0, 1.0]
view.CameraPosition = [m + reach * d for m, d in zip(middle, (1.2, -1.7, 0.8))]
view.ResetCamera()
view.GetActiveCamera().Dolly(1.25)
Render(view)
if arguments.save:
    SaveScreenshot(arguments.save, view, ImageResolution=size)
