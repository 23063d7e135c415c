"""The doctor tells a healthy machine from a broken one, says what is broken, and names what mends it."""

from __future__ import annotations

import json
import os
import stat
import subprocess
import sys
from pathlib import Path

import pytest

from renderer import doctor, remedy
from renderer.doctor import Device, Library, Report, examine

MESA = "/usr/share/glvnd/egl_vendor.d/50_mesa.json"
SOFTWARE = Device(0, "llvmpipe", "Mesa", "4.5", ("EGL_MESA_device_software",), None, True, None, None, 0.1)
HARDWARE = Device(1, "A card", "Maker", "4.6", (), "/dev/dri/renderD128", False, None, None, 0.1)


@pytest.fixture
def clean(monkeypatch: pytest.MonkeyPatch) -> pytest.MonkeyPatch:
    """An environment that steers neither EGL nor Mesa."""
    for name in doctor.SWITCHES:
        monkeypatch.delenv(name, raising=False)
    return monkeypatch


def report(*devices: Device, demand: doctor.Demand = "any", **changes: object) -> Report:
    facts: dict[str, object] = {
        "demand": demand,
        "libraries": (Library("libEGL.so.1", None), Library("libOpenGL.so.0", None), Library("libGL.so.1", "gone")),
        "vendor_files": (),
        "devices": devices,
        "switches": {},
        "crash": None,
    }
    return Report(**{**facts, **changes})  # type: ignore[arg-type]


def probe_that(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, script: str) -> None:
    """Put `script` in the place of the interpreter that runs the probe."""
    program = tmp_path / "python"
    program.write_text(f"#!/bin/sh\n{script}\n")
    program.chmod(program.stat().st_mode | stat.S_IXUSR)
    monkeypatch.setattr(sys, "executable", str(program))


def test_this_machine_can_draw_and_the_text_is_short(clean: pytest.MonkeyPatch) -> None:
    found = examine()

    assert found.is_healthy, found.text()
    assert found.remedy is None
    assert found.text().startswith("Millpond can draw here.\n  device 0")
    assert len(found.text().splitlines()) == 1 + len(found.devices)


def test_a_device_is_named_by_its_driver_with_version_and_kind(clean: pytest.MonkeyPatch) -> None:
    working = [device for device in examine().devices if device.is_working]

    assert all(device.renderer and device.version and device.vendor for device in working)
    assert all(device.is_software == ("llvmpipe" in (device.renderer or "")) for device in working)


def test_a_vendor_file_that_is_not_there_is_named_and_the_variable_that_names_it_is_dropped(
    clean: pytest.MonkeyPatch,
) -> None:
    clean.setenv("__EGL_VENDOR_LIBRARY_FILENAMES", "/nowhere/50_broken.json")
    found = examine()

    assert not found.is_healthy
    assert "EGL finds no device" in found.text()
    assert "/nowhere/50_broken.json: no library, No such file or directory" in found.text()
    assert "set       __EGL_VENDOR_LIBRARY_FILENAMES=/nowhere/50_broken.json" in found.text()
    assert found.remedy == "unset __EGL_VENDOR_LIBRARY_FILENAMES"


@pytest.mark.parametrize("content", ["", "[]", '{"ICD": {}}', "not JSON"])
def test_a_vendor_file_without_a_library_is_called_so(clean: pytest.MonkeyPatch, tmp_path: Path, content: str) -> None:
    vendor = tmp_path / "vendor.json"
    vendor.write_text(content)
    clean.setenv("__EGL_VENDOR_LIBRARY_FILENAMES", str(vendor))

    assert f"{vendor}: no library, is not a vendor file" in examine().text()


