"""The doctor: what drawing needs, what of it is here, and the one command that mends what is not.

One text serves as exception message, problem detail, command output and documentation. Everything that touches a driver
runs in processes of its own (`renderer.gpu.probe`): a driver that crashes or hangs is a finding, not the end.
"""

from __future__ import annotations

import json
import os
import re
import signal
import subprocess
import sys
from collections.abc import Mapping
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any, Literal

from renderer.remedy import gpu_command, install_command, open_command

Demand = Literal["any", "gpu", "cpu"]

PROBE = "renderer.gpu.probe"
PATIENCE = 20.0
"""Seconds given to one probe; a working driver answers in a fifth of one."""

SWITCHES = (
    "__EGL_VENDOR_LIBRARY_FILENAMES",
    "__EGL_VENDOR_LIBRARY_DIRS",
    "EGL_PLATFORM",
    "GALLIUM_DRIVER",
    "LIBGL_ALWAYS_SOFTWARE",
    "LIBGL_DRIVERS_PATH",
    "MESA_LOADER_DRIVER_OVERRIDE",
    "LP_NATIVE_VECTOR_WIDTH",
)
"""Variables by which the environment steers EGL and Mesa, and by which it can break them."""

SOFTWARE_NAMES = re.compile(r"llvmpipe|softpipe|swrast|swiftshader", re.IGNORECASE)


@dataclass(frozen=True)
class Library:
    """A system library, looked for by its soname. `problem` is the loader's answer, None where it loads."""

    soname: str
    problem: str | None


@dataclass(frozen=True)
class VendorFile:
    """A file that names a driver to libEGL (glvnd's ICD), the library that it names, and why that does not load."""

    path: str
    library: str | None
    problem: str | None


@dataclass(frozen=True)
class Device:
    """One EGL device and how far a frame got on it: context, shader, draw, read back."""

    index: int
    renderer: str | None
    """GL_RENDERER once a context exists, before that what EGL calls the device."""
    vendor: str | None
    version: str | None
    extensions: tuple[str, ...]
    file: str | None
    """The kernel's device file, None for a software device."""
    is_software: bool
    failed_at: str | None
    problem: str | None
    seconds: float | None

    @property
    def is_working(self) -> bool:
        """A triangle was drawn and read back right."""
        return self.failed_at is None

    def __str__(self) -> str:
        version = self.version and f"OpenGL {self.version}"
        kind = "software" if self.is_software else "hardware"
        end = "works" if self.is_working else f"fails at {self.failed_at}: {self.problem}"
        return f"{', '.join(part for part in (self.renderer, version, kind) if part)}: {end}"


@dataclass(frozen=True)
class Report:
    """What an examination found. `remedy` is the one command that mends it, None where nothing needs mending."""

    demand: Demand
    """What was asked for: `gpu` hardware, `cpu` software, `any` either."""
    libraries: tuple[Library, ...]
    vendor_files: tuple[VendorFile, ...]
    devices: tuple[Device, ...]
    switches: Mapping[str, str]
    crash: str | None
    """How the survey itself ended, where it did not end well."""
    remedy: str | None = None

    @property
    def is_healthy(self) -> bool:
        """At least one device of the kind demanded draws."""
        return any(
            device.is_working and (self.demand == "any" or device.is_software == (self.demand == "cpu"))
            for device in self.devices
        )

    @property
    def missing(self) -> tuple[str, ...]:
        """Libraries without which nothing can be drawn. One OpenGL library of two is enough."""
        egl, *gl = self.libraries or (Library("libEGL.so.1", "not looked for"),)
        lacks = [egl.soname] if egl.problem else []
        if gl and all(library.problem for library in gl):
            lacks.append(" or ".join(library.soname for library in gl))
        return tuple(lacks)

    @property
    def verdict(self) -> str:
        """The first line of the text: whether Millpond can draw, and if not, why."""
        if self.is_healthy:
            return "Millpond can draw here."
        if self.crash:
            return f"Millpond cannot draw here: the search for devices {self.crash}."
        if self.missing:
            return f"Millpond cannot draw here: {' and '.join(self.missing)} cannot be loaded."
        if any(device.is_working for device in self.devices):
            return f"Millpond cannot draw here as demanded: no device of kind '{self.demand}' works."
        if self.devices:
            return "Millpond cannot draw here: no EGL device works."
        return "Millpond cannot draw here: EGL finds no device."

    def text(self) -> str:
        """The report as a person reads it: a few lines when all is well, everything that was tried when it is not."""
        lines = [self.verdict]
        if not self.is_healthy:
            lines += [f"  library   {library.soname}: {library.problem or 'loads'}" for library in self.libraries]
            lines += [
                f"  driver    {file.path}: {file.library or 'no library'}, {file.problem or 'loads'}"
                for file in self.vendor_files
            ]
        if not self.is_healthy and not self.vendor_files:
            lines.append("  driver    no file in /etc/glvnd/egl_vendor.d or /usr/share/glvnd/egl_vendor.d names one")
        lines += [f"  device {device.index}  {device}" for device in self.devices]
        lines += [f"  set       {name}={value}" for name, value in self.switches.items()]
        if self.remedy:
            lines += ["This mends it:", f"  {self.remedy}"]
        return "\n".join(lines)

    def to_dict(self) -> dict[str, Any]:
        """The report as JSON-like data, the verdict included."""
        return {"healthy": self.is_healthy, "verdict": self.verdict, **asdict(self)}


