"""trimesh: PLY."""

import numpy as np
import trimesh

from case import OBJ, Case
from clouds import COLORS, FACES, MESH, Cloud, of_columns, with_colors
from compare import FLOAT, SAME, Kept, same, within


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


def read_mesh(path) -> Cloud:
    """Reads the vertices of a mesh and their normals."""
    mesh = trimesh.load(path, process=False)
    return Cloud(np.asarray(mesh.vertices), np.asarray(mesh.vertex_normals))


def write_mesh(cloud: Cloud, path) -> None:
    """Writes the mesh."""
    mesh = trimesh.Trimesh(cloud.positions, FACES, vertex_normals=cloud.normals, process=False)
    options = {"include_normals": True} if path.suffix == ".obj" else {"vertex_normal": True}
    mesh.export(path, **options)


def faces_untouched(_theirs, ours) -> list[str]:
    """What differs between the faces of our file and those of the mesh."""
    return [] if np.array_equal(trimesh.load(ours, process=False).faces, FACES) else ["faces differ"]


EIGHT = within(1e-8)

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
    *(
        Case(
            program="trimesh",
            format=f"{name}, mesh",
            extension=extension,
            clouds={"mesh": MESH},
            read=read_mesh,
            write=write_mesh,
            reads=kept,
            writes=kept,
            is_made=False,
            untouched=("faces", faces_untouched),
        )
        for name, extension, kept in (
            ("PLY", ".ply", Kept()),
            ("OBJ", ".obj", Kept(points=EIGHT, normals=EIGHT, remark="writes eight digits after the point")),
        )
    ),
]
