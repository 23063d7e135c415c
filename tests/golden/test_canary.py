"""The frame by which a worker shows that it can draw looks as it did when it was last looked at."""

from __future__ import annotations

import numpy as np
import pytest
from PIL import Image

from renderer.encode.png import encode_png
from service.worker import CANARY_REFERENCE, CANARY_SIDE, canary_request
from tests.renderer.drawing import shared_renderer

TOLERANCE = 3
"""Of 255: processors differ by that much in the software driver's reciprocals."""


@pytest.mark.golden
def test_the_canary_looks_like_its_reference(is_blessing: bool) -> None:
    renderer = shared_renderer()
    drawn = renderer.render(canary_request()).color
    if is_blessing:
        CANARY_REFERENCE.write_bytes(encode_png(drawn, {}))
    with Image.open(CANARY_REFERENCE) as image:
        expected = np.asarray(image.convert("RGB")).astype(int)

    assert expected.shape == (CANARY_SIDE, CANARY_SIDE, 3)
    assert expected.std() > 10
    if not renderer.is_software:
        pytest.skip("the reference is the software driver's")
    assert np.abs(drawn.astype(int) - expected).max() <= TOLERANCE
