"""The one command that mends a machine on which nothing can be drawn, in the words of its distribution."""

from __future__ import annotations

import os
from pathlib import Path

INSTALL = {
    "debian": "apt-get update && apt-get install -y --no-install-recommends "
    "libegl1 libopengl0 libegl-mesa0 libgl1-mesa-dri",
    "fedora": "dnf install -y libglvnd-egl libglvnd-opengl mesa-libEGL mesa-dri-drivers",
    "alpine": "apk add mesa-egl mesa-gl mesa-dri-gallium",
    "arch": "pacman -S --needed --noconfirm libglvnd mesa",
}
"""By the family of /etc/os-release (ID, else ID_LIKE): what installs EGL, OpenGL and Mesa's software driver."""

RELATIVES = {"ubuntu": "debian", "rhel": "fedora", "centos": "fedora"}
IN_WORDS = "install libEGL.so.1, libOpenGL.so.0 and Mesa's EGL and DRI drivers with your package manager"


def install_command(os_release: Path = Path("/etc/os-release")) -> str:
    """What installs EGL, OpenGL and Mesa here: a command, or the same in words on a distribution not known here."""
    command = INSTALL.get(family(os_release))
    if command is None:
        return IN_WORDS
    if os.geteuid() == 0:
        return command
    return " && ".join(f"sudo {part}" for part in command.split(" && "))


def open_command(device_file: str) -> str | None:
    """What lets this user open a GPU's device file: None where the user may already, or its group has no name."""
    path = Path(device_file)
    if not path.exists() or os.access(path, os.R_OK | os.W_OK):
        return None
    try:
        return f'sudo usermod -aG {path.group()} "$USER"   # then log in again: {path} is closed to this user'
    except KeyError:
        return None


def gpu_command() -> str:
    """What to do where hardware is demanded and EGL shows none."""
    if Path("/dev/nvidiactl").exists():
        return (
            "install NVIDIA's EGL library; in a container: docker run --gpus all -e NVIDIA_DRIVER_CAPABILITIES=graphics"
        )
    if Path("/dev/dri").exists():
        return install_command()
    return "no command can: this machine has no GPU that EGL can see; demand 'any' or 'cpu' to draw in software"


def family(os_release: Path) -> str:
    """The distribution's family as `INSTALL` names it, "" where the file does not tell."""
    try:
        lines = os_release.read_text().splitlines()
    except OSError:
        return ""
    facts = dict(line.split("=", 1) for line in lines if "=" in line)
    names = [facts.get(key, "").strip("\"'") for key in ("ID", "ID_LIKE")]
    words = [RELATIVES.get(word, word) for name in names for word in name.split()]
    return next((word for word in words if word in INSTALL), "")
