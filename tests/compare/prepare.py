"""Makes the input of each program for a scene: a Triptych data set, an array for VTK, a grid for
vdb_render. The work folder keeps them until the volume or the transfer function is newer."""
import json
import os
import shutil
import subprocess

import numpy as np

import functions
import scenes
import volumes

# vdb_render skips densities below 0.005. Our density 1 is 1/50 of an extinction of 1 per voxel.
DENSITY_SCALE = 50
LEAF_SLICES = 64


def _stale(path, sources):
    return not os.path.exists(path) or any(os.path.getmtime(source) > os.path.getmtime(path)
                                           for source in sources)


class Prepared:
    """The files of one scene. `info` is the output of `triptych info --json` for its data set."""

    def __init__(self, scene, volume, work, triptych):
        self.scene, self.volume, self.work = scene, volume, work
        self.triptych = triptych
        self.function_path = scenes.function_path(scene)
        self.function = functions.read(self.function_path)
        self.dataset = self._path(".trip")
        self._brick()
        self.info = json.loads(subprocess.check_output(
            [triptych, "info", self.dataset, "--json"]))

    def _path(self, ending):
        return os.path.join(self.work, self.scene.name + ending)

    def _brick(self):
        if _stale(os.path.join(self.dataset, "index.trip"), [self.volume, self.function_path]):
            command = [self.triptych, "brick", self.volume, "-o", self.dataset, "--tf",
                       self.function_path, "--force", "--quiet"]
            subprocess.run(command, check=True)

    def array(self):
        path = self._path(".npy")
        if _stale(path, [self.volume]):
            values = volumes.read(self.volume, self.info)
            np.save(path + ".partial.npy", values)
            os.replace(path + ".partial.npy", path)
        return path

    def voxels_are_cubes(self):
        lengths = np.linalg.norm(np.array(self.info["index_to_world"])[:, :3], axis=0)
        return bool(np.ptp(lengths) < 1e-4 * lengths.max())

    def grid(self):
        """Writes extinction per voxel as density, so vdb_render shows the opacity of the others."""
        path = self._path(".vdb")
        if _stale(path, [self.volume, self.function_path]):
            values = np.load(self.array(), mmap_mode="r")
            _write_grid(path, values, self.function, self.info["index_to_world"])
        return path

    def remove(self):
        for ending in (".npy", ".vdb"):
            if os.path.exists(self._path(ending)):
                os.remove(self._path(ending))
        shutil.rmtree(self.dataset, ignore_errors=True)


def _write_grid(path, values, function, affine):
    import pyopenvdb as vdb
    grid = vdb.FloatGrid(0.0)
    grid.name = "density"
    grid.gridClass = vdb.GridClass.FOG_VOLUME
    for first in range(0, values.shape[0], LEAF_SLICES):
        tau = functions.extinction(function, values[first:first + LEAF_SLICES]) * DENSITY_SCALE
        grid.copyFromArray(np.ascontiguousarray(tau.transpose(2, 1, 0)), ijk=(0, 0, first))
    rows = np.vstack([np.array(affine), [0, 0, 0, 1]])
    grid.transform = vdb.createLinearTransform(rows.T.tolist())  # OpenVDB's vectors are rows
    vdb.write(path, grids=[grid])
