"""A program and a format: how it reads, how it writes, and the ways between it and Normend."""

import os
import subprocess
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from importlib import metadata
from pathlib import Path

import numpy as np
from plyfile import PlyData

from clouds import CLOUDS, NAMES, Cloud, write_plain_ply
from compare import FLOAT, SHORTEST, Kept, Outcome, compare

NORMEND = os.environ.get("NORMEND", "normend")


def normend(source: Path, target: Path) -> None:
    """Has Normend read `source` and write `target` with the normals that came, each on its side."""
    typed = [NORMEND, "orient", source, "-o", target, "--start", "keep", "--rule", "given", "--quiet"]
    run = subprocess.run(typed, capture_output=True, text=True, check=False)
    if run.returncode:
        raise RuntimeError(f"normend: {run.stderr.strip()}")


def run(*typed, **options) -> str:
    """Runs another program to its end, and gives what it said."""
    done = subprocess.run([str(word) for word in typed], capture_output=True, text=True, check=False, **options)
    if done.returncode:
        raise RuntimeError(f"{typed[0]}: {(done.stderr or done.stdout).strip()[-300:]}")
    return done.stdout + done.stderr


def read_table(path: Path, delimiter=None) -> Cloud:
    """Reads text whose first line names its columns, in numpy alone."""
    with open(path, encoding="utf-8") as file:
        names = file.readline().lstrip("#/ ").strip().split(delimiter)
    rows = np.loadtxt(path, skiprows=1, ndmin=2, delimiter=delimiter)
    columns = {name.strip(): rows[:, index] for index, name in enumerate(names)}
    take = lambda *chosen: np.column_stack([columns.pop(name) for name in chosen])
    positions = take("x", "y", "z")
    normals = take("nx", "ny", "nz").astype(np.float32) if "nx" in columns else None
    return Cloud(positions, normals, columns)


def read_ply(path: Path) -> Cloud:
    """Reads x y z, nx ny nz and all else with plyfile."""
    vertex = PlyData.read(path)["vertex"]
    columns = {of.name: np.asarray(vertex[of.name]) for of in vertex.properties}
    take = lambda *chosen: np.column_stack([columns.pop(name) for name in chosen])
    positions = take("x", "y", "z").astype(np.float64)
    normals = take("nx", "ny", "nz") if "nx" in columns else None
    return Cloud(positions, normals, columns)


@dataclass
class Row:
    """A row of the table."""

    program: str
    format: str
    way: str
    points: str = "failed"
    normals: str = "failed"
    values: str = "failed"
    remark: str = ""
    # What is wrong, cloud by cloud; not in the table.
    faults: list[str] = field(default_factory=list)

    def cells(self) -> list[str]:
        """What the table shows."""
        remark = "; ".join(part for part in ("**fails**" if self.faults else "", self.remark) if part)
        return [self.program, self.format, self.way, self.points, self.normals, self.values, remark]


@dataclass
class Case:
    """One program and one format."""

    program: str
    format: str
    # Of the files, with the dot.
    extension: str
    read: Callable[[Path], Cloud] | None = None
    write: Callable[[Cloud, Path], None] | None = None
    # What comes through its reader, and through its writer.
    reads: Kept = field(default_factory=Kept)
    writes: Kept = field(default_factory=Kept)
    # What comes through a file that Normend makes of a PLY.
    made: Kept = field(default_factory=Kept)
    # The file that Normend starts from, if it is no binary PLY, and its extension.
    write_source: Callable[[Cloud, Path], None] = write_plain_ply
    source_extension: str = ".ply"
    # What values are called in its files, where that is not their name here.
    called: dict[str, str] = field(default_factory=dict)
    # The values that clouds are given; None: all.
    only: tuple[str, ...] | None = None
    # Clouds that are not tried, with the reason for the table.
    without: dict[str, str] = field(default_factory=dict)

    def _they_read_ours(self, cloud: Cloud, folder: Path) -> Outcome:
        source, ours = folder / f"source{self.source_extension}", folder / f"ours{self.extension}"
        self.write_source(cloud, source)
        normend(source, ours)
        return compare(cloud, self.read(ours), [self.made, self.reads])

    def _we_read_theirs(self, cloud: Cloud, folder: Path) -> Outcome:
        theirs = folder / f"theirs{self.extension}"
        self.write(cloud, theirs)
        # To another format, so that each number is understood and not just copied.
        if self.extension == ".ply":
            ours = folder / "ours.csv"
            normend(theirs, ours)
            return compare(cloud, self._renamed(read_table(ours, ",")), [self.writes, TEXT])
        ours = folder / "ours.ply"
        normend(theirs, ours)
        return compare(cloud, self._renamed(read_ply(ours)), [self.writes, PLY])

    def _renamed(self, cloud: Cloud) -> Cloud:
        names = {theirs: name for name, theirs in self.called.items()}
        return replace(cloud, values={names.get(name, name): of for name, of in cloud.values.items()})

    def _they_read_theirs(self, cloud: Cloud, folder: Path) -> Outcome:
        theirs, ours = folder / f"theirs{self.extension}", folder / f"ours{self.extension}"
        self.write(cloud, theirs)
        normend(theirs, ours)
        return compare(cloud, self.read(ours), [self.writes, self.reads])

    def rows(self, folder: Path) -> list[Row]:
        """A row for each way."""
        rows = []
        if self.read:
            rows.append(self._row("we write, it reads", self._they_read_ours, [self.reads], folder))
        if self.write:
            rows.append(self._row("it writes, we read", self._we_read_theirs, [self.writes], folder))
        if self.read and self.write:
            kept = [self.writes, self.reads]
            rows.append(self._row("it writes, we export, it reads", self._they_read_theirs, kept, folder))
        return rows

    def _row(self, way: str, go, programs: list[Kept], folder: Path) -> Row:
        remarks = [kept.remark for kept in programs] + [f"{name} not tried: {why}" for name, why in self.without.items()]
        row = Row(f"{self.program} {version_of(self.program)}", self.format, way)
        row.remark = "; ".join(dict.fromkeys(remark for remark in remarks if remark))
        total = None
        for name, cloud in CLOUDS.items():
            if name in self.without:
                continue
            if self.only is not None:
                cloud = replace(cloud, values={kept: cloud.values[kept] for kept in self.only})
            place = folder / way.replace(", ", "_").replace(" ", "_") / name.replace(" ", "_")
            place.mkdir(parents=True)
            try:
                outcome = go(cloud, place)
            except Exception as error:  # Whatever another program throws is a fault of the row.
                row.faults.append(f"{name}: {type(error).__name__}: {error} ({place})")
                continue
            row.faults += [f"{name}: {fault} ({place})" for fault in outcome.faults()]
            total = outcome if total is None else total.over(outcome)
        if total:
            row.points, row.normals, row.values = total.cells()
        return row


# What comes through text and through a PLY that Normend makes of another format: all.
TEXT = Kept(points=SHORTEST, normals=SHORTEST, values=dict.fromkeys(NAMES, SHORTEST))
PLY = Kept(normals=FLOAT, values=dict.fromkeys(NAMES, SHORTEST))


def version_of(program: str) -> str:
    """The version of a Python package, or of a program from Debian without the packager's part."""
    try:
        return metadata.version(program).split(".post")[0]
    except metadata.PackageNotFoundError:
        package = {"PCL": "pcl-tools", "CloudCompare": "cloudcompare"}[program]
        full = run("dpkg-query", "-W", "-f", "${Version}", package)
        return full.split("+")[0].split("-")[0]
