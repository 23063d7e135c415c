"""The techniques by name."""

from __future__ import annotations

from typing import TYPE_CHECKING

from renderer.naming import one_of
from renderer.water.lake import Lake
from renderer.water.lake_edges import LakeEdges
from renderer.water.luna import Luna
from renderer.water.technique import Technique
from renderer.water.tut29 import Tut29

TECHNIQUES: dict[str, type[Technique]] = {"luna": Luna, "lake": Lake, "lake_edges": LakeEdges, "tut29": Tut29}
DEFAULT = "luna"

if TYPE_CHECKING:
    AnyWater = Technique
else:
    AnyWater = one_of("technique", "technique", TECHNIQUES)
