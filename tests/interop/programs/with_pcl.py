"""PCL, by the tools of Debian's pcl-tools: PLY, read into PCD and written from it."""

from case import Case, run
from clouds import COLORS, Cloud, write_plain_ply
from compare import Kept, same
from programs import with_pypcd4

# The tools keep every field of a PLY.
VALUES = ("intensity", "classification", "gps_time", "range", "target")


def read_ply(path) -> Cloud:
    """Has PCL read a PLY."""
    pcd = path.with_suffix(".pcd")
    run("pcl_ply2pcd", "-format", "1", path, pcd)
    return with_pypcd4.read(pcd)


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
