"""MeshLab: PLY and text."""

import pymeshlab

from case import TEXT, Case
from clouds import COLORS, Cloud, with_colors, write_plain_ply
from compare import Kept, same, within


def read(path) -> Cloud:
    """Reads positions, normals and colors; the rest would have to be named one by one."""
    meshes = pymeshlab.MeshSet()
    meshes.load_new_mesh(str(path))
    mesh = meshes.current_mesh()
    colors = with_colors(mesh.vertex_color_matrix()[:, :3]) if mesh.has_vertex_color() else {}
    return Cloud(mesh.vertex_matrix(), mesh.vertex_normal_matrix(), colors)


def write(cloud: Cloud, path) -> None:
    """Writes positions, normals and colors, from a plain PLY."""
    plain = path.with_suffix(".plain.ply")
    write_plain_ply(cloud, plain)
    meshes = pymeshlab.MeshSet()
    meshes.load_new_mesh(str(plain))
    options = {"save_vertex_normal": True, "save_vertex_color": True} if path.suffix == ".ply" else {}
    meshes.save_current_mesh(str(path), **options)


HOLES = {"holes": "it gives places and normals of different rows"}

# As shares of 1, with six digits.
COLORS_OF_OBJ = same(COLORS)

CASES = [
    Case(
        program="pymeshlab",
        format="PLY, little-endian",
        extension=".ply",
        read=read,
        write=write,
        reads=Kept(values=same(COLORS)),
        writes=Kept(values=same(COLORS)),
        made=Kept(values=same(COLORS)),
        without=HOLES,
    ),
    Case(
        program="pymeshlab",
        format="text, x y z nx ny nz",
        extension=".xyz",
        read=read,
        write=write,
        writes=Kept(points=within(1e-6), normals=within(1e-6), remark="writes six digits after the point"),
        made=TEXT,
        only=(),
        without=HOLES,
    ),
    Case(
        program="pymeshlab",
        format="OBJ",
        extension=".obj",
        read=read,
        write=write,
        reads=Kept(normals=None, values=COLORS_OF_OBJ, remark="gives no normals to vertices without faces"),
        writes=Kept(values=COLORS_OF_OBJ),
        made=Kept(values=COLORS_OF_OBJ, leaves_out_holes=True),
        without=HOLES,
    ),
]
