"""Reconstructs points by MeshLab's screened Poisson surface reconstruction, the peer of our implicit surface.

    python3 bench/poisson.py <job.json>

`npm run real -- FOLDER --clouds` writes the job, runs this and measures the surfaces. It needs `pip install pymeshlab numpy`.

A job names a file of points and perhaps one of their true normals, packed float32, and a folder for the surfaces. There are those with
estimated normals (16 neighbours, octree of depth 8) and with the true normals (depths 6 to 9; the best is chosen by its error, which is more than
anyone without the truth could do). Other settings are the library's defaults, except for one thread.
"""

import json
import sys
from pathlib import Path
from time import perf_counter

import numpy as np
import pymeshlab

NEIGHBORS = 16
DEPTH = 8
DEPTHS = [6, 7, 8, 9]


def packed(path):
    return np.fromfile(path, np.float32).reshape(-1, 3).astype(float)


def estimated(points):
    meshes = pymeshlab.MeshSet()
    meshes.add_mesh(pymeshlab.Mesh(vertex_matrix=points))
    meshes.compute_normal_for_point_clouds(k=NEIGHBORS)
    return meshes


def given(points, normals):
    meshes = pymeshlab.MeshSet()
    meshes.add_mesh(pymeshlab.Mesh(vertex_matrix=points, v_normals_matrix=normals))
    return meshes


def reconstructed(make, depth, file):
    """Writes the surface, and returns the names of its files and the seconds it took."""
    started = perf_counter()
    meshes = make()
    meshes.generate_surface_reconstruction_screened_poisson(depth=depth, threads=1)
    seconds = perf_counter() - started
    mesh = meshes.current_mesh()
    mesh.vertex_matrix().astype(np.float32).tofile(f"{file}.positions")
    mesh.face_matrix().astype(np.uint32).tofile(f"{file}.triangles")
    return {"file": file, "seconds": seconds}


def run(job):
    points = packed(job["points"])
    found = {"estimated": [reconstructed(lambda: estimated(points), DEPTH, f"{job['folder']}/estimated")]}
    if job.get("normals"):
        normals = packed(job["normals"])
        make = lambda: given(points, normals)
        found["true"] = [reconstructed(make, depth, f"{job['folder']}/true{depth}") for depth in DEPTHS]
    return found


if __name__ == "__main__":
    print(json.dumps(run(json.loads(Path(sys.argv[1]).read_text()))))
