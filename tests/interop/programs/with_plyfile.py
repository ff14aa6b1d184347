"""plyfile: PLY in all three encodings, every property."""

import numpy as np
from plyfile import PlyData, PlyElement

from case import Case, read_ply
from clouds import Cloud, write_plain_ply
from compare import SAME, Kept


def write(cloud: Cloud, path, text=False, byte_order="<") -> None:
    """Writes coordinates as double, normals as float, and values as they are."""
    columns = {name: cloud.positions[:, axis] for axis, name in enumerate("xyz")}
    columns |= {name: cloud.normals[:, axis] for axis, name in enumerate(("nx", "ny", "nz"))}
    columns |= cloud.values
    rows = np.empty(len(cloud), [(name, of.dtype) for name, of in columns.items()])
    for name, of in columns.items():
        rows[name] = of
    PlyData([PlyElement.describe(rows, "vertex")], text=text, byte_order=byte_order).write(path)


def _case(name: str, encoding: str, **options) -> Case:
    return Case(
        program="plyfile",
        format=f"PLY, {name}",
        extension=".ply",
        read=read_ply,
        write=lambda cloud, path: write(cloud, path, **options),
        reads=Kept(others=SAME),
        writes=Kept(others=SAME),
        made=Kept(others=SAME),
        write_source=lambda cloud, path: write_plain_ply(cloud, path, encoding),
    )


CASES = [
    _case("text", "ascii", text=True),
    _case("little-endian", "binary_little_endian", byte_order="<"),
    _case("big-endian", "binary_big_endian", byte_order=">"),
]
