"""What decides a frame's bits besides its key: driver, processor and encoders."""

from __future__ import annotations

import hashlib
import json
from functools import cache
from pathlib import Path

from renderer.encode.image import encoder_versions

CPU_FACTS = ("vendor_id", "cpu family", "model", "model name", "flags")


def fingerprint(driver: str, *, is_software: bool) -> str:
    """16 hex digits: frames of one key and one fingerprint have the same bytes."""
    facts = {"driver": driver, "encoders": encoder_versions()}
    if is_software:
        facts["cpu"] = processor()
    return hashlib.sha256(json.dumps(facts, sort_keys=True).encode()).hexdigest()[:16]


@cache
def processor() -> dict[str, str]:
    """The first processor's vendor, model and flags, as the kernel names them."""
    facts: dict[str, str] = {}
    path = Path("/proc/cpuinfo")
    for line in path.read_text().splitlines() if path.is_file() else ():
        name, _, value = line.partition(":")
        if name.strip() in CPU_FACTS:
            facts.setdefault(name.strip(), value.strip())
    return facts
