"""PCL, by the tools of Debian's pcl-tools: PLY, read into PCD and written from it."""

import numpy as np
from pypcd4 import PointCloud

from case import Case, run
from clouds import COLORS, Cloud, write_plain_ply
from compare import Kept, same

# The tools keep every field of a PLY.
VALUES = ("intensity", "classification", "gps_time", "range", "target")


def read_pcd(path) -> Cloud:
    """Reads a PCD with pypcd4."""
    cloud = PointCloud.from_path(path)
    columns = {name: cloud.pc_data[name] for name in cloud.fields}
    take = lambda *chosen: np.column_stack([columns.pop(name) for name in chosen])
    positions = take("x", "y", "z").astype(np.float64)
    normals = take("normal_x", "normal_y", "normal_z") if "normal_x" in columns else None
    if "rgb" in columns:
        packed = columns.pop("rgb").view(np.uint32)
        columns |= {name: (packed >> shift & 255).astype(np.uint8) for name, shift in zip(COLORS, (16, 8, 0))}
    return Cloud(positions, normals, columns)


def read_ply(path) -> Cloud:
    """Has PCL read a PLY."""
    pcd = path.with_suffix(".pcd")
    run("pcl_ply2pcd", "-format", "1", path, pcd)
    return read_pcd(pcd)


def write_ply(cloud: Cloud, path) -> None:
    """Has PCL write a PLY of what it read from a plain one."""
    plain, pcd = path.with_suffix(".plain.ply"), path.with_suffix(".pcd")
    write_plain_ply(cloud, plain)
    run("pcl_ply2pcd", "-format", "1", plain, pcd)
    run("pcl_pcd2ply", "-format", "1", "-use_camera", "0", pcd, path)


CASES = [
    Case(
        program="PCL",
        format="PLY, little-endian",
        extension=".ply",
        read=read_ply,
        write=write_ply,
        reads=Kept(values=same((*COLORS, *VALUES))),
        writes=Kept(values=same((*COLORS, *VALUES))),
        made=Kept(values=same((*COLORS, *VALUES))),
    ),
]
