"""Open3D: PLY with all properties (through tensors), text of points."""

import numpy as np
import open3d as o3d
from open3d.core import Tensor

from case import TEXT, Case
from clouds import COLORS, Cloud, with_colors
from compare import Kept, same, within

o3d.utility.set_verbosity_level(o3d.utility.VerbosityLevel.Error)


def read(path) -> Cloud:
    """Reads positions, normals, colors and all other attributes."""
    point = o3d.t.io.read_point_cloud(str(path)).point
    columns = {name: point[name].numpy() for name in point}
    positions = columns.pop("positions").astype(np.float64)
    normals = columns.pop("normals", None)
    colors = with_colors(columns.pop("colors")) if "colors" in columns else {}
    return Cloud(positions, normals, colors | {name: of[:, 0] for name, of in columns.items()})


def write(cloud: Cloud, path, **options) -> None:
    """Writes all of a cloud that Open3D's tensors can be."""
    tensors = o3d.t.geometry.PointCloud(Tensor(cloud.positions))
    if cloud.normals is not None:
        tensors.point["normals"] = Tensor(cloud.normals)
    tensors.point["colors"] = Tensor(cloud.colors())
    for name, of in cloud.values.items():
        if name not in (*COLORS, "intensity"):
            tensors.point[name] = Tensor(np.ascontiguousarray(of)[:, None])
    if not o3d.t.io.write_point_cloud(str(path), tensors, **options):
        raise RuntimeError("Open3D did not write the file")


def read_text(path) -> Cloud:
    """Reads positions and normals."""
    cloud = o3d.io.read_point_cloud(str(path), format="xyzn")
    return Cloud(np.asarray(cloud.points), np.asarray(cloud.normals) if cloud.has_normals() else None)


def write_text(cloud: Cloud, path) -> None:
    """Writes positions and normals."""
    legacy = o3d.geometry.PointCloud(o3d.utility.Vector3dVector(cloud.positions))
    legacy.normals = o3d.utility.Vector3dVector(cloud.normals.astype(np.float64))
    by_its_name = path.with_suffix(".xyzn")
    if not o3d.io.write_point_cloud(str(by_its_name), legacy):
        raise RuntimeError("Open3D did not write the file")
    by_its_name.rename(path)


def write_pts(cloud: Cloud, path) -> None:
    """Writes positions and colors."""
    legacy = o3d.geometry.PointCloud(o3d.utility.Vector3dVector(cloud.positions))
    legacy.colors = o3d.utility.Vector3dVector(cloud.colors() / 255)
    if not o3d.io.write_point_cloud(str(path), legacy):
        raise RuntimeError("Open3D did not write the file")


def splats() -> Cloud:
    """Gaussian splats: colors as harmonics, opacity, size, turn."""
    random = np.random.default_rng(3)
    n = 200
    normals = random.normal(size=(n, 3))
    values = {"f_dc": (n, 3), "f_rest": (n, 15, 3), "opacity": (n,), "scale": (n, 3), "rot": (n, 4)}
    values = {name: random.normal(size=shape).astype(np.float32) for name, shape in values.items()}
    # Sizes are kept as logarithms in files only.
    values["scale"] = np.exp(values["scale"])
    unit = normals / np.linalg.norm(normals, axis=1)[:, None]
    return Cloud(random.normal(size=(n, 3)).astype(np.float32).astype(np.float64), unit.astype(np.float32), values)


def write_splats(cloud: Cloud, path) -> None:
    """Has Open3D write splats."""
    tensors = o3d.t.geometry.PointCloud(Tensor(cloud.positions.astype(np.float32)))
    tensors.point["normals"] = Tensor(cloud.normals)
    for name, of in cloud.values.items():
        tensors.point[name] = Tensor(of if of.ndim > 1 else of[:, None])
    if not o3d.t.io.write_point_cloud(str(path), tensors):
        raise RuntimeError("Open3D did not write the file")


def read_splats(path) -> Cloud:
    """Has Open3D read splats."""
    point = o3d.t.io.read_point_cloud(str(path)).point
    columns = {name: point[name].numpy() for name in point}
    columns["opacity"] = columns["opacity"][:, 0]
    return Cloud(columns.pop("positions").astype(np.float64), columns.pop("normals"), columns)


def splats_of(columns: dict) -> dict:
    """The columns of a file of splats, gathered as Open3D does."""

    def gather(name: str, n: int):
        return np.column_stack([columns[f"{name}_{index}"] for index in range(n)])

    return {
        "f_dc": gather("f_dc", 3),
        # Channel by channel.
        "f_rest": gather("f_rest", 45).reshape(-1, 3, 15).transpose(0, 2, 1),
        "opacity": columns["opacity"],
        "scale": np.exp(gather("scale", 3)),
        "rot": gather("rot", 4),
    }


def write_pcd(cloud: Cloud, path, **options) -> None:
    """Writes normals as double too: Open3D declares them so, whatever they are."""
    write(Cloud(cloud.positions, cloud.normals.astype(np.float64), cloud.values), path, **options)


ATTRIBUTES = same((*COLORS, "classification", "gps_time", "range", "target"))

SPLATS = Kept(values=same(splats().values) | {"scale": within(1e-5)})
# Ten digits in all.
PCD_TEXT = Kept(
    points=within(1e-9), normals=within(1e-9), values=ATTRIBUTES | {"gps_time": within(0.5)}, remark="writes ten digits"
)

CASES = [
    Case(
        program="Open3D",
        format="PLY, little-endian",
        extension=".ply",
        read=read,
        write=write,
        reads=Kept(values=ATTRIBUTES, remark="reads no ushort"),
        writes=Kept(values=ATTRIBUTES),
        made=Kept(values=ATTRIBUTES),
    ),
    Case(
        program="Open3D",
        format="text, x y z nx ny nz",
        extension=".xyz",
        read=read_text,
        write=write_text,
        made=TEXT,
        only=(),
        writes=Kept(points=within(1e-10), normals=within(1e-7), remark="writes ten digits after the point"),
    ),
    Case(
        program="Open3D",
        format="PTS",
        extension=".pts",
        write=write_pts,
        writes=Kept(
            points=within(1e-10), normals=None, values=same(COLORS), remark="writes ten digits after the point"
        ),
    ),
    Case(
        program="Open3D",
        format="PLY, Gaussian splats",
        extension=".ply",
        read=read_splats,
        write=write_splats,
        write_source=write_splats,
        clouds={"splats": splats()},
        values_of=splats_of,
        reads=SPLATS,
        writes=SPLATS,
        made=SPLATS,
    ),
    *(
        Case(
            program="Open3D",
            format=f"PCD, {name}",
            extension=".pcd",
            read=read,
            write=lambda cloud, path, options=options: write_pcd(cloud, path, **options),
            reads=Kept(values=ATTRIBUTES),
            writes=kept,
            made=Kept(values=ATTRIBUTES),
            without_made={"UTM": "it takes normals for as wide as coordinates"},
        )
        for name, options, kept in (
            ("text", {"write_ascii": True}, PCD_TEXT),
            ("binary", {}, Kept(values=ATTRIBUTES)),
            ("compressed", {"compressed": True}, Kept(values=ATTRIBUTES)),
        )
    ),
]
