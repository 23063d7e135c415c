"""The request: everything that determines the bytes of one image."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping
from dataclasses import replace
from functools import lru_cache
from typing import Annotated, Any, Literal, Self, get_args

import rfc8785
from pydantic import BeforeValidator, Field, ValidationError, field_validator, model_validator
from pydantic_core import ErrorDetails, PydanticCustomError

from renderer.blocks import Declaration
from renderer.camera import Camera
from renderer.errors import FieldProblem, InvalidRequest
from renderer.light import Fog, Sun, ToneMap
from renderer.naming import PREFIX, unknown_name
from renderer.resolve import lay_over, scene_entry, water_of
from renderer.scene.catalogue import DEFAULT as DEFAULT_SCENE
from renderer.scene.catalogue import SCENES
from renderer.scene.images import ImageReference
from renderer.scene.skies import AnySky
from renderer.source_digest import source_digest
from renderer.trajectory import Turntable
from renderer.units import Color, Seconds, as_tuple
from renderer.viewpoint import AnyViewpoint
from renderer.water.catalogue import AnyWater

MAX_SIDE = 16_384
"""Pixels: what every OpenGL driver that we know can draw; the service's own caps lie lower."""

LATEST = 1e7
"""Seconds: how far from zero a picture's time may lie."""
BOUNDS = {"ge": ">=", "gt": ">", "le": "<=", "lt": "<", "min_length": "length >=", "max_length": "length <="}
"""How the bounds that validation knows by these names are written."""

LayerName = Literal[
    "color",
    "reflection_map",
    "refraction_map",
    "reflection_weight",
    "perturbation",
    "validity",
    "water_mask",
]
LAYERS: tuple[str, ...] = get_args(LayerName)
FormatName = Literal["png", "jpeg", "webp"]


class MapsAt(Declaration):
    """When and from where the reflection and refraction maps are drawn, where not as the frame itself."""

    time: Seconds
    camera: AnyViewpoint


