"""Times other software on the data of our own benches, and prints the results as JSON.

    python3 bench/peers.py <job.json>

`npm run bench -- peers` writes the job, runs this script and prints our own figures of the same run beside its results. It installs
nothing: packages that are missing are skipped with a message. To install all of them:

    pip install vtk scikit-image SimpleITK scipy pymeshlab cgal numpy

Limits of the comparison:

- All of these packages are native code. Ours is WebAssembly, unless it is said to be native.
- Ours has one thread. So have these: VTK, ITK, OpenMP and BLAS are limited to one thread before they start.
- Reading files and converting arrays is not timed, on either side.
- Flying edges and marching cubes use the same voxels and the same iso value. Those of scikit-image compute normals as well.
- A level set is not a mesh, and may stop farther from the object: it is done when the root mean square of its changes falls
  below ITK's own default. It starts 5 mm around the object; our model starts outside the head. Extracting a surface from its result
  is not timed, and it runs only once.
- SciPy solves exactly, with a dense matrix; ours iterates to a residual. With neighbors= it does not solve one system but a small
  one for each evaluation point, and the result is discontinuous: here it is evaluated only at the vertices of our surface.
- The surfaces of a label map are settled: ours after all of their steps, VTK's after its default of 16 iterations. The triangles between two
  labels are counted for both. MeshLab and VTK do not look for intersections when they smooth and decimate; ours avoids them. Decimation
  keeps the topology in all of them.
- The two remeshers do three rounds, as in CGAL's example (MeshLab's default of ten takes three times as long), then stop, whether
  the edges are in bounds or not; ours continues until they are. Neither checks for self-intersections. Reprojection and flips are
  on in all of them; MeshLab keeps edges that it considers sharp.
"""

import gzip
import json
import os
import struct
import subprocess
import sys
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from time import perf_counter

ONE_THREAD = {
    "OMP_NUM_THREADS": "1",
    "OPENBLAS_NUM_THREADS": "1",
    "MKL_NUM_THREADS": "1",
    "ITK_GLOBAL_DEFAULT_NUMBER_OF_THREADS": "1",
    "VTK_SMP_BACKEND_IN_USE": "Sequential",
}
# Distance from the object at which the level set starts, in millimetres.
AROUND = 5
LEVEL_SET_ITERATIONS = 500
REMESHING_ROUNDS = 3
NEIGHBORS = 50


def best(repeats, work):
    """Returns the shortest time of several runs in milliseconds, and the result of the last one."""
    least = float("inf")
    for _ in range(repeats):
        started = perf_counter()
        value = work()
        least = min(least, 1000 * (perf_counter() - started))
    return least, value


def read_volume(path):
    """Returns the voxels of a gzipped NIfTI-1 file of bytes as a numpy array, z first, and their spacing."""
    import numpy

    data = gzip.decompress(Path(path).read_bytes())
    x, y, z = struct.unpack_from("<3h", data, 42)
    spacing = struct.unpack_from("<3f", data, 80)
    (start,) = struct.unpack_from("<f", data, 108)
    if struct.unpack_from("<h", data, 70) != (2,):
        raise ValueError(f"{path} holds other things than bytes")
    return numpy.frombuffer(data, numpy.uint8, x * y * z, int(start)).reshape(z, y, x), spacing


def flying_edges(voxels, spacing, iso):
    """Returns a function that extracts the iso-surface of an array of voxels, z first, with VTK."""
    from vtkmodules.util.numpy_support import numpy_to_vtk
    from vtkmodules.vtkCommonDataModel import vtkImageData
    from vtkmodules.vtkFiltersCore import vtkFlyingEdges3D

    image = vtkImageData()
    image.SetDimensions(*reversed(voxels.shape))
    image.SetSpacing(spacing)
    image.GetPointData().SetScalars(numpy_to_vtk(voxels.ravel()))

    def surface():
        edges = vtkFlyingEdges3D()
        edges.SetInputData(image)
        edges.SetValue(0, iso)
        edges.ComputeNormalsOff()
        edges.ComputeGradientsOff()
        edges.ComputeScalarsOff()
        edges.Update()
        return edges.GetOutput()

    return surface


