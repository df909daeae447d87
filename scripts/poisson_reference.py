"""Prints the errors of screened Poisson surface reconstruction, given the true normals, on known shapes.

    pip install pymeshlab==2025.7.post1 numpy==2.4.6
    cargo test --release --lib implicit_accuracy -- --ignored
    python scripts/poisson_reference.py target/tmp/accuracy

The second command writes the points as <shape>-<noise>-<seed>.xyz, with the outward normals at their positions before noise
was added. tests/core/implicit_accuracy.rs contains the resulting table, and compares the implicit surface of the same points,
without the normals, with it.

Each row is the mean over the seeds of the mean distance to the shape: that of each triangle's centre, weighted by area.
Depth is that of the octree; other settings are the library's defaults, except for one thread, so that every run gives the same.
Best is the depth with the smallest error; components and total genus of its surfaces are listed for every outcome.
It takes some minutes.
"""

import sys
from collections import defaultdict
from importlib.metadata import version
from pathlib import Path

import numpy as np
import pymeshlab

DEPTHS = [5, 6, 7, 8, 9]


# The shapes of tests/common/points.rs: signed distances near the surface, except for the blend.
def sphere(p):
    return np.linalg.norm(p, axis=1) - 1


def ring(p, radius, tube):
    return np.hypot(np.hypot(p[:, 0], p[:, 1]) - radius, p[:, 2]) - tube


def ball(p, centre, radius):
    return np.linalg.norm(p - centre, axis=1) - radius


def merged(a, b, width=0.15):
    overlap = np.maximum(width - np.abs(a - b), 0) / width
    return np.minimum(a, b) - overlap**2 * width * 0.25


def torus(p):
    return ring(p, 0.7, 0.3)


def blend(p):
    first, second = ball(p, [0.62, 0, 0], 0.36), ball(p, [-0.44, 0.44, 0.1], 0.32)
    return merged(merged(ring(p, 0.62, 0.18), first), second)


def pair(p):
    return np.minimum(ball(p, [-0.5, 0, 0], 0.5), ball(p, [0.65, 0.2, 0], 0.35))


def distance(shape, p):
    step = 1e-5 * np.eye(3)
    slope = np.stack([(shape(p + d) - shape(p - d)) / 2e-5 for d in step], axis=1)
    return np.abs(shape(p)) / np.linalg.norm(slope, axis=1)


def mean_error(shape, mesh):
    a, b, c = mesh.vertex_matrix()[mesh.face_matrix()].transpose(1, 0, 2)
    areas = np.linalg.norm(np.cross(b - a, c - a), axis=1)
    return np.average(distance(shape, (a + b + c) / 3), weights=areas)


def reconstructed(points, normals, depth):
    meshes = pymeshlab.MeshSet()
    meshes.add_mesh(pymeshlab.Mesh(vertex_matrix=points, v_normals_matrix=normals))
    meshes.generate_surface_reconstruction_screened_poisson(depth=depth, threads=1)
    return meshes


def parts_and_genus(meshes):
    found = meshes.get_topological_measures()
    euler = found["vertices_number"] - found["edges_number"] + found["faces_number"]
    parts = found["connected_components_number"]
    return f"{parts}, {parts - euler // 2}" if found["boundary_edges"] == 0 else f"{parts}, open"


def row(name, noise, files):
    shape = {"sphere": sphere, "torus": torus, "blend": blend, "pair": pair}[name]
    errors, topology = np.zeros((len(files), len(DEPTHS))), defaultdict(set)
    for k, file in enumerate(files):
        columns = np.loadtxt(file)
        for d, depth in enumerate(DEPTHS):
            meshes = reconstructed(columns[:, :3], columns[:, 3:], depth)
            errors[k, d] = mean_error(shape, meshes.current_mesh())
            topology[d].add(parts_and_genus(meshes))
    means = errors.mean(axis=0)
    best = int(means.argmin())
    figures = "".join(f"{error:10.6f}" for error in means)
    return f"{name:8}{noise:5}{len(files):7}{figures}{DEPTHS[best]:7}   {' or '.join(sorted(topology[best]))}"


print("pymeshlab", version("pymeshlab"))
print("generate_surface_reconstruction_screened_poisson(depth=<depth>, threads=1)")
depths = "".join(f"   depth {depth}" for depth in DEPTHS)
print(f"{'shape':8}noise  seeds{depths}   best   parts, genus")
cases = defaultdict(list)
for file in sorted(Path(sys.argv[1]).glob("*.xyz")):
    name, noise, _ = file.stem.split("-")
    cases[name, float(noise)].append(file)
for (name, noise), files in sorted(cases.items()):
    print(row(name, noise, files), flush=True)
