"""PCL, by the tools of Debian's pcl-tools: PLY, read into PCD and written from it."""

from case import Case, run
from clouds import COLORS, Cloud, write_plain_ply
from compare import Kept, same, within
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


def read_pcd(path) -> Cloud:
    """Has PCL read a PCD and write it in binary."""
    binary = path.with_suffix(".binary.pcd")
    run("pcl_convert_pcd_ascii_binary", path, binary, 1)
    return with_pypcd4.read(binary)


def write_pcd(cloud: Cloud, path, kind: int) -> None:
    """Has PCL write a PCD of a plain PLY: 0 as text, 1 in binary, 2 compressed."""
    plain, binary = path.with_suffix(".plain.ply"), path.with_suffix(".plain.pcd")
    write_plain_ply(cloud, plain)
    run("pcl_ply2pcd", "-format", 1, plain, binary)
    run("pcl_convert_pcd_ascii_binary", binary, path, kind)


TEXT = same((*COLORS, *VALUES)) | {"gps_time": within(500), "range": within(1e-5)}

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
    *(
        Case(
            program="PCL",
            format=f"PCD, {name}",
            extension=".pcd",
            read=read_pcd,
            write=lambda cloud, path, kind=kind: write_pcd(cloud, path, kind),
            reads=Kept(values=same((*COLORS, *VALUES))),
            writes=kept,
            made=Kept(values=same((*COLORS, *VALUES))),
        )
        for name, kind, kept in (
            ("text", 0, Kept(points=within(0.5), normals=within(1e-7), values=TEXT, remark="writes eight digits")),
            ("binary", 1, Kept(values=same((*COLORS, *VALUES)))),
            ("compressed", 2, Kept(values=same((*COLORS, *VALUES)))),
        )
    ),
]
