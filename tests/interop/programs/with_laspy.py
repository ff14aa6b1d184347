"""laspy, with lazrs and with LASzip behind it: LAS and LAZ."""

import laspy
import numpy as np

from case import Case
from clouds import COLORS, NAMES, Cloud
from compare import Kept, same, within

# What points of LAS have; the rest goes to extra bytes.
OWN = ("intensity", "classification", "gps_time")
EXTRA = ("range", "target")
NORMAL = ("NormalX", "NormalY", "NormalZ")


def read(path, backend=None) -> Cloud:
    """Reads coordinates, normals of extra bytes, and all values of the clouds."""
    las = laspy.read(path, laz_backend=backend)
    names = set(las.point_format.dimension_names)
    normals = np.column_stack([np.asarray(las[name]) for name in NORMAL]) if NORMAL[0] in names else None
    values = {name: np.asarray(las[name]) for name in (*COLORS, *OWN, *EXTRA) if name in names}
    return Cloud(np.column_stack([las.x, las.y, las.z]), normals, values)


def write(cloud: Cloud, path, version="1.4", point_format=7, backend=None, with_normals=True) -> None:
    """Writes thousandths, 16-bit colors, and what LAS has no place for in extra bytes."""
    cloud = cloud.finite()
    header = laspy.LasHeader(version=version, point_format=point_format)
    header.scales, header.offsets = [0.001] * 3, np.floor(cloud.positions.min(axis=0))
    extra = dict.fromkeys(NORMAL, np.float32) if with_normals else {}
    extra |= {name: cloud.values[name].dtype for name in EXTRA}
    header.add_extra_dims([laspy.ExtraBytesParams(name, kind) for name, kind in extra.items()])
    las = laspy.LasData(header)
    las.x, las.y, las.z = cloud.positions.T
    for axis, name in enumerate(NORMAL if with_normals else ()):
        las[name] = cloud.normals[:, axis]
    for name in (*COLORS, *OWN, *EXTRA):
        las[name] = cloud.values[name]
    las.write(path, laz_backend=backend)


# Coordinates are whole numbers of steps.
STEPS = within(0.0005)
THEIRS = Kept(points=STEPS, values=same(NAMES), leaves_out_holes=True)
READS = Kept(values=same(NAMES))


def _case(program: str, name: str, extension: str, version: str, point_format: int, backend=None) -> Case:
    return Case(
        program=program,
        format=name,
        extension=extension,
        read=lambda path: read(path, backend),
        write=lambda cloud, path: write(cloud, path, version, point_format, backend),
        reads=READS,
        writes=THEIRS,
        made=THEIRS,
    )


CASES = [
    _case("laspy", "LAS 1.2, format 3", ".las", "1.2", 3),
    _case("laspy", "LAS 1.4, format 7", ".las", "1.4", 7),
    _case("lazrs", "LAZ 1.2, format 3", ".laz", "1.2", 3, laspy.LazBackend.LazrsParallel),
    _case("lazrs", "LAZ 1.4, format 7", ".laz", "1.4", 7, laspy.LazBackend.LazrsParallel),
    _case("laszip", "LAZ 1.2, format 3", ".laz", "1.2", 3, laspy.LazBackend.Laszip),
    _case("laszip", "LAZ 1.4, format 7", ".laz", "1.4", 7, laspy.LazBackend.Laszip),
]