def vtk(job):
    if "labels" in job:
        yield from vtk_tools(job)
        return
    milliseconds, found = best(job["cheapRepeats"], flying_edges(*read_volume(job["scan"]), job["iso"]))
    counts = {"vertices": found.GetNumberOfPoints(), "triangles": found.GetNumberOfPolys()}
    yield {"task": "cubes", "what": "flying edges", "milliseconds": milliseconds, **counts}


def vtk_tools(job):
    from vtkmodules.util.numpy_support import numpy_to_vtk, numpy_to_vtkIdTypeArray, vtk_to_numpy
    from vtkmodules.vtkCommonCore import vtkPoints
    from vtkmodules.vtkCommonDataModel import vtkCellArray, vtkImageData, vtkPolyData
    from vtkmodules.vtkFiltersCore import vtkQuadricDecimation, vtkSurfaceNets3D

    import numpy

    side = job["labels"]["side"]
    labels = numpy.fromfile(job["labels"]["file"], numpy.uint8)
    image = vtkImageData()
    image.SetDimensions(side, side, side)
    image.GetPointData().SetScalars(numpy_to_vtk(labels))

    def nets():
        surfaces = vtkSurfaceNets3D()
        surfaces.SetInputData(image)
        surfaces.GenerateLabels(int(labels.max()), 1, int(labels.max()))
        surfaces.Update()
        return surfaces.GetOutput()

    milliseconds, found = best(job["repeats"], nets)
    places = vtk_to_numpy(found.GetPoints().GetData())
    triangles = vtk_to_numpy(found.GetPolys().GetConnectivityArray()).reshape(-1, 3)
    beside = vtk_to_numpy(found.GetCellData().GetArray("BoundaryLabels"))
    parts, errors = [], []
    for label in range(1, int(labels.max()) + 1):
        own = surface_of_label(triangles, beside, label)
        volume = abs(numpy.linalg.det(places[own].astype(float)).sum()) / 6
        errors.append(volume / numpy.count_nonzero(labels == label) - 1)
        used, own = numpy.unique(own, return_inverse=True)
        parts.append(written(f"{job['labels']['file']}.{label}", places[used], own.reshape(-1, 3)))
    # As ours are counted: a triangle between two labels belongs to both.
    counts = {"triangles": int(numpy.count_nonzero(beside > 0))}
    error = max(errors, key=abs)
    yield {"task": "labels", "what": "surface nets", "milliseconds": milliseconds, **counts, "volumeError": float(error), "parts": parts}

    positions, indices = read_mesh(job["mesh"])
    mesh = vtkPolyData()
    points, faces = vtkPoints(), vtkCellArray()
    points.SetData(numpy_to_vtk(positions))
    faces.SetData(3, numpy_to_vtkIdTypeArray(indices.ravel().astype(numpy.int64)))
    mesh.SetPoints(points)
    mesh.SetPolys(faces)

    def decimate():
        fewer = vtkQuadricDecimation()
        fewer.SetInputData(mesh)
        fewer.SetTargetReduction(1 - job["kept"])
        fewer.VolumePreservationOn()
        fewer.Update()
        return fewer.GetOutput()

    milliseconds, found = best(job["repeats"], decimate)
    kept = vtk_to_numpy(found.GetPolys().GetConnectivityArray()).reshape(-1, 3)
    places = vtk_to_numpy(found.GetPoints().GetData())
    yield tool("vtk", "decimate", "quadric decimation", job, milliseconds, places, kept)


def surface_of_label(triangles, beside, label):
    """Returns the triangles of a label, all turned the same way, from those between the two labels `beside` each."""
    import numpy

    return numpy.concatenate([triangles[beside[:, 0] == label], triangles[beside[:, 1] == label][:, ::-1]])


def read_mesh(mesh):
    import numpy

    positions = numpy.fromfile(mesh["positions"], numpy.float32).reshape(-1, 3)
    return positions, numpy.fromfile(mesh["indices"], numpy.uint32).reshape(-1, 3)


def scikit_image(job):
    from skimage.measure import marching_cubes

    voxels, spacing = read_volume(job["scan"])
    work = lambda: marching_cubes(voxels, job["iso"], spacing=spacing[::-1])
    milliseconds, (vertices, triangles, *_) = best(job["cheapRepeats"], work)
    counts = {"vertices": len(vertices), "triangles": len(triangles)}
    yield {"task": "cubes", "what": "marching cubes, with normals", "milliseconds": milliseconds, **counts}


