"""VTK, through PyVista: PLY."""

import numpy as np
import pyvista

from case import OBJ, Case
from clouds import COLORS, Cloud, with_colors
from compare import FLOAT, Kept, same, within


def read(path) -> Cloud:
    """Reads positions, normals and colors."""
    mesh = pyvista.read(path)
    colors = with_colors(mesh.point_data["RGB"]) if "RGB" in mesh.point_data else {}
    return Cloud(np.asarray(mesh.points, np.float64), np.asarray(mesh.point_data["Normals"]), colors)


REMARK = "VTK's readers give coordinates as float"

# One of 255 is lost where a share of 1 is cut off.
CUT = {name: within(1.0) for name in COLORS}

CASES = [
    Case(
        program="PyVista",
        format="PLY, little-endian",
        extension=".ply",
        read=read,
        reads=Kept(points=FLOAT, values=same(COLORS), remark=REMARK),
        made=Kept(values=same(COLORS)),
    ),
    Case(
        program="PyVista",
        format="OBJ",
        extension=".obj",
        read=read,
        reads=Kept(values=CUT, remark="cuts shares of color off"),
        made=OBJ,
    ),
]
