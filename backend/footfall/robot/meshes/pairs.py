"""A list of shapes on a pin model and the least distances between pairs of them."""

from collections.abc import Iterator

import coal
import numpy as np
import pinocchio as pin
from numpy.typing import ArrayLike, NDArray


class Pairs:
    """Add shapes and pairs first, then ask :meth:`data` for each mode; one thread at a time."""

    def __init__(self, model: pin.Model) -> None:
        self._model = model
        self._joint_data = model.createData()
        self._labels: list[str] = []
        self._required: list[float] = []
        self._modes: list[tuple[str, ...] | None] = []
        self.objects = pin.GeometryModel()

    def add(self, label: str, joint: int, T_joint_shape: ArrayLike, shape: coal.BVHModelOBBRSS) -> int:
        """Fix a shape to a joint (0: the base) and return its index. Labels name it in reports, twice if need be."""
        placement = pin.SE3(np.asarray(T_joint_shape, float))
        index = len(self._labels)
        self.objects.addGeometryObject(pin.GeometryObject(f"{index} {label}", joint, placement, shape))
        self._labels.append(label)
        return index

    def check(self, a: int, b: int, required: float, modes: tuple[str, ...] | None = None) -> None:
        """Demand that shapes a and b are at least ``required`` [m] apart, in those modes (None: in all)."""
        self.objects.addCollisionPair(pin.CollisionPair(a, b))
        self._required.append(required)
        self._modes.append(modes)

    def data(self, mode: str) -> pin.GeometryData:
        """Scratch memory with the pairs of that mode active and their distances set."""
        data = pin.GeometryData(self.objects)
        for i, (required, modes) in enumerate(zip(self._required, self._modes, strict=True)):
            data.collisionRequests[i].security_margin = required
            if modes is not None and mode not in modes:
                data.deactivateCollisionPair(i)
        return data

    def place(self, data: pin.GeometryData, q: NDArray[np.float64]) -> None:
        """Move the shapes to joint angles q."""
        pin.updateGeometryPlacements(self._model, self._joint_data, self.objects, data, q)

    def any_too_close(self, data: pin.GeometryData) -> bool:
        """Whether a pair is too close, as last placed."""
        return pin.computeCollisions(self.objects, data, True)

    def too_close(self, data: pin.GeometryData) -> Iterator[tuple[int, int, float, float]]:
        """Every pair that is too close, as last placed: shapes a and b, required and actual distance [m]."""
        pin.computeCollisions(self.objects, data, False)
        for i, pair in enumerate(self.objects.collisionPairs):
            if data.activeCollisionPairs[i] and data.collisionResults[i].isCollision():
                yield pair.first, pair.second, self._required[i], self._distance(data, pair.first, pair.second)

    def distance_to(
        self, data: pin.GeometryData, a: int, shape: coal.BVHModelOBBRSS, T_base_shape: NDArray[np.float64]
    ) -> float:
        """Distance of shape a as last placed to another shape [m]; 0 where their surfaces intersect."""
        return _distance(self._shape(a), data.oMg[a], shape, pin.SE3(T_base_shape))

    def label(self, index: int) -> str:
        """What the shape of that number was called when it was added."""
        return self._labels[index]

    def points(self, data: pin.GeometryData, offsets: dict[int, NDArray[np.float64]]) -> NDArray[np.float64]:
        """Points given in their shapes' frames, in base, (n, 3)."""
        return np.array([data.oMg[index].act(offset) for index, offset in offsets.items()])

    def _distance(self, data: pin.GeometryData, a: int, b: int) -> float:
        return _distance(self._shape(a), data.oMg[a], self._shape(b), data.oMg[b])

    def _shape(self, index: int) -> coal.BVHModelOBBRSS:
        return self.objects.geometryObjects[index].geometry


def _distance(a: coal.BVHModelOBBRSS, pose_a: pin.SE3, b: coal.BVHModelOBBRSS, pose_b: pin.SE3) -> float:
    T_a = coal.Transform3s(pose_a.rotation, pose_a.translation)
    T_b = coal.Transform3s(pose_b.rotation, pose_b.translation)
    return max(float(coal.distance(a, T_a, b, T_b, coal.DistanceRequest(), coal.DistanceResult())), 0.0)
