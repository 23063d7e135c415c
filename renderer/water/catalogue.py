"""The techniques by name."""

from __future__ import annotations

from typing import TYPE_CHECKING

from renderer.naming import one_of
from renderer.water.luna import Luna
from renderer.water.technique import Technique
from renderer.water.tut29 import Tut29

TECHNIQUES: dict[str, type[Technique]] = {"luna": Luna, "tut29": Tut29}
DEFAULT = "luna"

if TYPE_CHECKING:
    AnyWater = Technique
else:
    AnyWater = one_of("technique", "technique", TECHNIQUES)