def test_a_vendor_file_with_a_missing_library_gives_the_loaders_words(
    clean: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    vendor = tmp_path / "vendor.json"
    vendor.write_text(json.dumps({"ICD": {"library_path": "libEGL_nobody.so.9"}}))
    clean.setenv("__EGL_VENDOR_LIBRARY_FILENAMES", str(vendor))

    assert "libEGL_nobody.so.9, cannot open shared object file" in examine().text()


@pytest.mark.skipif(not Path(MESA).exists(), reason="needs Mesa's drivers")
def test_a_driver_that_cannot_be_loaded_fails_at_its_step_with_the_drivers_own_words(
    clean: pytest.MonkeyPatch,
) -> None:
    clean.setenv("__EGL_VENDOR_LIBRARY_FILENAMES", MESA)
    clean.setenv("LIBGL_DRIVERS_PATH", "/nowhere")
    found = examine("cpu")

    assert [device.failed_at for device in found.devices] == ["context"] * len(found.devices)
    assert "/nowhere" in (found.devices[-1].problem or "")
    assert found.remedy == "unset __EGL_VENDOR_LIBRARY_FILENAMES LIBGL_DRIVERS_PATH"


def test_a_probe_that_crashes_is_a_finding(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    probe_that(tmp_path, monkeypatch, "echo driver: assertion failed >&2; kill -SEGV $$")

    assert examine().crash == "crashed with SIGSEGV; driver: assertion failed"
    assert "the search for devices crashed with SIGSEGV" in examine().text()


def test_a_probe_that_hangs_is_a_finding(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    probe_that(tmp_path, monkeypatch, "exec sleep 60")
    monkeypatch.setattr(doctor, "PATIENCE", 0.2)

    assert (examine().crash or "").startswith("gave no answer within")


def test_one_of_the_two_opengl_libraries_is_enough() -> None:
    gone = Library("libOpenGL.so.0", "gone")

    assert report().missing == ()
    assert report(libraries=(Library("libEGL.so.1", "gone"), gone)).missing == ("libEGL.so.1", "libOpenGL.so.0")


@pytest.mark.parametrize(
    ("demand", "devices", "is_met"),
    [
        ("any", (SOFTWARE,), True),
        ("cpu", (SOFTWARE,), True),
        ("gpu", (SOFTWARE,), False),
        ("gpu", (SOFTWARE, HARDWARE), True),
        ("cpu", (HARDWARE,), False),
        ("any", (), False),
    ],
)
def test_a_demand_is_met_by_its_own_kind_and_by_no_other(
    demand: doctor.Demand, devices: tuple[Device, ...], is_met: bool
) -> None:
    found = report(*devices, demand=demand)

    assert found.is_healthy == is_met
    assert ("as demanded" in found.text()) == (bool(devices) and not is_met)


@pytest.mark.parametrize(
    ("os_release", "command"),
    [
        ("ID=debian\n", "apt-get"),
        ("ID=linuxmint\nID_LIKE=ubuntu\n", "apt-get"),
        ('ID="rocky"\nID_LIKE="rhel centos fedora"\n', "dnf"),
        ("ID=alpine\n", "apk"),
        ("ID=arch\n", "pacman"),
    ],
)
def test_the_command_is_the_distributions_own(tmp_path: Path, os_release: str, command: str) -> None:
    path = tmp_path / "os-release"
    path.write_text(os_release)

    assert command in remedy.install_command(path).split()


def test_an_unknown_distribution_is_told_in_words(tmp_path: Path) -> None:
    assert remedy.install_command(tmp_path / "os-release") == remedy.IN_WORDS


def test_each_part_of_the_command_is_run_by_sudo_where_one_is_not_root(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(os, "geteuid", lambda: 1000)
    monkeypatch.setattr(remedy, "INSTALL", {"debian": "apt-get update && apt-get install x"})
    monkeypatch.setattr(remedy, "family", lambda _: "debian")

    assert remedy.install_command() == "sudo apt-get update && sudo apt-get install x"


def test_missing_libraries_are_mended_by_the_install_command(monkeypatch: pytest.MonkeyPatch) -> None:
    facts = {"libraries": {"libEGL.so.1": "cannot open", "libOpenGL.so.0": None}, "vendor_files": [], "devices": []}
    monkeypatch.setattr(doctor, "_run", lambda *_: facts)
    found = examine()

    assert "libEGL.so.1 cannot be loaded" in found.verdict
    assert "libEGL.so.1: cannot open" in found.text()
    assert found.remedy == remedy.install_command()
    assert doctor.missing_libraries() == ("libEGL.so.1",)


def test_the_report_survives_json(clean: pytest.MonkeyPatch) -> None:
    found = examine()

    assert json.loads(json.dumps(found.to_dict()))["devices"][0]["renderer"] == found.devices[0].renderer


def test_the_command_ends_with_one_where_millpond_cannot_draw() -> None:
    broken = {**os.environ, "__EGL_VENDOR_LIBRARY_FILENAMES": "/nowhere/x.json"}
    done = subprocess.run(
        [sys.executable, "-m", "renderer.doctor"], env=broken, capture_output=True, text=True, check=False
    )

    assert done.returncode == 1
    assert "This mends it:\n  unset __EGL_VENDOR_LIBRARY_FILENAMES" in done.stdout
