"""A program and a format: how it reads, how it writes, and the ways between it and Normend."""

import os
import subprocess
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from importlib import metadata
from pathlib import Path

import numpy as np
from plyfile import PlyData

from clouds import CLOUDS, COLORS, Cloud, of_columns, write_plain_ply
from compare import FLOAT, SHORTEST, Kept, Outcome, compare, same, within

NORMEND = os.environ.get("NORMEND", "normend")


def normend(*typed) -> None:
    """Runs Normend to its end."""
    done = subprocess.run([NORMEND, *map(str, typed), "--quiet"], capture_output=True, text=True, check=False)
    if done.returncode:
        sentence = (done.stderr.strip() or "no word").splitlines()[0]
        raise RuntimeError(f"normend {typed[0]} ended with {done.returncode}: {sentence}")


def export(source: Path, target: Path) -> None:
    """Has Normend write `target` with the normals of `source`, each on its side."""
    normend("orient", source, "-o", target, "--start", "keep", "--rule", "given")


def convert(source: Path, target: Path) -> None:
    """Has Normend write `target` as `source` is."""
    normend("convert", source, "-o", target)


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
    return of_columns({name.strip(): rows[:, index] for index, name in enumerate(names)})


def read_ply(path: Path) -> Cloud:
    """Reads x y z, nx ny nz and all else with plyfile."""
    vertex = PlyData.read(path)["vertex"]
    return of_columns({of.name: np.asarray(vertex[of.name]) for of in vertex.properties})


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
    # Whether there is such a file of this kind, and whether that has normals.
    is_made: bool = True
    is_made_with_normals: bool = True
    # What else is the same in its file and in our export of that, in words, and how to tell: faults of the two files.
    untouched: tuple[str, Callable[[Path, Path], list[str]]] | None = None
    # Columns as Normend reads them in its files, made to the values of the cloud.
    values_of: Callable[[dict[str, np.ndarray]], dict[str, np.ndarray]] = dict
    clouds: dict[str, Cloud] = field(default_factory=lambda: CLOUDS)
    # The values that clouds are given; None: all.
    only: tuple[str, ...] | None = None
    # Clouds that are not tried, with the reason for the table; and those not tried in files that Normend makes of a PLY.
    without: dict[str, str] = field(default_factory=dict)
    without_made: dict[str, str] = field(default_factory=dict)

    def _they_read_ours(self, cloud: Cloud, folder: Path) -> Outcome:
        source, ours = folder / f"source{self.source_extension}", folder / f"ours{self.extension}"
        if self.is_made_with_normals:
            self.write_source(cloud, source)
            export(source, ours)
        else:
            self.write_source(replace(cloud, normals=None), source)
            convert(source, ours)
        return compare(cloud, self.read(ours), [self.made, self.reads])

    def _we_read_theirs(self, cloud: Cloud, folder: Path) -> Outcome:
        theirs = folder / f"theirs{self.extension}"
        self.write(cloud, theirs)
        # To another format, so that each number is understood and not just copied.
        if self.extension == ".ply":
            ours = folder / "ours.csv"
            convert(theirs, ours)
            got, converted = read_table(ours, ","), TEXT
        else:
            ours = folder / "ours.ply"
            convert(theirs, ours)
            got, converted = read_ply(ours), PLY
        return compare(cloud, replace(got, values=self.values_of(got.values)), [self.writes, converted])

    def _they_read_theirs(self, cloud: Cloud, folder: Path) -> Outcome:
        theirs, ours = folder / f"theirs{self.extension}", folder / f"ours{self.extension}"
        self.write(cloud, theirs)
        export(theirs, ours)
        if self.untouched and (faults := self.untouched[1](theirs, ours)):
            raise ValueError("; ".join(faults))
        got = self.read(ours)
        outcome = compare(cloud, got, [self.writes, self.reads])
        if self.writes.normals is None and self.reads.normals is not None:
            # Its file has none, so ours has those of Normend, which are the same as text.
            table = folder / "table.csv"
            export(theirs, table)
            outcome.normals = compare(
                read_table(table, ","), got, [Kept(points=self.writes.points, normals=TURNED)]
            ).normals
        return outcome

    def rows(self, folder: Path) -> list[Row]:
        """A row for each way."""
        rows = []
        if self.read and self.is_made:
            without = self.without | self.without_made
            rows.append(self._row("we write, it reads", self._they_read_ours, [self.reads], without, folder))
        if self.write:
            rows.append(self._row("it writes, we read", self._we_read_theirs, [self.writes], self.without, folder))
        if self.read and self.write:
            kept = [self.writes, self.reads]
            way = "it writes, we export, it reads"
            rows.append(self._row(way, self._they_read_theirs, kept, self.without, folder))
            if self.untouched and not rows[-1].faults:
                rows[-1].values = f"{rows[-1].values}; {self.untouched[0]}".removeprefix("–; ")
        return rows

    def _row(self, way: str, go, programs: list[Kept], without: dict[str, str], folder: Path) -> Row:
        remarks = [kept.remark for kept in programs]
        remarks += [f"{name} not tried: {why}" for name, why in without.items()]
        row = Row(f"{self.program} {version_of(self.program)}", self.format, way)
        row.remark = "; ".join(dict.fromkeys(remark for remark in remarks if remark))
        total = None
        for name, cloud in self.clouds.items():
            if name in without:
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
TEXT = Kept(points=SHORTEST, normals=SHORTEST, others=SHORTEST)
PLY = Kept(normals=FLOAT, others=SHORTEST)
# What comes through an OBJ that Normend makes.
OBJ = Kept(points=SHORTEST, normals=SHORTEST, values=same(COLORS), leaves_out_holes=True)
# Normals that are turned with a scan, and back.
TURNED = within(1e-6)


def version_of(program: str) -> str:
    """The version of a Python package, or of a program from Debian without the packager's part."""
    try:
        return metadata.version(program).split(".post")[0]
    except metadata.PackageNotFoundError:
        package = {"PCL": "pcl-tools", "CloudCompare": "cloudcompare"}[program]
        full = run("dpkg-query", "-W", "-f", "${Version}", package)
        return full.split("+")[0].split("-")[0]
