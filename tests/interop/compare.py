"""What comes through is compared with what went in: is it the same, how precisely, and what differs."""

from dataclasses import dataclass, field

import numpy as np

from clouds import COLORS, Cloud


@dataclass(frozen=True)
class Held:
    """How a program holds numbers."""

    # Rounded to this type.
    cast: type | None = None
    # Then at most this much off.
    error: float = 0.0
    # Multiplied before: eight bits that become sixteen.
    factor: int = 1
    # Written with as few digits as tell a float from its neighbors: what was float is so when it is rounded to one again.
    shortest: bool = False

    def of(self, values):
        """The numbers as they are held."""
        if self.factor != 1:
            values = np.asarray(values).astype(np.int64) * self.factor
        return values if self.cast is None else np.asarray(values).astype(self.cast)


# As they are.
SAME = Held()
# Rounded to the nearest float.
FLOAT = Held(cast=np.float32)
# As text of a float.
SHORTEST = Held(shortest=True)


def within(error: float) -> Held:
    """At most `error` off."""
    return Held(error=error)


@dataclass(frozen=True)
class Kept:
    """What a program gives back of a cloud."""

    points: Held = SAME
    # None: no normals at all.
    normals: Held | None = SAME
    # The other values that it keeps, by name.
    values: dict[str, Held] = field(default_factory=dict)
    # How it holds those without a name there; None: not at all.
    others: Held | None = None
    # Rows without a place are left out.
    leaves_out_holes: bool = False
    # They keep no coordinate at all.
    blanks_holes: bool = False
    # What it cannot do, for the table.
    remark: str = ""

    def value(self, name: str) -> Held | None:
        """How it holds a value, if it does."""
        return self.values.get(name, self.others)

    def apply(self, cloud: Cloud) -> Cloud:
        """The cloud, as it is to be after this program."""
        if self.leaves_out_holes:
            cloud = cloud.finite()
        normals = None if self.normals is None or cloud.normals is None else self.normals.of(cloud.normals)
        values = {name: held.of(of) for name, of in cloud.values.items() if (held := self.value(name))}
        positions = np.array(self.points.of(cloud.positions), np.float64)
        if self.blanks_holes:
            positions = blanked(positions)
        return Cloud(positions, normals, values)


def blanked(positions):
    """Positions without the remains of rows that have no place."""
    return np.where(np.isfinite(positions).all(axis=1, keepdims=True), positions, np.nan)


def same(names) -> dict[str, Held]:
    """Values that are held as they are."""
    return dict.fromkeys(names, SAME)


@dataclass
class Measure:
    """How far numbers are from those that went in, at worst."""

    # Differences that rounding to float does not explain.
    error: float = 0.0
    as_float: bool = False
    factor: int = 1
    # What is wrong; empty where all is as it should be.
    fault: str = ""

    def over(self, other: "Measure") -> "Measure":
        """The worse of both."""
        error, as_float = max(self.error, other.error), self.as_float or other.as_float
        return Measure(error, as_float, max(self.factor, other.factor), self.fault or other.fault)

    def __str__(self) -> str:
        if self.fault:
            return "differ"
        if self.error > 0:
            # The next larger 1, 2 or 5 of its decade, so that the last bits of a machine do not show.
            decade = 10.0 ** np.floor(np.log10(self.error))
            step = decade * next(step for step in (1, 2, 5, 10) if self.error <= step * decade * (1 + 1e-6))
            return f"within {step:.0e}".replace("e-0", "e-") if step < 1e-3 else f"within {step:g}"
        if self.as_float:
            return "as float"
        return "same" if self.factor == 1 else f"times {self.factor}"


def _are_floats(values) -> bool:
    return bool((np.isnan(values) | (values == values.astype(np.float32))).all())


def _difference(one, other):
    """How far apart numbers are; those that are both not finite are not."""
    with np.errstate(invalid="ignore"):
        off = np.abs(one.astype(np.float64) - other.astype(np.float64))
    off[~np.isfinite(one.astype(np.float64)) & ~np.isfinite(other.astype(np.float64))] = 0.0
    return np.nan_to_num(off, nan=np.inf)


def measure(name: str, original, expected, got, held: list[Held]) -> Measure:
    """Compares what came with what is to come, and says how far it is from what went in."""
    original, expected, got = np.asarray(original), np.asarray(expected), np.asarray(got)
    if expected.shape != got.shape:
        return Measure(fault=f"{name}: shape {got.shape} instead of {expected.shape}")
    if any(one.shortest for one in held) and _are_floats(expected):
        got = got.astype(np.float32)
    off = _difference(got, expected)
    worst = float(off.max(initial=0.0))
    allowed = sum(one.error for one in held)
    # What doubles of that size cannot tell apart is no error of rounding.
    largest = float(np.nan_to_num(np.abs(expected.astype(np.float64)), posinf=0.0).max(initial=0.0))
    if worst > (allowed + 4 * np.finfo(np.float64).eps * largest if allowed else 0.0):
        at = int(off.reshape(len(off), -1).max(axis=1).argmax())
        return Measure(fault=f"{name}: {got[at]} instead of {expected[at]} at point {at}")
    factor = max((one.factor for one in held), default=1)
    rounded = factor == 1 and float(_difference(got, original).max(initial=0.0)) > worst
    return Measure(error=worst, as_float=rounded, factor=factor)


@dataclass
class Outcome:
    """One cloud's way through some programs."""

    points: Measure
    # None: there were none to compare.
    normals: Measure | None
    values: dict[str, Measure]

    def over(self, other: "Outcome") -> "Outcome":
        """The worse of both, part by part."""
        normals = self.normals.over(other.normals) if self.normals and other.normals else self.normals or other.normals
        values = {name: of.over(other.values[name]) if name in other.values else of for name, of in self.values.items()}
        return Outcome(self.points.over(other.points), normals, {**other.values, **values})

    def faults(self) -> list[str]:
        """What is wrong."""
        parts = [self.points, *([self.normals] if self.normals else []), *self.values.values()]
        return [part.fault for part in parts if part.fault]

    def cells(self) -> list[str]:
        """Points, normals and other values in words: `colors, intensity; range within 0.1`."""
        by_measure: dict[str, list[str]] = {}
        for name, of in self.values.items():
            by_measure.setdefault(str(of), []).append(name)
        for names in by_measure.values():
            if all(color in names for color in COLORS):
                names[names.index("red")] = "colors"
                names[:] = [name for name in names if name not in COLORS]
        parts = [", ".join(names) + ("" if how == "same" else f" {how}") for how, names in by_measure.items()]
        return [str(self.points), str(self.normals) if self.normals else "–", "; ".join(parts) or "–"]


def compare(original: Cloud, got: Cloud, programs: list[Kept]) -> Outcome:
    """Compares what came out with what went in, where `programs` were in between."""
    expected = original
    for kept in programs:
        expected = kept.apply(expected)
    if len(expected) != len(original):
        original = original.finite()
    held = [kept.points for kept in programs]
    given = blanked(original.positions) if any(kept.blanks_holes for kept in programs) else original.positions
    points = measure("points", given, expected.positions, got.positions, held)
    normals = None
    if expected.normals is not None:
        held = [kept.normals for kept in programs]
        normals = Measure(fault="normals: none came")
        if got.normals is not None:
            normals = measure("normals", original.normals, expected.normals, got.normals, held)
    values = {}
    for name, of in expected.values.items():
        held = [kept.value(name) for kept in programs]
        values[name] = Measure(fault=f"{name}: did not come")
        if name in got.values:
            values[name] = measure(name, original.values[name], of, got.values[name], held)
    return Outcome(points, normals, values)
