"""The command line: the same frames as over HTTP, and plain words for mistakes."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import httpx
import pytest
from PIL import Image

from renderer.encode.png import read_png_text
from renderer.request import FrameRequest
from service.__main__ import COMMANDS, main
from service.commands.options import Option, Usage, overlaid, take_apart
from service.fields import frame_fields
from tests.service.conftest import ROOT, environment, movie_frames

SMALL = ("--width=64", "--height=36")


def millpond(*arguments: str, seconds: float = 120) -> subprocess.CompletedProcess[str]:
    """A run of the command."""
    return subprocess.run(
        [sys.executable, "-m", "service", *arguments],
        cwd=ROOT,
        env=environment(),
        capture_output=True,
        text=True,
        timeout=seconds,
        check=False,
    )


def test_a_frame_has_the_key_and_the_bytes_that_http_gives(http: httpx.Client, tmp_path: Path) -> None:
    out = tmp_path / "frame.png"
    fields = (
        "--water",
        "luna",
        "--time",
        "2",
        "--water.refraction-bias",
        "-0.2",
        "--camera.eye=9,3.2,9",
        "--scene=pond",
    )
    run = millpond("frame", str(out), *fields, *SMALL)

    assert run.returncode == 0, run.stderr
    query = "water=luna&time=2&water.refraction_bias=-0.2&camera.eye=9,3.2,9&scene=pond&width=64&height=36"
    answer = http.get(f"/v1/frame.png?{query}")
    assert out.read_bytes() == answer.content
    assert answer.headers["x-frame-key"] in run.stdout
    assert answer.headers["x-renderer"] in run.stdout

    again = tmp_path / "again.png"
    assert millpond("frame", "--from", str(out), str(again)).returncode == 0
    assert again.read_bytes() == out.read_bytes()
    assert [path.name for path in tmp_path.iterdir() if path.name.endswith(".part")] == []


def test_a_frame_is_drawn_again_with_other_fields_and_format(tmp_path: Path, http: httpx.Client) -> None:
    first = tmp_path / "first.png"
    first.write_bytes(http.get("/v1/frame.png?width=64&height=36&time=3&water.ripple_height=2").content)
    run = millpond("frame", "-", "--from", str(first), "--time=4", "--format=webp", "--print-request")

    assert run.returncode == 0, run.stderr
    request = FrameRequest.parse(json.loads(run.stdout))
    assert (request.time, request.format, request.width) == (4.0, "webp", 64)
    assert request.water.ripple_height == 2.0  # type: ignore[attr-defined]  # luna has it


def test_a_turntable_is_written_as_movie_and_as_folder(tmp_path: Path, http: httpx.Client) -> None:
    turn = ("--frames=4", "--fps=8", "--maps-every=2", "--workers=2", *SMALL)
    movie, folder = tmp_path / "t.mp4", tmp_path / "t"
    for out in (movie, folder):
        run = millpond("turntable", str(out), *turn)
        assert run.returncode == 0, run.stderr
        assert "4 frames of 64×36" in run.stderr

    assert movie_frames(movie.read_bytes()) == 4
    names = sorted(path.name for path in folder.iterdir())
    assert names == [f"frame_{index:08d}.png" for index in range(4)]
    requests = [json.loads(read_png_text((folder / name).read_bytes())["millpond"]) for name in names]
    for name, request in zip(names, requests, strict=True):
        assert http.post("/v1/frame", json=request).content == (folder / name).read_bytes()
    assert [request["maps"] is None for request in requests] == [True, False, True, False]
    assert sorted(path.name for path in tmp_path.iterdir()) == ["t", "t.mp4"]


def test_an_interrupted_command_says_so_and_leaves_nothing(tmp_path: Path) -> None:
    arguments = ("turntable", str(tmp_path / "t.zip"), "--frames=200", "--workers=1", "--width=320", "--height=180")
    run = subprocess.Popen(
        [sys.executable, "-m", "service", *arguments], cwd=ROOT, env=environment(), stderr=subprocess.PIPE, text=True
    )
    deadline = time.monotonic() + 60
    while not list(tmp_path.glob(".t.zip.*.part")) and time.monotonic() < deadline:
        time.sleep(0.1)
    os.kill(run.pid, signal.SIGINT)
    _, told = run.communicate(timeout=30)

    assert run.returncode == 130
    assert "Traceback" not in told
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    ("fields", "message"),
    [
        (["--watr=luna"], "watr: unknown field (given 'luna'; allowed a field of the schema)"),
        (["--time=nan"], "time: "),
        (["--width=100000"], "width: "),
        (
            ["--camera.eye=1,2,3", "--camera.target=1,2,3"],
            "camera.target: target must differ from eye (given [1, 2, 3]",
        ),
        (["--camera.eye=0,9,0", "--camera.target=0,0,0"], "camera.up: up is parallel to the view"),
        (["--scene=pnd"], "scene: unknown scene"),
        (["--water.refraction-bias=9"], "water.refraction_bias: "),
        (["--format=jpeg"], "format: the name ends in .png (given 'jpeg'; allowed png)"),
        (["--width=1", "--width=2"], "width: given more than once"),
        (["--v=1"], "--v is no field"),
        (["--time"], "--time needs a value"),
        (["--require=tpu"], "--require takes any, gpu or cpu"),
        (["--from=/nowhere.png"], "/nowhere.png can't be read"),
        (["two.png"], "one OUT is needed, not 2"),
    ],
)
def test_a_mistake_is_told_in_a_line_and_ends_with_2(
    capsys: pytest.CaptureFixture[str], fields: list[str], message: str
) -> None:
    code = main(["frame", "out.png", *fields])
    told = capsys.readouterr().err

    assert code == 2
    assert told.startswith(f"millpond: {message}")
    assert len(told.splitlines()) == 1
    assert not Path("out.png").exists()


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["fraem"], "there is no command 'fraem'"),
        (["frame", "out.gif"], "no frame format is written .gif"),
        (["frame", "out"], "written without a suffix"),
        (["frame", "/nowhere/at/all.png"], "there is no folder"),
        (["turntable", "out.avi"], "write .mp4"),
        (["turntable", "out.mp4", "--frames=0"], "frames: "),
        (["turntable", "out.mp4", "--sweep=90"], "loop: "),
        (["turntable", "out.mp4", "--maps-every=0"], "maps_every: "),
        (["turntable", "out.mp4", "--workers=none"], "--workers takes a whole number"),
        (["doctor", "--require=tpu"], "--require takes any, gpu or cpu"),
        (["doctor", "--jsn=1"], "there is no option --jsn"),
    ],
)
def test_bad_command_lines_are_refused(capsys: pytest.CaptureFixture[str], arguments: list[str], message: str) -> None:
    assert main(arguments) == 2
    assert message in capsys.readouterr().err


def test_a_picture_without_a_request_is_refused(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    for name, data in (("plain.png", None), ("text.json", b'{"width": '), ("list.json", b"[]"), ("noise.png", b"\x00")):
        path = tmp_path / name
        if data is None:
            Image.new("RGB", (4, 4)).save(path)
        else:
            path.write_bytes(data)
        assert main(["frame", str(tmp_path / "out.png"), "--from", str(path)]) == 2
        assert "carries no request" in capsys.readouterr().err


def test_help_of_frame_lists_every_field_with_unit_bounds_and_default(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["frame", "--help"]) == 0
    page = capsys.readouterr().out

    for facts in frame_fields():
        assert f"--{facts.path.replace('_', '-')}  [{facts.line()}]" in page
        assert facts.description in page
    assert "--width  [integer, px, ≥ 1 and ≤ " in page
    assert "--time  [number, s, " in page


@pytest.mark.parametrize("command", sorted(COMMANDS))
def test_every_command_has_its_help(capsys: pytest.CaptureFixture[str], command: str) -> None:
    assert main([command, "--help"]) == 0
    assert capsys.readouterr().out.startswith(f"usage: millpond {command}")
    assert main(["--help"]) == 0
    assert f"  {command}" in capsys.readouterr().out


def test_doctor_reports_in_words_and_in_json() -> None:
    plain, data = millpond("doctor"), millpond("doctor", "--json")

    assert plain.returncode == data.returncode
    assert plain.returncode == (0 if json.loads(data.stdout)["healthy"] else 3)
    assert json.loads(data.stdout)["verdict"] in plain.stdout


def test_a_command_without_the_device_that_it_requires_ends_with_3(tmp_path: Path) -> None:
    if millpond("doctor", "--require=gpu").returncode == 0:
        pytest.skip("this machine has a GPU")
    run = millpond("frame", str(tmp_path / "out.png"), "--require=gpu", *SMALL)

    assert run.returncode == 3
    assert "Traceback" not in run.stderr
    assert "gpu" in run.stderr
    assert list(tmp_path.iterdir()) == []


def test_describing_a_frame_loads_no_opengl() -> None:
    code = (
        "import sys; from service.__main__ import main; main(['frame', '-', '--print-request', '--help']); "
        "import service.commands.turntable, service.commands.serve, service.app; sys.exit('moderngl' in sys.modules)"
    )

    assert subprocess.run([sys.executable, "-c", code], cwd=ROOT, capture_output=True, check=False).returncode == 0


def test_options_are_told_from_fields() -> None:
    options = (Option("from", "FILE", ""), Option("dry", "", ""))
    found = take_apart(["a.png", "--from", "b", "--dry", "--water.tile-0", "-3", "--time=-1"], options)

    assert found.positional == ["a.png"]
    assert found.own == {"from": "b", "dry": ""}
    assert found.fields == [("water.tile_0", "-3"), ("time", "-1")]
    for wrong in (["--from=a", "--from=b"], ["--dry=1"], ["--from"]):
        with pytest.raises(Usage):
            take_apart(wrong, options)


def test_fields_are_laid_over_field_by_field() -> None:
    below = {"water": {"technique": "luna", "tile_0": 1}, "time": 1, "sun": {"azimuth": 3}}

    assert overlaid(below, {"water": {"tile_0": 2}, "sun": None}) == {
        "water": {"technique": "luna", "tile_0": 2},
        "time": 1,
        "sun": None,
    }
