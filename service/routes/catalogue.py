"""What there is to ask for: scenes, techniques, layers, formats, and the caps."""

from __future__ import annotations

from typing import Any

from fastapi import APIRouter, Request
from fastapi.responses import JSONResponse

from renderer.encode.image import FORMATS
from renderer.encode.movie import MOVIES
from renderer.request import LAYERS
from renderer.scene.catalogue import DEFAULT as DEFAULT_SCENE
from renderer.scene.catalogue import SCENES
from renderer.water.catalogue import DEFAULT as DEFAULT_TECHNIQUE
from renderer.water.catalogue import TECHNIQUES
from service.routes import schema
from service.routes.parts import parts_of
from service.settings import Limits

LASTING = {"Cache-Control": "public, max-age=300"}
router = APIRouter(tags=["catalogues"], responses=schema.problems())


@router.get("/v1/techniques", operation_id="techniques")
async def techniques() -> JSONResponse:
    """The ways in which water is shaped and shaded: schema, defaults, citation."""
    found = [
        {
            "name": name,
            "title": technique.title,
            "summary": _summary(technique.__doc__),
            "source": technique.source,
            "defaults": technique().model_dump(mode="json"),
            "schema": technique.model_json_schema(),
        }
        for name, technique in TECHNIQUES.items()
    ]
    return JSONResponse({"techniques": found, "default": DEFAULT_TECHNIQUE}, headers=LASTING)


@router.get("/v1/scenes", operation_id="scenes")
async def scenes() -> JSONResponse:
    """The worlds round the water, and what each sets for itself."""
    found = [
        {
            "name": entry.name,
            "title": entry.title,
            "summary": entry.summary,
            "water_level": entry.water_level,
            "water_extents": entry.water_extents,
            "centre": entry.centre,
            "defaults": dict(entry.own),
        }
        for entry in SCENES.values()
    ]
    return JSONResponse({"scenes": found, "default": DEFAULT_SCENE}, headers=LASTING)


@router.get("/v1/formats", operation_id="formats")
async def formats() -> JSONResponse:
    """The file formats of frames and of movies."""
    images = [
        {
            "name": entry.name,
            "media_type": entry.media_type,
            "suffixes": entry.suffixes,
            "bit_depth": entry.bit_depth,
        }
        for entry in FORMATS.values()
    ]
    movies = [
        {"name": entry.name, "media_type": entry.media_type, "suffixes": entry.suffixes} for entry in MOVIES.values()
    ]
    return JSONResponse({"formats": images, "movies": movies, "default": "png"}, headers=LASTING)


@router.get("/v1/layers", operation_id="layers")
async def layers() -> JSONResponse:
    """The images that a frame may be asked for."""
    found = [{"name": name, "formats": list(FORMATS)} for name in LAYERS]
    return JSONResponse({"layers": found, "default": ["color"]}, headers=LASTING)


@router.get("/v1/limits", operation_id="limits")
async def limits(request: Request) -> Limits:
    """Every cap with its value."""
    return parts_of(request).settings.limits


def _summary(text: Any) -> str:
    return str(text or "").strip().partition("\n")[0]
