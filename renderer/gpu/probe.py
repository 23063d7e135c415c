"""One look at OpenGL from a process of its own, because a bad driver may take its process with it.

``python -m renderer.gpu.probe`` surveys libraries, vendor files and EGL devices; ``python -m renderer.gpu.probe INDEX``
tries device INDEX. Either prints one line of JSON. `renderer.doctor` runs both and makes a report of them.
"""

from __future__ import annotations

import ctypes
import json
import os
import sys
import time
from pathlib import Path
from typing import Any

EGL = "libEGL.so.1"
GL = ("libOpenGL.so.0", "libGL.so.1")
"""Either will do: the first needs no X11, the second is what older systems have."""

OPENGL = 450
"""The version that the renderer is written for; its glClipControl gives depth its precision."""

VENDOR_FOLDERS = ("/etc/glvnd/egl_vendor.d", "/usr/share/glvnd/egl_vendor.d")

# Numbers from the Khronos registry: EGL_EXT_device_query(_name), EGL_EXT_device_drm(_render_node).
EGL_EXTENSIONS = 0x3055
EGL_DEVICE_STRINGS = {"drm_file": 0x3233, "render_node": 0x3377, "vendor": 0x3053, "renderer": 0x335F}
MOST_DEVICES = 32

SIZE = 4
COLOR = (51, 102, 153, 255)
VERTEX = """#version 330 core
void main() {
    gl_Position = vec4(vec2((gl_VertexID << 1) & 2, gl_VertexID & 2) * 2.0 - 1.0, 0.0, 1.0);
}
"""
FRAGMENT = """#version 330 core
uniform vec4 color;
out vec4 pixel;
void main() { pixel = color / 255.0; }
"""


def survey() -> dict[str, Any]:
    """Libraries by soname, vendor files and EGL devices: what is there before a context is tried."""
    return {
        "libraries": {soname: _load(soname) for soname in (EGL, *GL)},
        "vendor_files": [_vendor_file(path) for path in vendor_files()],
        "devices": _devices(),
    }


def vendor_files() -> list[Path]:
    """The vendor files in the order in which libglvnd reads them; the environment's list replaces the folders."""
    named = os.environ.get("__EGL_VENDOR_LIBRARY_FILENAMES")
    if named:
        return [Path(name) for name in named.split(":") if name]
    folders = (os.environ.get("__EGL_VENDOR_LIBRARY_DIRS") or ":".join(VENDOR_FOLDERS)).split(":")
    return [path for folder in folders if folder for path in sorted(Path(folder).glob("*.json"))]


def device_settings(index: int) -> dict[str, Any]:
    """How `moderngl.create_context` opens EGL device `index`; sonames spare it a search by ldconfig and gcc."""
    gl = next((soname for soname in GL if _load(soname) is None), GL[0])
    return {"backend": "egl", "device_index": index, "libegl": EGL, "libgl": gl}


def attempt(index: int) -> dict[str, Any]:
    """Make a context on EGL device `index`, draw one triangle, read it back. `failed_at` names the step that failed."""
    facts: dict[str, Any] = {"index": index, "failed_at": "import"}
    began = time.perf_counter()
    try:
        import moderngl  # noqa: PLC0415 - the survey above must work where this import does not

        facts["failed_at"] = "context"
        context = moderngl.create_context(require=OPENGL, standalone=True, **device_settings(index))
        info = context.info
        facts |= {
            "vendor": info["GL_VENDOR"],
            "renderer": info["GL_RENDERER"],
            "version": info["GL_VERSION"],
            "failed_at": "shader",
        }
        program = context.program(vertex_shader=VERTEX, fragment_shader=FRAGMENT)
        program["color"] = COLOR
        facts["failed_at"] = "draw"
        target = context.simple_framebuffer((SIZE, SIZE))
        target.use()
        target.clear()
        context.vertex_array(program, []).render(vertices=3)
        facts["failed_at"] = "read back"
        pixels = target.read(components=4)
        if pixels == bytes(COLOR) * SIZE**2:
            facts["failed_at"] = None
        else:
            facts["problem"] = f"{tuple(pixels[:4])} was drawn where {COLOR} was asked for"
    except Exception as error:  # noqa: BLE001 - whatever the driver raises is the finding
        facts["problem"] = str(error) or type(error).__name__
    facts["seconds"] = round(time.perf_counter() - began, 3)
    return facts


def _load(soname: str) -> str | None:
    """None where the library loads, else the loader's words."""
    try:
        ctypes.CDLL(soname)
    except OSError as error:
        return str(error).removeprefix(f"{soname}: ")
    return None


def _vendor_file(path: Path) -> dict[str, Any]:
    facts: dict[str, Any] = {"path": str(path), "library": None, "problem": None}
    try:
        facts["library"] = json.loads(path.read_text())["ICD"]["library_path"]
    except OSError as error:
        facts["problem"] = error.strerror or str(error)
    except (ValueError, KeyError, TypeError):
        facts["problem"] = "is not a vendor file (JSON with ICD.library_path)"
    else:
        facts["problem"] = _load(facts["library"])
    return facts


def _devices() -> list[dict[str, Any]]:
    """Each EGL device with the strings that its driver gives before it is opened."""
    try:
        egl = ctypes.CDLL(EGL)
    except OSError:
        return []
    egl.eglGetProcAddress.restype = ctypes.c_void_p
    egl.eglGetProcAddress.argtypes = [ctypes.c_char_p]
    query_devices = egl.eglGetProcAddress(b"eglQueryDevicesEXT")
    query_string = egl.eglGetProcAddress(b"eglQueryDeviceStringEXT")
    if not query_devices or not query_string:
        return []
    handles = (ctypes.c_void_p * MOST_DEVICES)()
    count = ctypes.c_int32(0)
    devices_of = ctypes.CFUNCTYPE(
        ctypes.c_uint, ctypes.c_int32, ctypes.POINTER(ctypes.c_void_p), ctypes.POINTER(ctypes.c_int32)
    )(query_devices)
    string_of = ctypes.CFUNCTYPE(ctypes.c_char_p, ctypes.c_void_p, ctypes.c_int32)(query_string)
    if not devices_of(MOST_DEVICES, handles, ctypes.byref(count)):
        return []
    return [_device(index, handles[index], string_of) for index in range(count.value)]


def _device(index: int, handle: int | None, string_of: Any) -> dict[str, Any]:
    extensions = (string_of(handle, EGL_EXTENSIONS) or b"").decode().split()
    # A string may be asked for only where its extension is announced: some drivers crash otherwise.
    allowed = {
        "drm_file": "EGL_EXT_device_drm" in extensions,
        "render_node": "EGL_EXT_device_drm_render_node" in extensions,
        "vendor": "EGL_EXT_device_query_name" in extensions,
        "renderer": "EGL_EXT_device_query_name" in extensions,
    }
    strings = {name: string_of(handle, EGL_DEVICE_STRINGS[name]) for name, fits in allowed.items() if fits}
    return {
        "index": index,
        "extensions": extensions,
        "file": next((strings[name].decode() for name in ("render_node", "drm_file") if strings.get(name)), None),
        "name": " ".join(strings[name].decode() for name in ("vendor", "renderer") if strings.get(name)) or None,
    }


if __name__ == "__main__":
    sys.stdout.write(json.dumps(attempt(int(sys.argv[1])) if len(sys.argv) > 1 else survey()) + "\n")