class FrameRequest(Declaration):
    """One image: scene, water, camera, light, time and format.

    Every field has a default. What the caller leaves out is the scene's own; after construction nothing
    is left open, so that equal meanings are equal requests.
    """

    scene: str = DEFAULT_SCENE
    """The world round the water: a name of the catalogue."""
    water: AnyWater = Field(default_factory=dict, validate_default=True)
    """The technique and its parameters, or its name alone."""
    camera: AnyViewpoint = Field(default_factory=dict, validate_default=True)
    """Where the picture is taken from."""
    time: Seconds = Field(0.0, ge=-LATEST, le=LATEST)
    """Time at which the picture is taken."""
    period: Seconds | None = Field(None, ge=1e-3, le=1e7)
    """Time after which all that moves repeats exactly; null lets it run on."""
    width: int = Field(1280, ge=1, le=MAX_SIDE, json_schema_extra={"x-unit": "px"})
    """Width of the image."""
    height: int = Field(720, ge=1, le=MAX_SIDE, json_schema_extra={"x-unit": "px"})
    """Height of the image."""
    sun: Sun | None = None
    """The directional light; null is none."""
    ambient: Color = (0.22, 0.25, 0.30)
    """Light from all sides."""
    sky: AnySky = Field(default_factory=dict, validate_default=True)
    """What stands behind everything. It lights nothing by itself."""
    fog: Fog | None = None
    """Air that scatters light, in the scene and in its reflection; null is none."""
    msaa: Literal[1, 4] = 4
    """Samples of the geometry's edges in one sub-frame."""
    samples: int = Field(1, ge=1, le=64)
    """Jittered sub-frames averaged in linear light."""
    shutter: Seconds = Field(0.0, ge=0, le=10)
    """Time over which the sub-frames are spread: motion blur."""
    tonemap: ToneMap = ToneMap()
    """How light becomes the picture."""
    maps: MapsAt | None = None
    """Time and camera at which the maps are drawn, to reuse them over frames; null is the frame's own."""
    layers: Annotated[tuple[LayerName, ...], BeforeValidator(as_tuple)] = ("color",)
    """What is asked for."""
    seed: int = Field(0, ge=0, le=2**31 - 1)
    """Seed of everything random."""
    format: FormatName = "png"
    """The file format."""

    @model_validator(mode="before")
    @classmethod
    def _resolve(cls, data: Any) -> Any:
        if not isinstance(data, Mapping):
            return data
        entry = scene_entry(data.get("scene", DEFAULT_SCENE))
        if entry is None:  # the scene's own validator says so; the rest is checked on the default scene
            entry = SCENES[DEFAULT_SCENE]
        filled = lay_over(data, entry)
        filled["water"] = water_of(filled.get("water", {}), entry)
        if isinstance(filled.get("tonemap"), str):
            filled["tonemap"] = {"operator": filled["tonemap"]}
        return filled

    @field_validator("scene")
    @classmethod
    def _known_scene(cls, name: str) -> str:
        if scene_entry(name) is None:
            raise unknown_name("scene", name, tuple(SCENES))
        return name

    @field_validator("layers")
    @classmethod
    def _one_image(cls, layers: tuple[str, ...]) -> tuple[str, ...]:
        if len(layers) != 1:
            raise PydanticCustomError(
                "layers",
                "an 8-bit image holds exactly one layer; ask for one layer a request",
                {"bound": "one of " + ", ".join(LAYERS)},
            )
        return layers

    @classmethod
    def parse(cls, data: Any, *, strict: bool = True) -> Self:
        """Check a request from outside.

        ``strict=False`` takes numbers written as strings. Raises ``InvalidRequest``.
        """
        try:
            return cls.model_validate(data, strict=strict)
        except ValidationError as error:
            raise invalid(error, given=data) from None

    def canonical(self) -> bytes:
        """The resolved request as RFC 8785 JSON: equal meanings, equal bytes."""
        return _canonical(self)

    def key(self) -> str:
        """The frame's key: SHA-256, 64 hex digits, of request, sources and dependencies."""
        digest = hashlib.sha256(self.canonical())
        digest.update(b"\0" + source_digest().encode())
        return digest.hexdigest()

    def view(self) -> Camera:
        """The camera in pixels."""
        return self.camera.camera(self.width, self.height)

    def images(self) -> dict[str, ImageReference]:
        """The users' images that the request names, by the path of the field that names them."""
        return {f"water.{path}": reference for path, reference in self.water.images().items()}

    def along(self, turntable: Turntable) -> list[FrameRequest]:
        """One request for each frame of a turntable that starts from this one.

        Where maps are shared by several frames, all but the first of them name its time and camera in ``maps``, so that
        each stands by itself. Raises ``InvalidRequest`` where the last frame would come too late to be a request, or
        this one names maps already.
        """
        centre = SCENES[self.scene].centre
        if self.time + turntable.duration > LATEST:
            message = "the last frame's time lies too late"
            problem = FieldProblem("turntable.frames", message, turntable.frames, f"time <= {LATEST:g} s")
            raise InvalidRequest((problem,))
        every = turntable.maps_every
        if self.maps is not None and every > 1:
            message = "the frame says itself where its maps are drawn"
            problem = FieldProblem("turntable.maps_every", message, every, "1, or frame.maps null")
            raise InvalidRequest((problem,))
        views = turntable.views(self.camera, self.time, self.period, centre)
        maps = [MapsAt.model_validate({"time": view.time, "camera": view.camera}) for view in views[::every]]
        return [
            self.model_copy(
                update={
                    "camera": view.camera,
                    "time": view.time,
                    "period": view.period,
                    "maps": maps[i // every] if i % every else self.maps,
                },
            )
            for i, view in enumerate(views)
        ]


@lru_cache(maxsize=256)
def _canonical(request: FrameRequest) -> bytes:
    """Remembered, since key, task and headers each ask for it; equal requests have equal bytes, with -0 and 0 too."""
    return rfc8785.dumps(_plain_zero(request.model_dump(mode="json")))


def invalid(error: ValidationError, prefix: str = "", given: Any = None) -> InvalidRequest:
    """The error that names each field as its caller wrote it; ``given`` is what the caller wrote."""
    problems = (_problem(details, given) for details in error.errors(include_url=False))
    if not prefix:
        return InvalidRequest(tuple(problems))
    return InvalidRequest(tuple(replace(p, path=f"{prefix}.{p.path}".strip(".")) for p in problems))


def _problem(details: ErrorDetails, given: Any) -> FieldProblem:
    is_unknown = details["type"] == "extra_forbidden"
    place: list[int | str] = list(details["loc"]) or [""]
    last = place.pop()
    parts = [part for part in place if not _is_tag(part)]
    if last != "" and (is_unknown or not _is_tag(last)):
        parts.append(last)
    context = details.get("ctx", {})
    named = [f"{sign} {context[name]}" for name, sign in BOUNDS.items() if name in context]
    bound = context.get("bound") or context.get("expected") or " and ".join(named) or None
    if details["type"] == "finite_number":
        bound = "a finite number"
    if is_unknown:
        bound = "a field of the schema"
    path = ".".join(str(part) for part in parts)
    message = "unknown field" if is_unknown else details["msg"]
    value = None if details["type"] == "missing" else _as_written(given, parts, details.get("input"))
    if details["type"] == "unknown_name":
        value = context["name"]
    return FieldProblem(path, message, value, bound)


def _is_tag(part: str | int) -> bool:
    """Whether a part of an error's place names a choice of a union, which no caller writes."""
    return isinstance(part, str) and part.startswith(PREFIX)


def _as_written(given: Any, parts: list[str | int], resolved: Any) -> Any:
    """The value at a place of what the caller wrote; ``resolved`` where the scene has filled it in."""
    for part in parts:
        is_there = part in given if isinstance(given, Mapping) else isinstance(part, int) and isinstance(given, list)
        if not is_there:
            return resolved
        given = given[part]
    return resolved if given is None else given


def _plain_zero(value: Any) -> Any:
    """Negative zero is zero."""
    if isinstance(value, dict):
        return {name: _plain_zero(item) for name, item in value.items()}
    if isinstance(value, list):
        return [_plain_zero(item) for item in value]
    return 0.0 if isinstance(value, float) and value == 0 else value
