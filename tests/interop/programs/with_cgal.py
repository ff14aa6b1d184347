"""CGAL, with LASlib: PLY, text, LAS."""

import numpy as np
from CGAL.CGAL_Kernel import Point_3, Vector_3
from CGAL.CGAL_Point_set_3 import Point_set_3

from case import TEXT, Case
from clouds import Cloud
from compare import Kept, within


def read(path) -> Cloud:
    """Reads positions and normals."""
    points = Point_set_3()
    points.read(str(path))
    positions = np.array([[point.x(), point.y(), point.z()] for point in points.points()])
    normals = None
    if points.has_normal_map():
        normals = np.array([[normal.x(), normal.y(), normal.z()] for normal in points.normals()])
    return Cloud(positions, normals)


def write(cloud: Cloud, path) -> None:
    """Writes positions and normals."""
    points = Point_set_3()
    points.add_normal_map()
    for position, normal in zip(cloud.positions.tolist(), cloud.normals.tolist(), strict=True):
        points.insert(Point_3(*position), Vector_3(*normal))
    if not points.write(str(path)):
        raise RuntimeError("CGAL did not write the file")


def write_las(cloud: Cloud, path) -> None:
    """Writes the positions that there are."""
    write(cloud.finite(), path)


HOLES = {"holes": "it ends at the first nan"}

CASES = [
    Case(program="CGAL", format="PLY, little-endian", extension=".ply", read=read, write=write),
    Case(
        program="CGAL",
        format="text, x y z nx ny nz",
        extension=".xyz",
        read=read,
        write=write,
        made=TEXT,
        only=(),
        without=HOLES,
    ),
    Case(
        program="CGAL",
        format="LAS",
        extension=".las",
        read=read,
        write=write_las,
        reads=Kept(normals=None, remark="by LASlib, without normals"),
        writes=Kept(points=within(1e-6), normals=None, leaves_out_holes=True, remark="by LASlib, without normals"),
        made=Kept(points=within(0.0005), leaves_out_holes=True),
        without={"one point": "it writes a scale of 0, which is refused"},
    ),
]
