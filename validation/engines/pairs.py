"""Convex bodies, and paths on which two of them meet: cubes with faces, edges and corners, and random poses."""
import numpy as np
from scipy.spatial import ConvexHull, HalfspaceIntersection
from scipy.spatial.transform import Rotation

EDGE = 1e-3  # m
STEPS = 16  # along a path
DEEPEST = 0.15 * EDGE
RANDOM = np.random.default_rng(20)
KINDS = {"face on face, along the axes": 10, "face on face, turned about the normal": 10, "edge on face": 20, "edge on edge": 20,
         "corner on face": 20, "cubes, random": 20, "irregular polyhedra": 100}


def centroid(points):
    """Volume and centroid of a convex hull, summed over tetrahedra."""
    middle = points.mean(axis=0)
    corners = points[ConvexHull(points).simplices] - middle
    volumes = np.abs(np.linalg.det(corners)) / 6
    return volumes.sum(), middle + (volumes[:, None] * corners.sum(axis=1)).sum(axis=0) / (4 * volumes.sum())


def intersection(first, second, inside):
    """Volume and centroid of what two convex hulls share; `inside` is a point of it. Lengths are scaled for Qhull's tolerances."""
    planes = np.concatenate([ConvexHull((points - inside) / EDGE).equations for points in (first, second)])
    volume, middle = centroid(HalfspaceIntersection(planes, np.zeros(3)).intersections)
    return volume * EDGE ** 3, middle * EDGE + inside


def bodies():
    """Vertices of a cube and of ten bodies with 8 to 26 corners on ellipsoids, about their centroids (m)."""
    made = [EDGE * np.array([[(n >> i & 1) - 0.5 for i in range(3)] for n in range(8)])]
    for n in range(10):
        points = RANDOM.normal(size=(8 + 2 * n, 3))
        points *= RANDOM.uniform(0.7, 1.3, 3) * EDGE * 0.7 / np.linalg.norm(points, axis=1)[:, None]
        made.append(points - centroid(points)[1])
    return made


def meeting(first, second, aside, towards):
    """Distance from `aside` along `towards` of the second body at which the two touch; not above 0 if they pass each other.

    They overlap if they do along every axis that separates polyhedra: normals of faces and products of edges.
    """
    normals, edges = [], []
    for points in (first, second):
        hull = ConvexHull(points)
        a, b, c = (points[hull.simplices[:, i]] for i in range(3))
        normals.append(hull.equations[:, :3])
        edges.append(np.concatenate([b - a, c - b, a - c]))
    axes = np.concatenate([*normals, np.cross(edges[0][:, None], edges[1][None]).reshape(-1, 3) / EDGE ** 2])
    lengths = np.linalg.norm(axes, axis=1)
    axes = axes[lengths > 1e-6] / lengths[lengths > 1e-6][:, None]
    axes = np.concatenate([axes, -axes])
    reach = (first @ axes.T).max(axis=0) + (second @ -axes.T).max(axis=0) - axes @ aside
    speed = axes @ towards
    along = speed > 1e-6
    return (reach[along] / speed[along]).min() if (reach[~along] > 2 * DEEPEST).all() else 0


def pair(kind, shapes):
    """Numbers of the shapes, orientations, and positions of the second body relative to the first: start and step (m)."""
    turn, anyhow = Rotation.from_euler, lambda: Rotation.random(random_state=np.random.RandomState(RANDOM.integers(2**31)))
    while True:
        numbers, whole, first, second = (0, 0), anyhow(), Rotation.identity(), turn("z", RANDOM.uniform(0, 6.3))
        if kind.endswith("along the axes"):
            whole = second = Rotation.identity()
        elif kind == "edge on face":
            second *= turn("x", 45, degrees=True)
        elif kind == "edge on edge":
            first = turn("x", 45, degrees=True)
            second = turn("z", RANDOM.uniform(0.5, 2.6)) * first
        elif kind == "corner on face":
            second *= Rotation.from_rotvec(np.array([-1, 1, 0]) / 2 ** 0.5 * np.arccos(-1 / 3 ** 0.5))
        elif "face" not in kind:
            first, second = anyhow(), anyhow()
            numbers = tuple(RANDOM.integers(1, 11, 2)) if kind.startswith("irregular") else numbers
        turns, towards = (whole * first, whole * second), whole.apply([0, 0, 1])
        aside = whole.apply([*RANDOM.uniform(-0.3, 0.3, 2) * EDGE, 0])
        touch = meeting(*(r.apply(shapes[k]) for r, k in zip(turns, numbers)), aside, towards)
        if touch > 0:
            step = RANDOM.uniform(0.3, 1.0) * DEEPEST / STEPS
            return numbers, turns, aside + (touch + 1.5 * step) * towards, -step * towards
