"""trimesh: PLY."""

import numpy as np
import trimesh

from case import OBJ, Case
from clouds import COLORS, Cloud, of_columns, with_colors
from compare import FLOAT, SAME, Kept, same


def read(path) -> Cloud:
    """Reads positions; normals, colors and all else from what trimesh keeps of the file."""
    cloud = trimesh.load(path, process=False)
    columns = cloud.metadata["_ply_raw"]["vertex"]["data"]
    raw = of_columns({name: columns[name].ravel() for name in columns.dtype.names})
    values = raw.values | with_colors(np.asarray(cloud.colors)[:, :3])
    return Cloud(np.asarray(cloud.vertices), raw.normals, values)


def read_obj(path) -> Cloud:
    """Reads positions and colors."""
    cloud = trimesh.load(path, process=False)
    colors = with_colors(np.asarray(cloud.colors)[:, :3]) if len(cloud.colors) else {}
    return Cloud(np.asarray(cloud.vertices), None, colors)


def write(cloud: Cloud, path) -> None:
    """Writes positions and colors."""
    trimesh.PointCloud(cloud.positions, colors=cloud.colors()).export(path)


CASES = [
    Case(
        program="trimesh",
        format="PLY, little-endian",
        extension=".ply",
        read=read,
        reads=Kept(others=SAME),
        made=Kept(others=SAME),
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
        made=OBJ,
    ),
]
