"""The clouds that are written and read, and the plain PLY that Normend starts from."""

from dataclasses import dataclass, field, replace

import numpy as np

COLORS = ("red", "green", "blue")


@dataclass
class Cloud:
    """Points in the order of the file; a normal or a value that is not there is not in it."""

    # n x 3, in the file's coordinates.
    positions: np.ndarray
    # n x 3, or None.
    normals: np.ndarray | None = None
    # Other values by name, n each.
    values: dict[str, np.ndarray] = field(default_factory=dict)

    def __len__(self) -> int:
        return len(self.positions)

    def rows(self, chosen) -> "Cloud":
        """The chosen rows."""
        normals = None if self.normals is None else self.normals[chosen]
        return Cloud(self.positions[chosen], normals, {name: of[chosen] for name, of in self.values.items()})

    def finite(self) -> "Cloud":
        """The rows that have a place."""
        return self.rows(np.isfinite(self.positions).all(axis=1))

    def colors(self) -> np.ndarray:
        """n x 3 bytes."""
        return np.column_stack([self.values[name] for name in COLORS])


def of_columns(columns: dict[str, np.ndarray], normal=("nx", "ny", "nz")) -> Cloud:
    """A cloud of named columns: x y z, a normal if there is one, and the rest."""
    rest = {name: of for name, of in columns.items() if name not in ("x", "y", "z", *normal)}
    positions = np.column_stack([columns[name] for name in "xyz"]).astype(np.float64)
    normals = np.column_stack([columns[name] for name in normal]) if normal[0] in columns else None
    return Cloud(positions, normals, rest)


def with_colors(colors) -> dict[str, np.ndarray]:
    """Values of n x 3 bytes, or of shares of 1."""
    colors = np.asarray(colors)
    if colors.dtype.kind == "f":
        colors = np.round(colors * 255)
    return {name: colors[:, channel].astype(np.uint8) for channel, name in enumerate(COLORS)}


def _local() -> Cloud:
    """A torus whose coordinates a float holds, with unit normals of any side and a value of every kind."""
    random = np.random.default_rng(1)
    n = 500
    around, across = random.uniform(0, 2 * np.pi, (2, n))
    outward = np.column_stack([np.cos(around) * np.cos(across), np.sin(around) * np.cos(across), np.sin(across)])
    middle = np.column_stack([np.cos(around), np.sin(around), np.zeros(n)])
    # Sides are mixed, so that a reader that turns normals is noticed.
    normals = outward * random.choice([-1.0, 1.0], n)[:, None]
    values = {name: random.integers(0, 256, n).astype(np.uint8) for name in COLORS}
    values["intensity"] = random.integers(0, 65536, n).astype(np.uint16)
    values["classification"] = random.integers(0, 19, n).astype(np.uint8)
    values["gps_time"] = 1.3e9 + np.cumsum(random.uniform(1e-6, 1e-3, n))
    values["range"] = random.uniform(1, 80, n).astype(np.float32)
    values["target"] = random.integers(-(2**31), 2**31, n).astype(np.int32)
    # Thousandths, as float: the neighboring double is what every program is to give back.
    positions = np.round(2 * middle + 0.5 * outward, 3).astype(np.float32)
    return Cloud(positions.astype(np.float64), normals.astype(np.float32), values)


def _clouds() -> dict[str, Cloud]:
    local = _local()
    # Projected coordinates, as surveys have them: meters in a UTM zone, with millimeters.
    offset = np.array([500000.123, 4500000.456, 123.789])
    utm = replace(local, positions=np.round(np.round(local.positions, 3) + offset, 3))
    holes = replace(local, positions=local.positions.copy())
    holes.positions[[0, 7, 499]] = np.nan
    holes.positions[100, 2] = np.nan
    return {"local": local, "UTM": utm, "one point": local.rows(slice(3, 4)), "holes": holes}


CLOUDS = _clouds()
# Of their values.
NAMES = tuple(CLOUDS["local"].values)


def write_plain_ply(cloud: Cloud, path, encoding="binary_little_endian") -> None:
    """Writes a PLY in numpy alone: float where that holds the coordinates, else double; normals as float; then all values."""
    names = {"u1": "uchar", "u2": "ushort", "i4": "int", "f4": "float", "f8": "double"}
    finite = cloud.finite().positions
    place = "f4" if (finite == finite.astype(np.float32)).all() else "f8"
    columns = [(name, place, cloud.positions[:, axis]) for axis, name in enumerate("xyz")]
    if cloud.normals is not None:
        columns += [(name, "f4", cloud.normals[:, axis]) for axis, name in enumerate(("nx", "ny", "nz"))]
    columns += [(name, of.dtype.str[1:], of) for name, of in cloud.values.items()]
    order = ">" if encoding == "binary_big_endian" else "<"
    rows = np.empty(len(cloud), [(name, order + kind) for name, kind, _ in columns])
    for name, _, of in columns:
        rows[name] = of
    header = ["ply", f"format {encoding} 1.0", f"element vertex {len(cloud)}"]
    header += [f"property {names[kind]} {name}" for name, kind, _ in columns]
    with open(path, "wb") as file:
        file.write("\n".join([*header, "end_header", ""]).encode())
        if encoding == "ascii":
            file.write("".join(" ".join(str(of) for of in row) + "\n" for row in rows).encode())
        else:
            file.write(rows.tobytes())


def _mesh() -> tuple[Cloud, np.ndarray]:
    """A wave of triangles, with normals of mixed sides."""
    random = np.random.default_rng(5)
    n = 12
    x, y = np.meshgrid(np.arange(n) * 0.25, np.arange(n) * 0.25, indexing="ij")
    positions = np.column_stack([x.ravel(), y.ravel(), np.sin(x).ravel()]).astype(np.float32)
    normals = np.column_stack([-np.cos(x).ravel(), np.zeros(n * n), np.ones(n * n)])
    normals *= (random.choice([-1, 1], n * n) / np.linalg.norm(normals, axis=1))[:, None]
    corner = (np.arange(n - 1)[:, None] * n + np.arange(n - 1)).ravel()
    lower = np.column_stack([corner, corner + n, corner + 1])
    upper = np.column_stack([corner + 1, corner + n, corner + n + 1])
    return Cloud(positions.astype(np.float64), normals.astype(np.float32)), np.concatenate([lower, upper])


MESH, FACES = _mesh()
