"""meshio: PLY with all columns."""

import meshio
import numpy as np

from case import OBJ, Case
from clouds import COLORS, NAMES, Cloud
from compare import Kept, same

# meshio fails on `ushort`, so its clouds have no intensity, and it takes `uchar` for signed.
GIVEN = tuple(name for name in NAMES if name != "intensity")
READ = tuple(name for name in GIVEN if name not in COLORS)


def read(path) -> Cloud:
    """Reads positions, normals and all else."""
    mesh = meshio.read(path)
    columns = dict(mesh.point_data)
    normals = np.column_stack([columns.pop(name) for name in ("nx", "ny", "nz")])
    return Cloud(np.asarray(mesh.points, np.float64), normals, columns)


def read_obj(path) -> Cloud:
    """Reads positions and normals."""
    mesh = meshio.read(path)
    return Cloud(np.asarray(mesh.points)[:, :3], mesh.point_data.get("obj:vn"))


def write(cloud: Cloud, path) -> None:
    """Writes positions, normals and all else."""
    columns = {name: cloud.normals[:, axis] for axis, name in enumerate(("nx", "ny", "nz"))}
    columns |= {name: cloud.values[name] for name in GIVEN}
    meshio.Mesh(cloud.positions, [], point_data=columns).write(path)


CASES = [
    Case(
        program="meshio",
        format="PLY, little-endian",
        extension=".ply",
        read=read,
        write=write,
        reads=Kept(values=same(READ), remark="fails on ushort, takes uchar for signed"),
        writes=Kept(values=same(GIVEN)),
        made=Kept(values=same(GIVEN)),
        only=GIVEN,
    ),
    Case(
        program="meshio",
        format="OBJ",
        extension=".obj",
        read=read_obj,
        made=OBJ,
        reads=Kept(remark="takes colors for coordinates, so without"),
        only=(),
    ),
]
