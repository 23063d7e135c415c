"""The kinds of trees: what makes an oak an oak."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Literal

Kind = Literal["oak", "alder", "birch", "willow", "pine", "spruce", "shrub"]
Rgb = tuple[float, float, float]


@dataclass(frozen=True, kw_only=True)
class Species:
    """What makes a kind of tree; fractions are of the height."""

    height: float
    """Usual height, metres."""
    spread: float
    """Crown radius at its widest."""
    base: float
    """Where the crown begins."""
    top: float
    """Where the leader ends; the lobes stand round it."""
    widest: float
    """Where the crown is widest, 0 (its base) to 1 (its top)."""
    lobes: int
    """Rounded masses of the crown; 0 makes a cone of drooping boughs instead."""
    lobe: float
    """Radius of a lobe over the crown's radius."""
    flat: float = 1.0
    """Height of a lobe over its width."""
    cards: int
    """Leaf clusters on one lobe, or on the cone."""
    card: float
    """Side of a leaf cluster's card, metres."""
    cells: tuple[str, ...]
    """Cells of the atlas that show a cluster."""
    trunk: float
    """Radius of the trunk at its foot."""
    tall: float = 1.0
    """Height of a card over its width."""
    hanging: bool = False
    """Cards stay upright and hang down."""
    upright: bool = False
    """Cards keep their lower edge down."""
    lean: float = 0.06
    """Standard deviation of how far the top stands off the foot."""
    bark: Rgb = (1.0, 1.0, 1.0)
    """Factor on the bark's colour."""


SPECIES: Mapping[Kind, Species] = MappingProxyType(
    {
        "oak": Species(
            height=9.0,
            spread=0.44,
            base=0.24,
            top=0.72,
            widest=0.42,
            lobes=15,
            lobe=0.43,
            flat=0.78,
            cards=17,
            card=1.75,
            cells=("oak0", "oak1"),
            trunk=0.034,
        ),
        "alder": Species(
            height=9.5,
            spread=0.27,
            base=0.18,
            top=0.86,
            widest=0.36,
            lobes=14,
            lobe=0.5,
            flat=0.85,
            cards=14,
            card=1.5,
            cells=("alder", "oak1"),
            trunk=0.02,
        ),
        "birch": Species(
            height=10.0,
            spread=0.21,
            base=0.26,
            top=0.92,
            widest=0.34,
            lobes=15,
            lobe=0.48,
            flat=1.05,
            cards=11,
            card=1.35,
            cells=("birch",),
            trunk=0.013,
            lean=0.1,
        ),
        "willow": Species(
            height=7.5,
            spread=0.52,
            base=0.4,
            top=0.66,
            widest=0.4,
            lobes=17,
            lobe=0.4,
            flat=0.75,
            cards=17,
            card=1.5,
            cells=("willow",),
            trunk=0.045,
            tall=1.8,
            hanging=True,
        ),
        "pine": Species(
            height=11.0,
            spread=0.26,
            base=0.52,
            top=0.92,
            widest=0.45,
            lobes=11,
            lobe=0.5,
            flat=0.5,
            cards=19,
            card=1.3,
            cells=("pine",),
            trunk=0.021,
            tall=0.8,
            upright=True,
            lean=0.1,
            bark=(1.35, 0.95, 0.7),
        ),
        "spruce": Species(
            height=12.0,
            spread=0.19,
            base=0.05,
            top=0.93,
            widest=0.04,
            lobes=0,
            lobe=1.0,
            cards=120,
            card=1.75,
            cells=("spruce",),
            trunk=0.016,
            tall=0.85,
            hanging=True,
            lean=0.02,
        ),
        "shrub": Species(
            height=1.5,
            spread=0.62,
            base=0.05,
            top=0.5,
            widest=0.3,
            lobes=6,
            lobe=0.5,
            flat=0.85,
            cards=15,
            card=0.8,
            cells=("shrub",),
            trunk=0.014,
            lean=0.2,
        ),
    },
)