def simple_itk(job):
    import SimpleITK as sitk

    sitk.ProcessObject.SetGlobalDefaultNumberOfThreads(1)
    scan = sitk.ReadImage(job["scan"])
    # The speed keeps growing above the iso value, so that the brightest bone is not outside again.
    level_set = sitk.ThresholdSegmentationLevelSetImageFilter()
    level_set.SetLowerThreshold(job["iso"])
    level_set.SetUpperThreshold(job["iso"] + 2 * (255 - job["iso"]))
    level_set.SetNumberOfIterations(LEVEL_SET_ITERATIONS)

    def segment():
        bone = sitk.BinaryThreshold(scan, job["iso"], 255)
        distance = sitk.SignedMaurerDistanceMap(bone, squaredDistance=False, useImageSpacing=True)
        return level_set.Execute(distance - AROUND, sitk.Cast(scan, sitk.sitkFloat32))

    milliseconds, found = best(1, segment)
    # Negative inside, as in the distance map that it started from.
    inside = sitk.GetArrayViewFromImage(found) < 0
    x, y, z = scan.GetSpacing()
    ended = {
        "iterations": level_set.GetElapsedIterations(),
        "converged": level_set.GetElapsedIterations() < LEVEL_SET_ITERATIONS,
        "volume": float(inside.sum() * x * y * z),
    }
    yield {"task": "model", "what": "threshold level set", "milliseconds": milliseconds, **ended}


def scipy(job):
    import numpy
    from scipy.interpolate import RBFInterpolator

    read = lambda name: numpy.fromfile(name, numpy.float32).reshape(-1, 3).astype(float)

    def constraints(of):
        points, exterior = read(of["points"]), read(of["exterior"])
        return numpy.concatenate([points, exterior]), numpy.repeat([0.0, -1.0], [len(points), len(exterior)])

    places, values = constraints(job["few"])
    milliseconds, _ = best(job["repeats"], lambda: RBFInterpolator(places, values, kernel="cubic"))
    yield {"task": "solve few", "what": "all pairs, r³", "milliseconds": milliseconds}

    places, values = constraints(job["many"])
    vertices = read(job["many"]["vertices"])
    matrix = f"its matrix of all pairs takes {8e-9 * len(places) ** 2:.1f} GB, and minutes"
    yield {"task": "solve many", "absent": f"not tried: {matrix}"}

    local = lambda: RBFInterpolator(places, values, kernel="cubic", neighbors=NEIGHBORS)(vertices)
    milliseconds, _ = best(job["repeats"], local)
    what = f"{NEIGHBORS} neighbours, values at the vertices alone"
    yield {"task": "surface many", "what": what, "milliseconds": milliseconds, "vertices": len(vertices)}


def pymeshlab(job):
    import pymeshlab as meshlab

    if "labels" in job:
        yield from meshlab_tools(job)
        return
    for mesh in job["meshes"]:
        # A new set for each run, because the filter changes its mesh.
        sets = [meshlab.MeshSet() for _ in range(job["repeats"])]
        for one in sets:
            one.load_new_mesh(mesh["file"])
        aim = meshlab.PureValue(mesh["edge"])
        run = iter(sets)

        def remesh():
            one = next(run)
            one.meshing_isotropic_explicit_remeshing(iterations=REMESHING_ROUNDS, targetlen=aim)
            return one

        milliseconds, found = best(job["repeats"], remesh)
        surface = found.current_mesh()
        yield remeshed("pymeshlab", mesh, milliseconds, surface.vertex_matrix(), surface.face_matrix())


def meshlab_tools(job):
    import pymeshlab as meshlab

    positions, indices = read_mesh(job["mesh"])
    target = round(job["kept"] * len(indices))
    tasks = {
        "smooth": ("Taubin", lambda one: one.apply_coord_taubin_smoothing(stepsmoothnum=job["iterations"])),
        "decimate": (
            "quadric edge collapse",
            lambda one: one.meshing_decimation_quadric_edge_collapse(targetfacenum=target, preservetopology=True),
        ),
    }
    for task, (what, work) in tasks.items():
        # A new set for each run, because the filters change their mesh.
        sets = [meshlab.MeshSet() for _ in range(job["repeats"])]
        for one in sets:
            one.add_mesh(meshlab.Mesh(positions, indices))
        run = iter(sets)

        def filtered():
            one = next(run)
            work(one)
            return one

        milliseconds, found = best(job["repeats"], filtered)
        surface = found.current_mesh()
        yield tool("pymeshlab", task, what, job, milliseconds, surface.vertex_matrix(), surface.face_matrix())


