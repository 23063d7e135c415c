"""From a request to a frame: one story, one line a pass."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from functools import partial
from typing import Self

from renderer.blocks import Block
from renderer.camera import Camera
from renderer.doctor import examine
from renderer.errors import Cancelled, NoDevice
from renderer.fingerprint import fingerprint
from renderer.frame import Frame
from renderer.gpu.device import Device, Require
from renderer.gpu.geometry import Uniforms
from renderer.gpu.target import Target
from renderer.light import LightBlock
from renderer.passes.bed import BedPass
from renderer.passes.composite import CompositePass
from renderer.passes.kept_maps import KeptMaps, map_window, plane_of, world_of_maps
from renderer.passes.mapping import EDGE_SLACK, DrawnMap, draw_maps, eye_side, map_look
from renderer.passes.shadow import ShadowPass
from renderer.passes.shadows import Shadows
from renderer.passes.sky import Sky, SkyPass
from renderer.passes.stage import Stage
from renderer.passes.targets import Targets
from renderer.passes.view import Look, Wind
from renderer.passes.water import Moment, WaterPass
from renderer.request import FrameRequest
from renderer.scene.catalogue import SCENES
from renderer.water.technique import MapSpec

STAGES_KEPT = 2
KINDS = {"half": "f2", "byte": "f1"}
SHOWS = {
    "reflection_weight": ("SHOWS_WEIGHT",),
    "perturbation": ("SHOWS_PERTURBATION",),
    "validity": ("SHOWS_VALIDITY",),
    "water_mask": ("SHOWS_MASK",),
}
"""Layers that the water pass draws instead of its colour."""


@dataclass(frozen=True, eq=False)
class Instant:
    """One sub-frame: where the sampling point stands and when the shutter is."""

    request: FrameRequest
    camera: Camera
    time: float


@dataclass(frozen=True, eq=False)
class World:
    """What stands round the water in one sub-frame, and its light."""

    stage: Stage
    request: FrameRequest
    shadows: Shadows
    sky: Sky


class Renderer:
    """Draws frames: one OpenGL context, one thread, for life."""

    def __init__(self, require: Require = "any", *, measures_passes: bool = False) -> None:
        try:
            self.device = Device(require)
        except NoDevice as error:
            raise NoDevice(f"{error}\n\n{examine(require).text()}") from None
        self.measures_passes = measures_passes
        self._stages: dict[str, Stage] = {}
        self._targets = Targets(self.device)
        self._shadows = ShadowPass(self.device)
        self._sky = SkyPass(self.device)
        self._bed = BedPass(self.device)
        self._water = WaterPass(self.device)
        self._kept = KeptMaps()
        self._composite = CompositePass(self.device)
        self._uniforms: dict[str, Uniforms] = {}
        self._timings: dict[str, float] = {}

    def render(
        self,
        request: FrameRequest,
        *,
        is_cancelled: Callable[[], bool] | None = None,
    ) -> Frame:
        """Draw a frame; ``Cancelled`` is raised between sub-frames once ``is_cancelled`` says so."""
        self.device.check_thread()
        began = time.perf_counter()
        self._targets.begin_frame()  # also after a frame that failed half-way
        self._timings = {}
        size, layer = (request.width, request.height), request.layers[0]
        stage = self._stage(request.scene)
        instants = list(sub_frames(request)) if layer == "color" else [first_instant(request)]
        total = self._targets.lend("sum", size, kind="f4", has_depth=False) if len(instants) > 1 else None
        for number, instant in enumerate(instants):
            if is_cancelled is not None and is_cancelled():
                raise Cancelled
            picture = self._draw(stage, instant, layer)
            if total is not None:
                with self._pass("accumulate"):
                    share = 1 / len(instants)
                    self._composite.accumulate(picture, total, share, first=number == 0)
        output = self._targets.lend("output", size, kind="f1", components=3, has_depth=False)
        with self._pass("composite"):
            is_data = layer in SHOWS or request.water.is_encoded
            pixels = self._composite.encode(total or picture, output, request.tonemap, is_data=is_data)
        self._timings["render"] = time.perf_counter() - began
        return Frame(pixels, self.driver, {layer: pixels}, self._timings)

    def _draw(self, stage: Stage, instant: Instant, layer: str) -> Target:
        """Draw one sub-frame in linear light; what is returned holds the layer."""
        request, camera = instant.request, instant.camera
        samples = request.msaa if layer == "color" else 1
        self._light(request, camera, instant.time)
        with self._pass("shadow"):
            entry = SCENES[request.scene]
            shadows = self._shadows.draw(stage, request.sun, entry.centre, entry.shadow_radius)
        with self._pass("sky"):
            world = World(stage, request, shadows, self._sky.prepare(request))
        kind = KINDS["byte" if request.water.is_encoded else "half"]
        target = self._targets.lend("scene", (camera.width, camera.height), kind=kind, samples=samples)
        with self._pass("scene"):
            self._paint(world, target, Look(camera))
        with self._pass("maps"):
            maps = self._maps(world, instant, target)
        if layer.endswith("_map"):
            return maps[layer.removesuffix("_map")].target
        with self._pass("water"):
            if layer in SHOWS:
                self._composite.blank(target, maps["refraction"].target)
            bed = self._bed.draw(stage, *plane_of(request.water)) if request.water.needs_depth else None
            look = Look(camera)
            target.begin(None)
            self._bind("look", look.block(shadows))
            moment = Moment(instant.time, request.period, request.seed)
            self._water.draw(request.water, moment, look, maps, shadows, bed=bed, shows=SHOWS.get(layer, ()))
        if samples == 1:
            return target
        resolved = self._targets.lend("resolved", target.size, kind=kind, has_depth=False)
        target.copy_to(resolved)
        return resolved

    def _maps(self, world: World, instant: Instant, target: Target) -> dict[str, DrawnMap]:
        """The technique's maps; one that is the scene itself is copied from it."""
        request, camera, source = instant.request, instant.camera, instant
        specs = dict(request.water.maps())
        drawn: dict[str, DrawnMap] = {}
        if request.maps is not None:
            source = Instant(request, request.maps.camera.camera(camera.width, camera.height), request.maps.time)
        else:
            for name in [name for name, spec in specs.items() if spec.is_the_scene]:
                self._kept.forget(name)
                copy = self._lend_map(name, specs.pop(name), camera)
                target.copy_to(copy)
                drawn[name] = DrawnMap(copy, camera.clip_from_world)
        level = request.water.level or 0.0
        window = map_window(request, camera, source.camera)
        slack = EDGE_SLACK if request.msaa > 1 and request.layers == ("color",) else 0.0
        looks = {name: (spec, map_look(spec, source.camera, level, window, slack)) for name, spec in specs.items()}
        state = world_of_maps(request, source.time)
        if source is not instant:
            drawn |= self._kept.found(looks, state, self._lend_map)
        wanted = {name: look for name, look in looks.items() if name not in drawn}
        for name in wanted:
            self._kept.forget(name)
        self._light(request, source.camera, source.time)
        made = draw_maps(wanted, self._lend_map, partial(self._paint, world))
        self._kept.keep(wanted, state, made)
        self._light(request, camera, instant.time)
        return drawn | made

    def _paint(self, world: World, target: Target, look: Look, spec: MapSpec | None = None) -> None:
        """Draw the world without its water: the picture's own, or a map's."""
        objects = world.stage.tagged(spec.objects) if spec else None
        is_rough = spec is not None and not spec.is_the_scene  # shapes that only maps show may be coarser
        defines = (
            *(("HAS_FOG",) if world.request.fog else ()),
            *(("IS_ENCODED",) if world.request.water.is_encoded else ()),
        )
        target.begin(spec.clear if spec else (0.0, 0.0, 0.0, 0.0), look.window)
        self._bind("look", look.block(world.shadows))
        world.stage.draw(
            look,
            fragment="passes/scene.frag",
            defines=(*world.shadows.defines, *defines, *(("HAS_SAMPLES",) if target.samples > 1 else ())),
            in_map=is_rough,
            keeps=lambda part: (part.in_maps or not is_rough) and (objects is None or bool(objects & part.tags)),
            textures=world.shadows.textures,
        )
        if spec is None or spec.draws_sky:
            self._sky.draw(world.sky, defines)
        self.device.check_errors("scene pass")

    def _lend_map(self, name: str, spec: MapSpec, camera: Camera) -> Target:
        size = (camera.width, camera.height)
        return self._targets.lend(f"{name} map", size, kind=KINDS[spec.format], wrap=spec.wrap)

    def _light(self, request: FrameRequest, camera: Camera, instant: float) -> None:
        level = request.water.level or 0.0
        self._bind("light", LightBlock.of(request.sun, request.ambient, level, eye_side(camera, level)))
        self._bind("wind", Wind.at(instant, request.period))
        if request.fog is not None:
            self._bind("fog", request.fog)

    def _bind(self, name: str, block: Block) -> None:
        if name not in self._uniforms:
            self._uniforms[name] = Uniforms(self.device, block)
        self._uniforms[name].write(block)
        self._uniforms[name].bind()

    def _stage(self, name: str) -> Stage:
        if name not in self._stages:
            while len(self._stages) >= STAGES_KEPT:
                oldest = next(iter(self._stages))
                self._shadows.forget(oldest)
                self._bed.forget(oldest)
                self._stages.pop(oldest).release()
            self._stages[name] = Stage(self.device, SCENES[name].load())
        else:
            self._stages[name] = self._stages.pop(name)
        return self._stages[name]

    @contextmanager
    def _pass(self, name: str) -> Iterator[None]:
        """Measure a pass's CPU time; waiting for it costs, so only where that is asked for."""
        if not self.measures_passes:
            yield
            return
        began = time.process_time()
        yield
        self.device.finish()
        self._timings[name] = self._timings.get(name, 0.0) + time.process_time() - began

    @property
    def driver(self) -> str:
        """The driver's name with its OpenGL version."""
        return self.device.driver

    @property
    def is_software(self) -> bool:
        """Whether frames are drawn by a CPU."""
        return self.device.is_software

    @property
    def fingerprint(self) -> str:
        """What decides bits besides the key: driver, processor and encoders; 16 hex digits."""
        return fingerprint(self.driver, is_software=self.is_software)

    def live_objects(self) -> int:
        """How many OpenGL objects exist: flat while frames are drawn."""
        return self.device.live

    def close(self) -> None:
        """Release the context."""
        self.device.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


def first_instant(request: FrameRequest) -> Instant:
    """The frame at pixel centres with the shutter just open."""
    return Instant(request, request.view(), request.time)


def sub_frames(request: FrameRequest) -> Iterator[Instant]:
    """The sub-frames: jittered by Halton's points (bases 2 and 3), spread over the open shutter."""
    if request.samples == 1:
        yield first_instant(request)
        return
    view = request.view()
    for i in range(request.samples):
        jitter = (halton(i + 1, 2) - 0.5, halton(i + 1, 3) - 0.5)
        moment = request.time + request.shutter * (i + 0.5) / request.samples
        yield Instant(request, view.jittered(*jitter), moment)


def halton(index: int, base: int) -> float:
    """The radical inverse of a number from 1 on: Halton 1964, section 1."""
    value, share = 0.0, 1.0
    while index:
        share /= base
        value += share * (index % base)
        index //= base
    return value
