"""A linked program: its samplers have fixed units, its blocks fixed binding points."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any, Protocol

import moderngl


class Bindable(Protocol):
    """A texture that a sampler may read."""

    def bind(self, unit: int) -> None:
        """Put the texture on this unit."""


class Program:
    """A program of a device; `binding` is the device's binding point of each block name."""

    def __init__(self, binding: Callable[[str], int], program: moderngl.Program) -> None:
        self.program = program
        self.samplers: dict[str, int] = {}
        for name in program:
            member = program[name]
            if isinstance(member, moderngl.UniformBlock):
                member.binding = binding(name)
            elif isinstance(member, moderngl.Uniform) and _is_sampler(member):
                member.value = self.samplers.setdefault(name, len(self.samplers))

    def __setitem__(self, uniform: str, value: Any) -> None:
        """Set a plain uniform; one that the compiler dropped is left alone."""
        member = self.program.get(uniform, None)
        if isinstance(member, moderngl.Uniform):
            member.value = value

    def bind(self, textures: Mapping[str, Bindable]) -> None:
        """Put each texture on the unit of the sampler of its name; names without a sampler are skipped."""
        for name, unit in self.samplers.items():
            if name in textures:
                textures[name].bind(unit)

    def attributes(self) -> frozenset[str]:
        """The vertex attributes that the program reads."""
        return frozenset(n for n in self.program if isinstance(self.program[n], moderngl.Attribute))


def _is_sampler(member: moderngl.Uniform) -> bool:
    # A sampler's value is one plain int, like an int uniform's; ours carry "map" in their names.
    return member.name.split("[")[0].endswith(("_map", "_table")) or "_map_" in member.name
