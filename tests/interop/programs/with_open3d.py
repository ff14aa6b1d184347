"""Open3D: PLY with all properties (through tensors), text of points."""

import numpy as np
import open3d as o3d
from open3d.core import Tensor

from case import TEXT, Case
from clouds import COLORS, Cloud, with_colors
from compare import Kept, same, within

o3d.utility.set_verbosity_level(o3d.utility.VerbosityLevel.Error)


def read(path) -> Cloud:
    """Reads positions, normals, colors and all other attributes."""
    point = o3d.t.io.read_point_cloud(str(path)).point
    columns = {name: point[name].numpy() for name in point}
    positions = columns.pop("positions").astype(np.float64)
    normals = columns.pop("normals", None)
    colors = with_colors(columns.pop("colors")) if "colors" in columns else {}
    return Cloud(positions, normals, colors | {name: of[:, 0] for name, of in columns.items()})


def write(cloud: Cloud, path, **options) -> None:
    """Writes all of a cloud that Open3D's tensors can be."""
    tensors = o3d.t.geometry.PointCloud(Tensor(cloud.positions))
    if cloud.normals is not None:
        tensors.point["normals"] = Tensor(cloud.normals)
    tensors.point["colors"] = Tensor(cloud.colors())
    for name, of in cloud.values.items():
        if name not in (*COLORS, "intensity"):
            tensors.point[name] = Tensor(np.ascontiguousarray(of)[:, None])
    if not o3d.t.io.write_point_cloud(str(path), tensors, **options):
        raise RuntimeError("Open3D did not write the file")


def read_text(path) -> Cloud:
    """Reads positions and normals."""
    cloud = o3d.io.read_point_cloud(str(path), format="xyzn")
    return Cloud(np.asarray(cloud.points), np.asarray(cloud.normals) if cloud.has_normals() else None)


def write_text(cloud: Cloud, path) -> None:
    """Writes positions and normals."""
    legacy = o3d.geometry.PointCloud(o3d.utility.Vector3dVector(cloud.positions))
    legacy.normals = o3d.utility.Vector3dVector(cloud.normals.astype(np.float64))
    by_its_name = path.with_suffix(".xyzn")
    if not o3d.io.write_point_cloud(str(by_its_name), legacy):
        raise RuntimeError("Open3D did not write the file")
    by_its_name.rename(path)


ATTRIBUTES = same((*COLORS, "classification", "gps_time", "range", "target"))

CASES = [
    Case(
        program="Open3D",
        format="PLY, little-endian",
        extension=".ply",
        read=read,
        write=write,
        reads=Kept(values=ATTRIBUTES, remark="reads no ushort"),
        writes=Kept(values=ATTRIBUTES),
        made=Kept(values=ATTRIBUTES),
    ),
    Case(
        program="Open3D",
        format="text, x y z nx ny nz",
        extension=".xyz",
        read=read_text,
        write=write_text,
        made=TEXT,
        only=(),
        writes=Kept(points=within(1e-10), normals=within(1e-7), remark="writes ten digits after the point"),
    ),
]
