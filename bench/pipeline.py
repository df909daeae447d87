"""Times the alternative to this library for a mesh with even triangles: VTK's flying edges, then MeshLab's isotropic remeshing.

    python3 bench/pipeline.py <job.json>

`npm run real -- FOLDER --pipeline` writes the job, runs this and prints the figures below our own. It needs `pip install vtk pymeshlab numpy`.

- Native code with one thread each; ours is WebAssembly.
- The same voxels, the same iso value, and the mean edge of our surface as target.
- MeshLab makes ten rounds, its default. Three, as in CGAL's example, are timed as well, but their result is not measured.
- Reading files and converting arrays is not timed.
- Flying edges leaves the surface open where the object crosses the border of the volume, and remeshing may open it elsewhere: edges with
  one triangle, and with more than two, are counted.
"""

import json
import os
import sys
from pathlib import Path

from peers import ONE_THREAD, best, flying_edges

# Packages read these when they are imported, which happens below.
os.environ.update(ONE_THREAD)

ROUNDS = 10
FEW_ROUNDS = 3
# Number of points of the contour at which its distance from the result is measured.
SAMPLES = 200_000


def contour(row):
    """Returns the iso-surface: milliseconds, positions and triangles."""
    import numpy
    from vtkmodules.util.numpy_support import vtk_to_numpy

    voxels = numpy.fromfile(row["voxels"], numpy.float32).reshape(row["dims"][::-1])
    milliseconds, found = best(1, flying_edges(voxels, row["spacing"], row["iso"]))
    triangles = vtk_to_numpy(found.GetPolys().GetConnectivityArray()).reshape(-1, 3)
    return milliseconds, vtk_to_numpy(found.GetPoints().GetData()).astype(float), triangles


def remesh(positions, triangles, edge, rounds):
    """Returns the milliseconds, and a mesh set whose current mesh is the result."""
    import pymeshlab

    meshes = pymeshlab.MeshSet()
    meshes.add_mesh(pymeshlab.Mesh(positions, triangles))
    target = pymeshlab.PureValue(edge)
    work = lambda: meshes.meshing_isotropic_explicit_remeshing(iterations=rounds, targetlen=target)
    milliseconds, _ = best(1, work)
    return milliseconds, meshes


def edges_by_triangles(triangles):
    """Returns the number of edges with one triangle, and of those with more than two."""
    import numpy

    edges = numpy.sort(triangles[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1)
    _, counts = numpy.unique(edges, axis=0, return_counts=True)
    return int((counts == 1).sum()), int((counts > 2).sum())


def smallest_angle(positions, triangles):
    import numpy

    corners = positions[triangles]
    sides = numpy.roll(corners, -1, axis=1) - corners
    lengths = numpy.linalg.norm(sides, axis=2)
    cosines = -(sides * numpy.roll(sides, 1, axis=1)).sum(axis=2) / (lengths * numpy.roll(lengths, 1, axis=1))
    return float(numpy.degrees(numpy.arccos(numpy.clip(cosines, -1, 1))).min())


def recall(meshes, positions, triangles, reach):
    """Returns the fraction of the contour's area within `reach` of the current mesh."""
    import pymeshlab

    result = meshes.current_mesh_id()
    meshes.add_mesh(pymeshlab.Mesh(positions, triangles))
    meshes.get_hausdorff_distance(
        sampledmesh=meshes.current_mesh_id(),
        targetmesh=result,
        savesample=True,
        samplevert=False,
        sampleface=True,
        samplenum=SAMPLES,
        maxdist=pymeshlab.PureValue(2 * reach),
    )
    # Points further away than maxdist are left out.
    samples = next(mesh for mesh in meshes if mesh.label() == "Hausdorff Sample Point")
    near = (abs(samples.vertex_scalar_array()) <= reach).sum()
    return float(near / max(SAMPLES, samples.vertex_number()))


def run(row):
    contour_milliseconds, positions, triangles = contour(row)
    few_rounds, _ = remesh(positions, triangles, row["edge"], FEW_ROUNDS)
    all_rounds, meshes = remesh(positions, triangles, row["edge"], ROUNDS)
    mesh = meshes.current_mesh()
    vertices, faces = mesh.vertex_matrix(), mesh.face_matrix()
    open_edges, branching_edges = edges_by_triangles(faces)
    meshes.compute_selection_by_self_intersections_per_face()
    return {
        "seconds": (contour_milliseconds + all_rounds) / 1000,
        "fewRoundsSeconds": (contour_milliseconds + few_rounds) / 1000,
        "vertices": len(vertices),
        "openEdges": open_edges,
        "branchingEdges": branching_edges,
        "intersectingFaces": int(mesh.selected_face_number()),
        "smallestAngle": smallest_angle(vertices, faces),
        "recall": recall(meshes, positions, triangles, max(row["spacing"])),
    }


if __name__ == "__main__":
    print(json.dumps(run(json.loads(Path(sys.argv[1]).read_text()))))
