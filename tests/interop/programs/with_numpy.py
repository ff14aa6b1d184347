"""numpy: text with a column for each value, with names and without."""

import numpy as np

from case import TEXT, Case
from clouds import NAMES, Cloud, of_columns
from compare import SAME, Kept

COLUMNS = ("x", "y", "z", "nx", "ny", "nz", *NAMES)


def write(cloud: Cloud, path, delimiter=" ", comments="") -> None:
    """Writes a line of names and a line for each point, with all digits."""
    rows = np.column_stack([cloud.positions, cloud.normals.astype(np.float64), *cloud.values.values()])
    np.savetxt(path, rows, fmt="%.17g", delimiter=delimiter, header=delimiter.join(COLUMNS), comments=comments)


def read(path, delimiter=None) -> Cloud:
    """Reads columns by their names."""
    table = np.atleast_1d(np.genfromtxt(path, delimiter=delimiter, names=True, deletechars=""))
    return of_columns({name: table[name] for name in table.dtype.names})


def write_bare(cloud: Cloud, path) -> None:
    """Writes six columns without names."""
    np.savetxt(path, np.column_stack([cloud.positions, cloud.normals]), fmt="%.17g")


def read_bare(path) -> Cloud:
    """Reads six columns without names."""
    rows = np.loadtxt(path, ndmin=2)
    return Cloud(rows[:, :3], rows[:, 3:6])


CASES = [
    Case(
        program="numpy",
        format="text, x y z nx ny nz",
        extension=".xyz",
        read=read_bare,
        write=write_bare,
        made=TEXT,
        only=(),
    ),
    Case(
        program="numpy",
        format="CSV",
        extension=".csv",
        read=lambda path: read(path, ","),
        write=lambda cloud, path: write(cloud, path, ","),
        reads=Kept(others=SAME),
        writes=Kept(others=SAME),
        made=TEXT,
    ),
    Case(
        program="numpy",
        format="text, named columns",
        extension=".txt",
        write=lambda cloud, path: write(cloud, path, "\t", "# "),
        read=lambda path: read(path, "\t"),
        write_source=lambda cloud, path: write(cloud, path, "\t", "# "),
        source_extension=".txt",
        reads=Kept(others=SAME),
        writes=Kept(others=SAME),
        made=Kept(others=SAME),
    ),
]
