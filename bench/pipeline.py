"""Times what one would do without us to get a mesh with even triangles: VTK's flying edges, then MeshLab's isotropic remeshing.

    python3 bench/pipeline.py <job.json>

`npm run real -- FOLDER --pipeline` writes the job, runs this and puts it beside our own figures. pip install vtk pymeshlab numpy

- Native code with one thread each; ours is WebAssembly.
- The same voxels and the same value, and edges as long as ours are in the mean.
- MeshLab does ten rounds, its default. Three, as in CGAL's example, are timed, too; nothing else is measured of those.
- Reading files and converting arrays is not timed.
- Flying edges leaves the surface open where the object goes on beyond the border of the volume, and MeshLab's remeshing may open it
  elsewhere: edges with one triangle, or with more than two, are counted.
"""

import json
import os
import subprocess
import sys
from pathlib import Path
from time import perf_counter

from peers import ONE_THREAD

ROUNDS = 10
FEW_ROUNDS = 3
# Points of the contour from which the distance to the result is measured.
SAMPLES = 200_000


def timed(work):
    started = perf_counter()
    value = work()
    return perf_counter() - started, value


def contour(row):
    """The iso-surface: seconds, positions and triangles."""
    import numpy
    from vtkmodules.util.numpy_support import numpy_to_vtk, vtk_to_numpy
    from vtkmodules.vtkCommonDataModel import vtkImageData
    from vtkmodules.vtkFiltersCore import vtkFlyingEdges3D

    image = vtkImageData()
    image.SetDimensions(row["dims"])
    image.SetSpacing(row["spacing"])
    image.GetPointData().SetScalars(numpy_to_vtk(numpy.fromfile(row["voxels"], numpy.float32)))
    edges = vtkFlyingEdges3D()
    edges.SetInputData(image)
    edges.SetValue(0, row["iso"])
    edges.ComputeNormalsOff()
    edges.ComputeGradientsOff()
    edges.ComputeScalarsOff()
    seconds, _ = timed(edges.Update)
    found = edges.GetOutput()
    triangles = vtk_to_numpy(found.GetPolys().GetConnectivityArray()).reshape(-1, 3)
    return seconds, vtk_to_numpy(found.GetPoints().GetData()).astype(float), triangles


def remesh(positions, triangles, edge, rounds):
    import pymeshlab

    meshes = pymeshlab.MeshSet()
    meshes.add_mesh(pymeshlab.Mesh(positions, triangles))
    aim = pymeshlab.PureValue(edge)
    seconds, _ = timed(lambda: meshes.meshing_isotropic_explicit_remeshing(iterations=rounds, targetlen=aim))
    return seconds, meshes


def edges_by_triangles(triangles):
    """How many edges have one triangle, and how many have more than two."""
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
    """The share of the contour's area within `reach` of the result."""
    import pymeshlab

    result = meshes.current_mesh_id()
    meshes.add_mesh(pymeshlab.Mesh(positions, triangles))
    found = meshes.get_hausdorff_distance(
        sampledmesh=meshes.current_mesh_id(),
        targetmesh=result,
        savesample=True,
        samplevert=False,
        sampleface=True,
        samplenum=SAMPLES,
        maxdist=pymeshlab.PureValue(2 * reach),
    )
    # What is further away than maxdist is no sample.
    samples = next(m for m in meshes if m.label() == "Hausdorff Closest Points" or m.label() == "Hausdorff Sample Point")
    near = (abs(samples.vertex_scalar_array()) <= reach).sum()
    return float(near / max(SAMPLES, found["n_samples"]))


def run(row):
    contour_seconds, positions, triangles = contour(row)
    few, _ = remesh(positions, triangles, row["edge"], FEW_ROUNDS)
    seconds, meshes = remesh(positions, triangles, row["edge"], ROUNDS)
    mesh = meshes.current_mesh()
    vertices, faces = mesh.vertex_matrix(), mesh.face_matrix()
    open_edges, branching_edges = edges_by_triangles(faces)
    meshes.compute_selection_by_self_intersections_per_face()
    return {
        "contourSeconds": contour_seconds,
        "fewRoundsSeconds": contour_seconds + few,
        "seconds": contour_seconds + seconds,
        "vertices": len(vertices),
        "openEdges": open_edges,
        "branchingEdges": branching_edges,
        "crossingFaces": int(meshes.current_mesh().selected_face_number()),
        "smallestAngle": smallest_angle(vertices, faces),
        "recall": recall(meshes, positions, triangles, max(row["spacing"])),
    }


def main(path):
    # Numbers of threads are read when a package is loaded.
    if any(os.environ.get(name) != value for name, value in ONE_THREAD.items()):
        sys.exit(subprocess.run([sys.executable, __file__, path], env={**os.environ, **ONE_THREAD}).returncode)
    print(json.dumps(run(json.loads(Path(path).read_text()))))


if __name__ == "__main__":
    main(sys.argv[1])
