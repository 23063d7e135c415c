"""From what a caller wrote to a whole request: names expanded, the scene's own values laid beneath."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from renderer.lens import LENSES
from renderer.scene.catalogue import SCENES
from renderer.scene.entry import SceneEntry
from renderer.viewpoint import FORMS, form_of
from renderer.water.catalogue import DEFAULT as DEFAULT_TECHNIQUE


def scene_entry(name: Any) -> SceneEntry | None:
    """The catalogue's card of a scene, or None."""
    return SCENES.get(name) if isinstance(name, str) else None


def lay_over(data: Mapping[str, Any], entry: SceneEntry) -> dict[str, Any]:
    """Fill in what the scene sets for itself; the caller's partial objects go over it, by the same form."""
    filled = dict(data)
    for name, own in entry.own.items():
        if name not in filled:
            filled[name] = own
        elif isinstance(own, Mapping):
            given = filled[name]
            lay = {"camera": _camera, "sun": _sun, "sky": _sky}.get(name, _plain)
            filled[name] = lay(given, own)
    return filled


def _plain(given: Any, own: Mapping[str, Any]) -> Any:
    return {**own, **given} if isinstance(given, Mapping) else given


def _sky(given: Any, own: Mapping[str, Any]) -> Any:
    if isinstance(given, str):
        given = {"model": given}
    if not isinstance(given, Mapping):
        return given
    model = given.get("model", own.get("model"))
    return {**own, **given} if model == own.get("model") else {**given, "model": model}


def _sun(given: Any, own: Mapping[str, Any]) -> Any:
    if not isinstance(given, Mapping):
        return given
    dropped = {"azimuth", "elevation"} if given.get("direction") is not None else set()
    if {"azimuth", "elevation"} & set(given):
        dropped = {"direction"}
    return {**{k: v for k, v in own.items() if k not in dropped}, **given}


def _camera(given: Any, own: Mapping[str, Any]) -> Any:
    if not isinstance(given, Mapping):
        return given
    own_form, given_form = form_of(own), form_of(given)
    every_field = set().union(*(form.form for form in FORMS.values()))
    if given_form is None and set(given) & every_field:
        return given  # a mixture: validation says so
    if given_form is not None and given_form != own_form:
        base: dict[str, Any] = {}
    else:
        base = dict(own)
    if any(given.get(name) is not None for name in LENSES):
        base = {k: v for k, v in base.items() if k not in LENSES}
    merged = {**base, **given}
    if isinstance(base.get("orbit"), Mapping) and isinstance(given.get("orbit"), Mapping):
        merged["orbit"] = {**base["orbit"], **given["orbit"]}
    return merged


def water_of(given: Any, entry: SceneEntry) -> Any:
    """The water with its technique's name expanded, and the scene's level and extents beneath."""
    if isinstance(given, str):
        given = {"technique": given}
    if not isinstance(given, Mapping):
        return given
    beneath = {"level": entry.water_level, "extents": list(entry.water_extents)}
    return {
        "technique": DEFAULT_TECHNIQUE,
        **given,
        **{k: v for k, v in beneath.items() if given.get(k) is None},
    }
