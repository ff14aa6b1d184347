"""pypcd4: PCD in all three kinds."""

import numpy as np
from pypcd4 import Encoding, PointCloud

from case import PLY, Case
from clouds import COLORS, NAMES, Cloud, of_columns
from compare import SAME, Kept, within

NORMAL = ("normal_x", "normal_y", "normal_z")


def read(path) -> Cloud:
    """Reads every field; colors are packed in one."""
    cloud = PointCloud.from_path(path)
    columns = {name: np.atleast_1d(cloud.pc_data[name]) for name in cloud.fields}
    if "rgb" in columns:
        packed = columns.pop("rgb").copy().view(np.uint32)
        columns |= {
            name: (packed >> shift & 255).astype(np.uint8) for name, shift in zip(COLORS, (16, 8, 0), strict=True)
        }
    return of_columns(columns, NORMAL)


def write(cloud: Cloud, path, encoding=Encoding.BINARY) -> None:
    """Writes coordinates as double, normals and colors as PCL packs them, and values as they are."""
    columns = {name: cloud.positions[:, axis] for axis, name in enumerate("xyz")}
    columns |= {name: cloud.normals[:, axis] for axis, name in enumerate(NORMAL)}
    columns["rgb"] = PointCloud.encode_rgb([cloud.values[name] for name in COLORS])
    columns |= {name: of for name, of in cloud.values.items() if name not in COLORS}
    arrays = list(columns.values())
    PointCloud.from_points(arrays, tuple(columns), [of.dtype for of in arrays]).save(path, encoding)


def _case(name: str, encoding: Encoding, writes: Kept) -> Case:
    return Case(
        program="pypcd4",
        format=f"PCD, {name}",
        extension=".pcd",
        read=read,
        write=lambda cloud, path: write(cloud, path, encoding),
        reads=Kept(others=SAME),
        writes=writes,
        made=PLY,
    )


# Colors are packed in the bits of a float, of which a few digits are left.
DIGITS = within(1e-9)
AS_TEXT = Kept(
    points=DIGITS,
    normals=DIGITS,
    values={name: DIGITS for name in NAMES if name not in COLORS},
    remark="writes ten digits after the point, and so no colors",
)

CASES = [
    _case("text", Encoding.ASCII, AS_TEXT),
    _case("binary", Encoding.BINARY, Kept(others=SAME)),
    _case("compressed", Encoding.BINARY_COMPRESSED, Kept(others=SAME)),
]
