"""laspy, with lazrs and with LASzip behind it: LAS and LAZ."""

import laspy
import numpy as np

from case import Case
from clouds import COLORS, NAMES, Cloud
from compare import Held, Kept, same, within

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


def write(cloud: Cloud, path, version, point_format, backend=None) -> None:
    """Writes thousandths, what the format has, the rest in extra bytes, and records of a coordinate system and of our own."""
    cloud = cloud.finite()
    header = laspy.LasHeader(version=version, point_format=point_format)
    header.scales, header.offsets = [0.001] * 3, np.floor(cloud.positions.min(axis=0))
    header.system_identifier, header.generating_software = "a scanner", "laspy"
    header.global_encoding.gps_time_type = laspy.header.GpsTimeType.STANDARD
    kinds = dict.fromkeys(NORMAL, np.float32) | {name: cloud.values[name].dtype for name in EXTRA}
    header.add_extra_dims([laspy.ExtraBytesParams(name, kind, description="of a test") for name, kind in kinds.items()])
    header.vlrs.append(laspy.VLR("LASF_Projection", 2112, "WKT", b'PROJCS["WGS 84 / UTM zone 32N"]\0'))
    header.vlrs.append(laspy.VLR("a user", 7, "of its own", bytes(range(256))))
    las = laspy.LasData(header)
    las.x, las.y, las.z = cloud.positions.T
    for axis, name in enumerate(NORMAL):
        las[name] = cloud.normals[:, axis]
    random = np.random.default_rng(2)
    las.return_number, las.number_of_returns = random.integers(1, 6, (2, len(cloud)))
    las.user_data, las.point_source_id = random.integers(0, 256, (2, len(cloud)))
    las.scan_direction_flag = random.integers(0, 2, len(cloud))
    for name in held(point_format):
        las[name] = cloud.values[name]
    las.write(path, laz_backend=backend)


def untouched(theirs, ours) -> list[str]:
    """What differs between a file and the same with other normals."""
    one, other = laspy.read(theirs), laspy.read(ours)
    faults = []
    for name in ("version", "scales", "offsets", "mins", "maxs", "system_identifier", "point_count", "creation_date"):
        if not np.array_equal(getattr(one.header, name), getattr(other.header, name)):
            faults.append(f"{name} of the header: {getattr(other.header, name)} instead of {getattr(one.header, name)}")
    if one.point_format.id != other.point_format.id:
        faults.append(f"point format {other.point_format.id} instead of {one.point_format.id}")
    for name in set(one.point_format.dimension_names) - set(NORMAL):
        if not np.array_equal(one[name], other[name]):
            faults.append(f"{name} differs")
    records = {(of.user_id, of.record_id): of.record_data_bytes() for of in other.vlrs}
    for record in one.vlrs:
        name = (record.user_id, record.record_id)
        # That of extra bytes holds the range of normals, which is another one then; the dimensions were compared.
        if name != ("LASF_Spec", 4) and records.get(name) != record.record_data_bytes():
            faults.append(f"record {record.user_id} {record.record_id} differs")
    return faults


def held(point_format: int) -> list[str]:
    """The values that points of this format have, extra bytes among them."""
    own = set(laspy.PointFormat(point_format).dimension_names)
    return [name for name in NAMES if name in own or name in EXTRA]


# Coordinates are whole numbers of steps.
STEPS = within(0.0005)
WIDE = Held(factor=257)
UNTOUCHED = ("whole numbers, scale, offset, records", untouched)


def _ours(program: str, name: str, extension: str, backend=None) -> Case:
    # Colors of LAS have 16 bits.
    values = same(NAMES) | dict.fromkeys(COLORS, WIDE)
    return Case(
        program=program,
        format=name,
        extension=extension,
        read=lambda path: read(path, backend),
        reads=Kept(values=same(NAMES)),
        made=Kept(points=STEPS, values=values, leaves_out_holes=True),
    )


def _theirs(program: str, name: str, extension: str, version: str, point_format: int, backend=None) -> Case:
    return Case(
        program=program,
        format=f"{name} {version}, format {point_format}",
        extension=extension,
        read=lambda path: read(path, backend),
        write=lambda cloud, path: write(cloud, path, version, point_format, backend),
        reads=Kept(values=same(NAMES)),
        writes=Kept(points=STEPS, values=same(held(point_format)), leaves_out_holes=True),
        is_made=False,
        untouched=UNTOUCHED,
    )


LAZRS, LASZIP = laspy.LazBackend.LazrsParallel, laspy.LazBackend.Laszip

CASES = [
    _ours("laspy", "LAS", ".las"),
    _theirs("laspy", "LAS", ".las", "1.2", 0),
    _theirs("laspy", "LAS", ".las", "1.2", 3),
    _theirs("laspy", "LAS", ".las", "1.4", 7),
    _theirs("laspy", "LAS", ".las", "1.4", 8),
    _ours("lazrs", "LAZ", ".laz", LAZRS),
    _theirs("lazrs", "LAZ", ".laz", "1.2", 3, LAZRS),
    _theirs("lazrs", "LAZ", ".laz", "1.4", 7, LAZRS),
    _ours("laszip", "LAZ", ".laz", LASZIP),
    _theirs("laszip", "LAZ", ".laz", "1.2", 3, LASZIP),
    _theirs("laszip", "LAZ", ".laz", "1.4", 7, LASZIP),
]
