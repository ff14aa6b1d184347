"""pye57, which is libE57Format: E57."""

import numpy as np
import pye57
from pye57.e57 import SUPPORTED_POINT_FIELDS
from pyquaternion import Quaternion

from case import Case
from clouds import COLORS, Cloud
from compare import Kept, same, within

COLOR_FIELDS = {"red": "colorRed", "green": "colorGreen", "blue": "colorBlue"}
NORMAL_FIELDS = ("nor:normalX", "nor:normalY", "nor:normalZ")
# pye57 reads only the fields of this table, and knows nothing of the extension.
SUPPORTED_POINT_FIELDS.update(dict.fromkeys(NORMAL_FIELDS, "f"))

# The scanner is turned and far from zero, as surveys have it.
TURN = Quaternion(axis=[0.6, 0.0, 0.8], degrees=35)


def read(path) -> Cloud:
    """Reads all scans, their poses applied."""
    file = pye57.E57(str(path))
    positions, normals, values = [], [], []
    for index in range(file.scan_count):
        raw = file.read_scan_raw(index, ignore_unsupported_fields=True)
        header = file.get_header(index)
        turn, shift = np.eye(3), np.zeros(3)
        if header.has_pose():
            turn, shift = header.rotation_matrix, header.translation
        stored = np.column_stack([raw[name] for name in ("cartesianX", "cartesianY", "cartesianZ")])
        if "cartesianInvalidState" in raw:
            stored[raw["cartesianInvalidState"] != 0] = np.nan
        positions.append(stored @ turn.T + shift)
        if NORMAL_FIELDS[0] in raw:
            normals.append(np.column_stack([raw[name] for name in NORMAL_FIELDS]) @ turn.T)
        values.append({name: raw[field] for name, field in COLOR_FIELDS.items() if field in raw})
        if "intensity" in raw:
            values[-1]["intensity"] = raw["intensity"]
    file.close()
    together = {name: np.concatenate([of[name] for of in values]) for name in values[0]}
    return Cloud(np.concatenate(positions), np.concatenate(normals) if normals else None, together)


def write(cloud: Cloud, path) -> None:
    """Writes two scans (one of one point) with poses, in floats about the scanner."""
    cloud = cloud.finite()
    file = pye57.E57(str(path), mode="w")
    middle = np.floor(cloud.positions.mean(axis=0))
    for index, part in enumerate(np.array_split(np.arange(len(cloud)), min(2, len(cloud)))):
        turn = TURN if index == 0 else Quaternion()
        stored = (cloud.positions[part] - middle) @ turn.rotation_matrix
        data = {name: stored[:, axis] for axis, name in enumerate(("cartesianX", "cartesianY", "cartesianZ"))}
        data |= {field: cloud.values[name][part] for name, field in COLOR_FIELDS.items()}
        data["intensity"] = cloud.values["intensity"][part].astype(np.float32)
        file.write_scan_raw(data, rotation=turn.elements, translation=middle, name=f"Scan {index + 1}")
    file.close()


VALUES = same((*COLORS, "intensity"))

CASES = [
    Case(
        program="pye57",
        format="E57",
        extension=".e57",
        read=read,
        write=write,
        reads=Kept(values=VALUES),
        # Floats of a few units about the scanner, turned there and back.
        writes=Kept(
            points=within(1e-6),
            normals=None,
            values=VALUES,
            leaves_out_holes=True,
            remark="writes floats about the scanner, no normals",
        ),
        made=Kept(values=VALUES, blanks_holes=True),
    ),
]
