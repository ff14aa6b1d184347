"""MeshLab: PLY and text."""

import numpy as np
import pymeshlab
from plyfile import PlyData, PlyElement

from case import OBJ, TEXT, Case
from clouds import COLORS, FACES, MESH, Cloud, with_colors, write_plain_ply
from compare import FLOAT, Kept, same, within


def read(path) -> Cloud:
    """Reads positions, normals and colors of all meshes of a file, where these stand; the rest would have to be named one by one."""
    meshes = pymeshlab.MeshSet()
    meshes.load_new_mesh(str(path))
    positions, normals, colors = [], [], []
    for mesh in meshes:
        place = mesh.transform_matrix()
        positions.append(mesh.vertex_matrix() @ place[:3, :3].T + place[:3, 3])
        normals.append(mesh.vertex_normal_matrix() @ place[:3, :3].T)
        if mesh.has_vertex_color():
            colors.append(mesh.vertex_color_matrix()[:, :3])
    values = with_colors(np.concatenate(colors)) if colors else {}
    return Cloud(np.concatenate(positions), np.concatenate(normals), values)


def write(cloud: Cloud, path) -> None:
    """Writes positions, normals and colors, from a plain PLY."""
    plain = path.with_suffix(".plain.ply")
    write_plain_ply(cloud, plain)
    meshes = pymeshlab.MeshSet()
    meshes.load_new_mesh(str(plain))
    options = {"save_vertex_normal": True, "save_vertex_color": True} if path.suffix == ".ply" else {}
    meshes.save_current_mesh(str(path), **options)


def write_mesh(cloud: Cloud, path) -> None:
    """Writes the mesh, from a PLY of plyfile: a mesh that is made of arrays gets normals of its own."""
    plain = path.with_suffix(".plain.ply")
    vertex = np.empty(len(cloud), [(name, "f4") for name in ("x", "y", "z", "nx", "ny", "nz")])
    for axis, name in enumerate("xyz"):
        vertex[name], vertex[f"n{name}"] = cloud.positions[:, axis], cloud.normals[:, axis]
    face = np.empty(len(FACES), [("vertex_indices", "i4", (3,))])
    face["vertex_indices"] = FACES
    PlyData([PlyElement.describe(vertex, "vertex"), PlyElement.describe(face, "face")]).write(plain)
    meshes = pymeshlab.MeshSet()
    meshes.load_new_mesh(str(plain))
    meshes.save_current_mesh(str(path), save_vertex_normal=True)


def faces_untouched(_theirs, ours) -> list[str]:
    """What differs between the faces of our file and those of the mesh."""
    meshes = pymeshlab.MeshSet()
    meshes.load_new_mesh(str(ours))
    return [] if np.array_equal(meshes.current_mesh().face_matrix(), FACES) else ["faces differ"]


HOLES = {"holes": "it gives places and normals of different rows"}


def from_shares(values: dict) -> dict:
    """Colors of shares of 1, as OBJ has them."""
    return {name: np.round(of * 255) for name, of in values.items()}


# One of 255 is lost where a share of 1 is cut off.
CUT = {name: within(1.0) for name in COLORS}

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
        format="PTS",
        extension=".pts",
        read=read,
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
        reads=Kept(
            normals=None, values=CUT, remark="gives no normals to vertices without faces, cuts shares of color off"
        ),
        writes=Kept(points=within(1e-15), values=same(COLORS)),
        made=OBJ,
        values_of=from_shares,
        without=HOLES,
    ),
    Case(
        program="pymeshlab",
        format="E57",
        extension=".e57",
        read=read,
        write=write,
        reads=Kept(values=same(COLORS), leaves_out_holes=True),
        writes=Kept(points=FLOAT, values=same(COLORS), leaves_out_holes=True, remark="writes floats"),
        made=Kept(values=same(COLORS)),
    ),
    *(
        Case(
            program="pymeshlab",
            format=f"{name}, mesh",
            extension=extension,
            clouds={"mesh": MESH},
            read=read,
            write=write_mesh,
            writes=Kept(points=within(1e-15), normals=within(1e-15)),
            is_made=False,
            untouched=("faces", faces_untouched),
        )
        for name, extension in (("PLY", ".ply"), ("OBJ", ".obj"))
    ),
]
