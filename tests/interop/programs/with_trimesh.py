"""trimesh: PLY."""

import numpy as np
import trimesh

from case import Case
from clouds import COLORS, NAMES, Cloud, with_colors
from compare import FLOAT, Kept, same

ALL = same(NAMES)


def read(path) -> Cloud:
    """Reads positions; normals, colors and all else from what trimesh keeps of the file."""
    cloud = trimesh.load(path, process=False)
    columns = cloud.metadata["_ply_raw"]["vertex"]["data"]
    values = {name: columns[name].ravel() for name in columns.dtype.names if name not in ("x", "y", "z", "nx", "ny", "nz")}
    normals = np.column_stack([columns[name].ravel() for name in ("nx", "ny", "nz")])
    return Cloud(np.asarray(cloud.vertices), normals, values | with_colors(np.asarray(cloud.colors)[:, :3]))


def read_obj(path) -> Cloud:
    """Reads positions and colors."""
    cloud = trimesh.load(path, process=False)
    return Cloud(np.asarray(cloud.vertices), None, with_colors(np.asarray(cloud.colors)[:, :3]) if len(cloud.colors) else {})


def write(cloud: Cloud, path) -> None:
    """Writes positions and colors."""
    trimesh.PointCloud(cloud.positions, colors=cloud.colors()).export(path)


CASES = [
    Case(
        program="trimesh",
        format="PLY, little-endian",
        extension=".ply",
        read=read,
        reads=Kept(values=ALL),
        made=Kept(values=ALL),
    ),
    Case(
        program="trimesh",
        format="PLY, little-endian",
        extension=".ply",
        write=write,
        writes=Kept(points=FLOAT, normals=None, remark="writes clouds as float, without normals"),
    ),
    Case(
        program="trimesh",
        format="OBJ",
        extension=".obj",
        read=read_obj,
        reads=Kept(normals=None, values=same(COLORS), remark="gives no normals to vertices without faces"),
        made=Kept(values=same(COLORS), leaves_out_holes=True),
    ),
]
