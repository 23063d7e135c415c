"""Maps that stay between frames: what the maps' targets hold, and whether a frame may read it as it is."""

from __future__ import annotations

from collections.abc import Callable, Hashable, Mapping
from dataclasses import dataclass

from renderer.camera import Camera
from renderer.gpu.target import Target
from renderer.passes.mapping import DrawnMap, seen_water_is_before, water_window
from renderer.passes.view import WHOLE, Look, Window
from renderer.request import FrameRequest
from renderer.water.technique import Extents, MapSpec, Technique


@dataclass(frozen=True, eq=False)
class Kept:
    """What one target holds."""

    decided_by: Hashable
    window: Window
    drawn: DrawnMap


class KeptMaps:
    """The last map of each name, with everything that decided it.

    A map's target is lent again and again; what it holds is remembered until something else is drawn into it. Only a
    frame that asks for its maps from another time or place may read it: all others draw their own, so that what a
    frame costs does not hang on the frame before. Bytes never do: a map is read again only where the same request
    would draw the same pixels.
    """

    def __init__(self) -> None:
        self._kept: dict[str, Kept] = {}

    def found(
        self,
        looks: Mapping[str, tuple[MapSpec, Look]],
        world: Hashable,
        lend: Callable[[str, MapSpec, Camera], Target],
    ) -> dict[str, DrawnMap]:
        """The maps among these that stand drawn already."""
        found = {}
        for name, (spec, look) in looks.items():
            kept = self._kept.get(name)
            if (
                kept is not None
                and kept.decided_by == _decided_by(spec, look, world)
                and kept.window in (WHOLE, look.window)
                and lend(name, spec, look.camera) is kept.drawn.target
            ):
                found[name] = kept.drawn
        return found

    def forget(self, name: str) -> None:
        """Something else is about to be drawn into this map's target."""
        self._kept.pop(name, None)

    def keep(self, looks: Mapping[str, tuple[MapSpec, Look]], world: Hashable, drawn: Mapping[str, DrawnMap]) -> None:
        """Remember what has been drawn."""
        for name, made in drawn.items():
            spec, look = looks[name]
            self._kept[name] = Kept(_decided_by(spec, look, world), look.window, made)


def _decided_by(spec: MapSpec, look: Look, world: Hashable) -> Hashable:
    """Everything that decides a map's pixels but its window: the world as it stood, and how it was looked at."""
    camera = look.camera
    return (
        world,
        spec,
        look.clip_plane,
        camera.clip_from_world.tobytes(),
        camera.world_from_camera.tobytes(),
        (camera.width, camera.height),
    )


def world_of_maps(request: FrameRequest, instant: float) -> Hashable:
    """What a request says of the world in its maps; ``instant`` is when they are drawn."""
    water = request.water
    stands = (request.scene, request.sky, request.seed, instant, request.period)
    return (*stands, request.sun, request.ambient, request.fog, water.level, water.is_encoded)


def map_window(request: FrameRequest, camera: Camera, source: Camera) -> Window:
    """The part of a map of this camera, ``source``, that the water in a picture of ``camera`` reads.

    A map that is asked for itself is drawn whole. So is one behind whose eye the picture sees water: that is read
    anywhere.
    """
    water = request.water
    level, extents = plane_of(water)
    if request.layers != ("color",):
        return WHOLE
    if source is not camera and (water.is_displaced or not seen_water_is_before(source, camera, level, extents)):
        return WHOLE
    return water_window(source, level, extents, water.reach())


def plane_of(water: Technique) -> tuple[float, Extents]:
    """The water's level and rectangle: a request that has been read has both."""
    return water.level or 0.0, water.extents or (0.0, 0.0, 0.0, 0.0)
