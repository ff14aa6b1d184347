"""CloudCompare, by its command line: PLY and text."""

from dataclasses import replace

import numpy as np

from case import OBJ, TEXT, Case, read_ply, run
from clouds import COLORS, Cloud, write_plain_ply
from compare import Held, Kept, same, within


def convert(source, target, *options) -> None:
    """Has CloudCompare open a file and save another."""
    # What is shifted is held as float; near the middle of the clouds that is precise.
    shift = ["-GLOBAL_SHIFT", "-500000", "-4500000", "0"] if "UTM" in str(source) else []
    run(
        "CloudCompare",
        "-SILENT",
        "-AUTO_SAVE",
        "OFF",
        "-NO_TIMESTAMP",
        *options,
        "-O",
        *shift,
        source,
        "-SAVE_CLOUDS",
        "FILE",
        target,
    )


def plain_names(values: dict) -> dict:
    """What CloudCompare calls a scalar field of a PLY, by its own name."""
    return {name.removeprefix("scalar_"): of for name, of in values.items()}


def read(path) -> Cloud:
    """Has CloudCompare read a file and save it as PLY."""
    ply = path.with_suffix(".cloudcompare.ply")
    convert(path, ply, "-C_EXPORT_FMT", "PLY", "-PLY_EXPORT_FMT", "BINARY_LE")
    cloud = read_ply(ply)
    return replace(cloud, values=plain_names(cloud.values))


def write(cloud: Cloud, path) -> None:
    """Has CloudCompare read a plain PLY and save it."""
    plain = path.with_suffix(".plain.ply")
    write_plain_ply(cloud, plain)
    kind = {".ply": ("PLY", "-PLY_EXPORT_FMT", "BINARY_LE"), ".xyz": ("ASC", "-PREC", "9", "-SEP", "SPACE")}[
        path.suffix
    ]
    convert(plain, path, "-C_EXPORT_FMT", *kind)


HOLES = {"holes": "it puts them at 0 0 0"}
# Normals are two million directions.
NORMALS = within(2e-3)
ROUNDS = "holds a normal in 21 bits"

CASES = [
    Case(
        program="CloudCompare",
        format="PLY, little-endian",
        extension=".ply",
        read=read,
        write=write,
        reads=Kept(points=within(1e-5), normals=NORMALS, values=same((*COLORS, "intensity")), remark=ROUNDS),
        writes=Kept(points=within(1e-5), normals=NORMALS, values=same((*COLORS, "intensity")), remark=ROUNDS),
        made=Kept(values=same((*COLORS, "intensity"))),
        values_of=plain_names,
        without=HOLES,
    ),
    Case(
        program="CloudCompare",
        format="text, x y z nx ny nz",
        extension=".xyz",
        read=read,
        write=write,
        writes=Kept(points=within(1e-5), normals=NORMALS, remark=ROUNDS),
        made=TEXT,
        only=(),
        without=HOLES,
        reads=Kept(points=within(1e-5), normals=NORMALS, remark=ROUNDS),
    ),
    Case(
        program="CloudCompare",
        format="PTS",
        extension=".pts",
        read=read,
        made=TEXT,
        only=(),
        without=HOLES,
        reads=Kept(points=within(1e-5), normals=NORMALS, remark=ROUNDS),
    ),
    Case(
        program="CloudCompare",
        format="OBJ",
        extension=".obj",
        read=read,
        made=OBJ,
        reads=Kept(points=within(1e-5), normals=NORMALS, remark=ROUNDS),
        only=(),
    ),
    Case(
        program="CloudCompare",
        format="PTX",
        extension=".ptx",
        read=read,
        made=Kept(values=same(COLORS), leaves_out_holes=True),
        reads=Kept(
            points=Held(cast=np.float32, error=1e-5),
            normals=None,
            values=same(COLORS),
            remark="holds points of PTX as float; refuses normals there, so there are none",
        ),
        only=COLORS,
        is_made_with_normals=False,
    ),
]
