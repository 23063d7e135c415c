"""Choosing one of several declarations by a name in the data."""

from __future__ import annotations

import difflib
from collections.abc import Iterable, Mapping
from typing import Annotated, Any, Union

from pydantic import BeforeValidator, Discriminator, Tag
from pydantic_core import PydanticCustomError

from renderer.blocks import Declaration

PREFIX = "<"
"""What a union's tag begins with, so that an error's path can leave the tag out."""


def unknown_name(kind: str, name: Any, known: Iterable[str]) -> PydanticCustomError:
    """The error for a name that no catalogue has; it proposes the nearest that there is."""
    names = list(known)
    near = difflib.get_close_matches(str(name), names, n=1)
    return PydanticCustomError(
        "unknown_name",
        "unknown {kind}{hint}",
        {
            "kind": kind,
            "name": name,
            "hint": f"; did you mean {near[0]!r}?" if near else "",
            "bound": "one of " + ", ".join(names),
        },
    )


def one_of(kind: str, field: str, choices: Mapping[str, type[Declaration]]) -> Any:
    """The type "one of these declarations, told apart by ``field``".

    An unknown name is one error that lists the names. A plain string stands for the declaration of
    that name with its defaults.
    """

    def name_in(data: Any) -> Any:
        return data.get(field) if isinstance(data, Mapping) else getattr(data, field, None)

    def tag(data: Any) -> str:
        return f"{PREFIX}{name_in(data)}>"

    def known(data: Any) -> Any:
        if isinstance(data, str):
            data = {field: data}
        name = name_in(data)
        if not isinstance(name, str) or name not in choices:
            raise unknown_name(kind, name, choices)
        return data

    tagged = tuple(Annotated[choice, Tag(f"{PREFIX}{name}>")] for name, choice in choices.items())
    return _annotated(Union[tagged], Discriminator(tag), BeforeValidator(known))  # noqa: UP007 - built from data


def _annotated(base: Any, discriminator: Discriminator, check: BeforeValidator) -> Any:
    return Annotated[base, discriminator, check]
