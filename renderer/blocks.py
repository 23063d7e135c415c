"""One declaration, all its faces: validation, JSON schema, std140 block and bytes.

A ``Block`` is a frozen pydantic model. Its fields whose type carries a ``Glsl`` mark are members of a
uniform block named after the class; the others (a literal that selects code, say) are not.
Packing follows OpenGL 4.6, section 7.6.2.2 (std140).
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from functools import cache
from typing import Any, ClassVar

import numpy as np
from pydantic import BaseModel, ConfigDict

from renderer.units import Glsl

_ALIGNMENT = {"float": 4, "int": 4, "vec2": 8, "vec3": 16, "vec4": 16, "mat4": 16}
_SHAPE: dict[str, tuple[int, ...]] = {
    "float": (),
    "int": (),
    "vec2": (2,),
    "vec3": (3,),
    "vec4": (4,),
    "mat4": (4, 4),
}


@dataclass(frozen=True)
class Member:
    """One member of a uniform block."""

    name: str
    glsl: Glsl
    offset: int
    comment: str

    @property
    def shape(self) -> tuple[int, ...]:
        """The member's shape, matrices as (column, row)."""
        return _SHAPE[self.glsl.type]


class Declaration(BaseModel):
    """A frozen, strict model: unknown fields, wrong types, NaN and infinities are refused."""

    model_config = ConfigDict(
        frozen=True,
        extra="forbid",
        strict=True,
        use_attribute_docstrings=True,
        validate_default=True,
        ser_json_inf_nan="constants",
    )


class Block(Declaration):
    """A declaration that is also a std140 uniform block."""

    block_name: ClassVar[str | None] = None
    """The block's name in GLSL, where it is not the class's."""

    @classmethod
    def glsl_name(cls) -> str:
        """The block's name in GLSL."""
        return cls.block_name or cls.__name__

    @classmethod
    def instance_name(cls) -> str:
        """What GLSL calls the block's one instance: its name in snake case."""
        return re.sub(r"(?<=[a-z0-9])(?=[A-Z])", "_", cls.glsl_name()).lower()

    @classmethod
    def members(cls) -> tuple[Member, ...]:
        """The block's members with their std140 offsets."""
        return _layout(cls)[0]

    @classmethod
    def size(cls) -> int:
        """The block's size in bytes, a multiple of 16."""
        return _layout(cls)[1]

    @classmethod
    def glsl(cls) -> str:
        """The block's GLSL source, with unit and summary of each member as a comment."""
        lines = [f"    {member.glsl.type} {member.name};  // {member.comment}".rstrip(" /") for member in cls.members()]
        return "\n".join([f"layout(std140) uniform {cls.glsl_name()}", "{", *lines, f"}} {cls.instance_name()};"])

    @classmethod
    def dtype(cls) -> np.dtype[Any]:
        """The NumPy record that the block's bytes are."""
        members = cls.members()
        return np.dtype(
            {
                "names": [member.name for member in members],
                "formats": [
                    (np.int32 if member.glsl.type == "int" else np.float32, member.shape) for member in members
                ],
                "offsets": [member.offset for member in members],
                "itemsize": cls.size(),
            },
        )

    def pack(self) -> bytes:
        """The block's bytes: angles in radians, matrices column by column."""
        record = np.zeros((), self.dtype())
        for member in self.members():
            value = np.asarray(getattr(self, member.name), np.float64)
            if member.glsl.type == "mat4":
                value = value.reshape(4, 4).T
            record[member.name] = value * member.glsl.scale
        return record.tobytes()


@cache
def _layout(block: type[Block]) -> tuple[tuple[Member, ...], int]:
    members: list[Member] = []
    offset = 0
    for name, field in block.model_fields.items():
        marks = [mark for mark in field.metadata if isinstance(mark, Glsl)]
        if not marks:
            continue
        kind = marks[-1].type
        offset = -(-offset // _ALIGNMENT[kind]) * _ALIGNMENT[kind]
        members.append(Member(name, marks[-1], offset, _comment(field.description, marks[-1])))
        offset += 4 * int(np.prod(_SHAPE[kind], dtype=int))
    return tuple(members), -(-max(offset, 16) // 16) * 16


def _comment(description: str | None, glsl: Glsl) -> str:
    summary = (description or "").strip().split("\n")[0]
    return f"{summary} (radians)" if glsl.scale != 1.0 else summary
