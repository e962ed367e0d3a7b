"""What a job yields, as arrays."""
from __future__ import annotations

import dataclasses
import math

import numpy as np

from bedflow.v1 import fields_pb2, results_pb2


@dataclasses.dataclass(frozen=True)
class Average:
    """Mean of the means of bins of time, with half of its 95 % interval; NaN where there are too few bins."""

    mean: float
    half_width: float
    bins: int

    @classmethod
    def of(cls, message: results_pb2.Estimate) -> Average:
        return cls(message.mean if message.HasField("mean") else math.nan,
                   message.half_width if message.HasField("half_width") else math.nan, message.bins)


@dataclasses.dataclass(frozen=True)
class Series:
    """A monitor over time. minimum, maximum and samples are those of the groups of a thinned series, else empty."""

    name: str
    unit: str
    meaning: str
    step: np.ndarray
    time: np.ndarray
    value: np.ndarray
    minimum: np.ndarray
    maximum: np.ndarray
    samples: np.ndarray
    average: Average
    deviation: Average

    @property
    def mean(self) -> float:
        return self.average.mean

    @property
    def half_width(self) -> float:
        return self.average.half_width

    @classmethod
    def of(cls, message: results_pb2.Series) -> Series:
        return cls(message.name, message.unit, message.meaning, np.array(message.step, dtype=np.uint64), np.array(message.time),
                   np.array(message.value), np.array(message.minimum), np.array(message.maximum),
                   np.array(message.samples, dtype=np.uint32), Average.of(message.average), Average.of(message.deviation))


@dataclasses.dataclass(frozen=True)
class Profile:
    """A monitor over a length: mean and deviation in time at each place, with halves of their 95 % intervals."""

    name: str
    unit: str
    meaning: str
    place: np.ndarray
    mean: np.ndarray
    half_width: np.ndarray
    deviation: np.ndarray
    bins: np.ndarray

    @classmethod
    def of(cls, message: results_pb2.Profile) -> Profile:
        averages = [Average.of(one) for one in message.average]
        return cls(message.name, message.unit, message.meaning, np.array(message.place), np.array([one.mean for one in averages]),
                   np.array([one.half_width for one in averages]), np.array([Average.of(one).mean for one in message.deviation]),
                   np.array([one.bins for one in averages], dtype=np.uint32))


@dataclasses.dataclass(frozen=True)
class Reduced:
    """One quantity over a region; NaN where nothing there has a value. weight: m³ of cells, or particles."""

    unit: str
    minimum: float
    maximum: float
    mean: float
    deviation: float
    integral: float
    integral_unit: str
    weight: float
    histogram: np.ndarray
    edges: np.ndarray

    @classmethod
    def of(cls, message: fields_pb2.FieldReduced) -> Reduced:
        def number(name: str) -> float:
            return getattr(message, name) if message.HasField(name) else math.nan
        bins = len(message.histogram)
        edges = np.linspace(message.histogram_low, message.histogram_high, bins + 1) if bins else np.array([])
        return cls(message.quantity.unit, number("minimum"), number("maximum"), number("mean"), number("deviation"),
                   message.integral, message.integral_unit, message.weight, np.array(message.histogram), edges)


@dataclasses.dataclass(frozen=True)
class Field:
    """A slice, a profile or a sample of one checkpoint. values[name] has the shape of axes, in their order (slowest first); a
    sample has one value a particle and no axes. NaN where there is no value."""

    step: int
    time: float
    values: dict[str, np.ndarray]
    units: dict[str, str]
    axes: dict[str, np.ndarray]
    place: float | None
    particles: int | None


class FieldParts:
    """Puts the parts of an answer together."""

    def __init__(self) -> None:
        self._header = fields_pb2.FieldHeader()
        self._columns: list[np.ndarray] = []

    def take(self, part: fields_pb2.FieldAnswer) -> None:
        if part.WhichOneof("part") == "header":
            self._header = part.header
            size = math.prod(self._header.shape)
            self._columns = [np.full(size, math.nan) for _ in self._header.columns]
        else:
            values = np.array(part.values.value)
            self._columns[part.values.column][part.values.offset:part.values.offset + len(values)] = values

    def reduced(self) -> dict[str, Reduced]:
        return {one.quantity.name: Reduced.of(one) for one in self._header.reduced}

    def field(self) -> Field:
        header = self._header
        names = [column.name for column in header.columns]
        shape = tuple(header.shape)
        return Field(header.step, header.time,
                     {name: column.reshape(shape) for name, column in zip(names, self._columns, strict=True)},
                     {column.name: column.unit for column in header.columns},
                     {axis.name: np.array(axis.place) for axis in header.axes},
                     header.place if header.HasField("place") else None,
                     header.particles if header.HasField("particles") else None)