def tool(package, task, what, job, milliseconds, positions, triangles):
    """Returns the result of a tool, and writes its mesh to files for the measurements of its quality."""
    files = written(f"{job['mesh']['positions']}.{package}-{task}", positions, triangles)
    return {"task": task, "what": what, "milliseconds": milliseconds, "triangles": len(triangles), "files": files}


def cgal(job):
    from CGAL.CGAL_Polygon_mesh_processing import isotropic_remeshing
    from CGAL.CGAL_Polyhedron_3 import Polyhedron_3

    for mesh in job["meshes"]:
        inputs = [Polyhedron_3(mesh["file"]) for _ in range(job["repeats"])]
        run = iter([(one, list(one.facets())) for one in inputs])

        def remesh():
            one, facets = next(run)
            # The rounds must be given: without them these bindings do next to nothing.
            isotropic_remeshing(facets, mesh["edge"], one, REMESHING_ROUNDS)
            return one

        milliseconds, found = best(job["repeats"], remesh)
        yield remeshed("cgal", mesh, milliseconds, *arrays_of(found))


def arrays_of(polyhedron):
    """Returns positions and triangles; CGAL's own files have five digits only."""
    positions = []
    for index, vertex in enumerate(polyhedron.vertices()):
        vertex.set_id(index)
        point = vertex.point()
        positions.append((point.x(), point.y(), point.z()))
    first = [facet.halfedge() for facet in polyhedron.facets()]
    triangles = [[at.vertex().id() for at in (one, one.next(), one.next().next())] for one in first]
    return positions, triangles


def remeshed(package, mesh, milliseconds, positions, triangles):
    """Returns the result of remeshing, and writes its mesh to files for the measurements of its quality."""
    files = written(f"{mesh['file']}.{package}-{mesh['factor']}", positions, triangles)
    counts = {"vertices": len(positions), "triangles": len(triangles)}
    what = f"{REMESHING_ROUNDS} rounds"
    return {"task": mesh["task"], "what": what, "milliseconds": milliseconds, **counts, "files": files}


def written(name, positions, triangles):
    """Writes a mesh, and returns its files."""
    import numpy

    files = {"positions": f"{name}.f32", "indices": f"{name}.u32"}
    numpy.asarray(positions, numpy.float32).tofile(files["positions"])
    numpy.asarray(triangles, numpy.uint32).tofile(files["indices"])
    return files


PEERS = {
    "vtk": vtk,
    "scikit-image": scikit_image,
    "SimpleITK": simple_itk,
    "scipy": scipy,
    "pymeshlab": pymeshlab,
    "cgal": cgal,
}


def measure(package, job):
    """Returns the results of one package. If it is missing or fails, the last result says so and earlier ones are kept."""
    results = []
    try:
        about = {"package": package, "version": version(package)}
        for result in PEERS[package](job):
            results.append({**about, **result})
    except PackageNotFoundError:
        results.append({"package": package, "absent": "not installed"})
    except Exception as error:
        results.append({"package": package, "absent": f"failed: {error}"})
    return results


def in_its_own_process(package, job):
    """Measures a package in a separate process, so that packages share no memory or threads and a crash loses only one."""
    command = [sys.executable, __file__, job, package]
    done = subprocess.run(command, env={**os.environ, **ONE_THREAD}, capture_output=True, text=True)
    # Some packages print lines as well; the result is the last line.
    printed = done.stdout.strip().splitlines()
    if done.returncode == 0 and printed:
        return json.loads(printed[-1])
    return [{"package": package, "absent": f"crashed, with code {done.returncode}"}]


def main(job, package=None):
    if package:
        results = measure(package, json.loads(Path(job).read_text()))
    else:
        names = json.loads(Path(job).read_text()).get("packages", PEERS)
        results = [result for name in names for result in in_its_own_process(name, job)]
    print(json.dumps(results))


if __name__ == "__main__":
    main(*sys.argv[1:])