def examine(demand: Demand = "any") -> Report:
    """Survey libraries, vendor files and devices, and try each device. Takes 0.1 s, and 0.2 s more a device."""
    environment = dict(os.environ)
    report = _examine(environment, demand)
    return report if report.is_healthy else replace(report, remedy=_remedy(report, environment))


def missing_libraries() -> tuple[str, ...]:
    """The quick look: sonames that do not load. Empty where drawing may be tried."""
    return _survey(dict(os.environ), "any")[0].missing


def _examine(environment: Mapping[str, str], demand: Demand) -> Report:
    report, listed = _survey(environment, demand)
    return replace(report, devices=tuple(_device(device, environment) for device in listed))


def _survey(environment: Mapping[str, str], demand: Demand) -> tuple[Report, list[dict[str, Any]]]:
    """The report without its devices, and what EGL says of each device before it is tried."""
    found = _run(environment)
    report = Report(
        demand=demand,
        libraries=tuple(Library(*entry) for entry in found.get("libraries", {}).items()),
        vendor_files=tuple(VendorFile(**entry) for entry in found.get("vendor_files", ())),
        devices=(),
        switches={name: environment[name] for name in SWITCHES if name in environment},
        crash=found.get("problem"),
    )
    return report, found.get("devices", [])


def _device(listed: Mapping[str, Any], environment: Mapping[str, str]) -> Device:
    tried = _run(environment, str(listed["index"]))
    renderer = tried.get("renderer") or listed["name"]
    named_software = bool(SOFTWARE_NAMES.search(renderer or ""))
    return Device(
        index=listed["index"],
        renderer=renderer,
        vendor=tried.get("vendor"),
        version=tried.get("version"),
        extensions=tuple(listed["extensions"]),
        file=listed["file"],
        is_software=named_software or "EGL_MESA_device_software" in listed["extensions"],
        failed_at=tried.get("failed_at"),
        problem=tried.get("problem"),
        seconds=tried.get("seconds"),
    )


def _remedy(report: Report, environment: Mapping[str, str]) -> str:
    """Drop the variables that break what works without them; else open the GPU to this user; else install."""
    plain = {name: value for name, value in environment.items() if name not in SWITCHES}
    if report.switches and _examine(plain, report.demand).is_healthy:
        return "unset " + " ".join(report.switches)
    closed = [open_command(device.file) for device in report.devices if device.file and not device.is_working]
    if any(closed):
        return next(command for command in closed if command)
    return gpu_command() if report.demand == "gpu" else install_command()


def _run(environment: Mapping[str, str], *arguments: str) -> dict[str, Any]:
    """Run the probe in a process of its own. A crash or a hang comes back as `failed_at` and `problem`."""
    try:
        done = subprocess.run(  # noqa: S603 - our own module under our own interpreter
            [sys.executable, "-m", PROBE, *arguments],
            capture_output=True,
            text=True,
            timeout=PATIENCE,
            check=False,
            cwd=Path(__file__).parents[1],
            env=environment,
        )
    except subprocess.TimeoutExpired:
        return {"failed_at": "probe", "problem": f"gave no answer within {PATIENCE:.0f} s"}
    # Drivers say the useful thing on stderr, and say it several times.
    said = list(dict.fromkeys(line.strip() for line in done.stderr.splitlines() if line.strip()))[-2:]
    if done.returncode:
        ended = f"crashed with {signal.Signals(-done.returncode).name}" if done.returncode < 0 else "failed"
        return {"failed_at": "probe", "problem": "; ".join([ended, *said])}
    facts: dict[str, Any] = json.loads(done.stdout.splitlines()[-1])
    if facts.get("problem"):
        facts["problem"] = "; ".join([facts["problem"], *said])
    return facts


def main() -> int:
    """Print the report; 0 where Millpond can draw. `--install` prints what installs missing libraries, or nothing."""
    if sys.argv[1:] == ["--install"]:
        sys.stdout.write(f"{install_command()}\n" if missing_libraries() else "")
        return 0
    report = examine()
    sys.stdout.write(report.text() + "\n")
    return 0 if report.is_healthy else 1


if __name__ == "__main__":
    sys.exit(main())
