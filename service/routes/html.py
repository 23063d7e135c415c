"""The look of the service's own pages; nothing on them comes from another host."""

from __future__ import annotations

import base64
import hashlib
from html import escape

from starlette.responses import HTMLResponse

STYLE = """
:root { color-scheme: dark; --deep: #0c1b20; --shore: #12262c; --line: #24434b; --text: #dfe9e6; --quiet: #92aaa8;
  --reed: #b6cf6d; --sky: #8fd0df }
* { box-sizing: border-box }
body { margin: 0; background: var(--deep); color: var(--text); font: 16px/1.55 system-ui, sans-serif }
main { max-width: 62rem; margin: 0 auto; padding: 2rem 1.25rem 4rem }
h1 { font-size: 1.9rem; font-weight: 600; letter-spacing: -.01em; margin: 0 0 .2rem }
h2 { font-size: 1.15rem; margin: 2.4rem 0 .6rem; color: var(--sky) }
h3 { font-size: 1rem; margin: 1.6rem 0 .4rem; font-family: ui-monospace, monospace; color: var(--reed) }
a { color: var(--sky) }
p.lead { color: var(--quiet); margin: 0 0 1.4rem }
code, pre { font: .86rem/1.5 ui-monospace, monospace }
pre { background: var(--shore); border: 1px solid var(--line); border-radius: 8px; padding: .9rem 1rem;
  overflow-x: auto }
img.frame { display: block; width: 100%; aspect-ratio: 16 / 9; object-fit: cover; border-radius: 10px;
  background: var(--shore) }
form { display: grid; grid-template-columns: repeat(auto-fit, minmax(12rem, 1fr)); gap: .8rem 1.4rem; margin: 1rem 0 }
label { display: block; color: var(--quiet); font-size: .86rem }
label output { float: right; color: var(--text) }
input[type=range] { width: 100%; accent-color: var(--reed) }
table { border-collapse: collapse; width: 100%; font-size: .88rem }
td, th { text-align: left; vertical-align: top; padding: .35rem .8rem .35rem 0; border-top: 1px solid var(--line) }
th { color: var(--quiet); font-weight: 500 }
nav a { margin-right: 1.1rem }
button { background: none; border: 1px solid var(--line); border-radius: 6px; color: var(--quiet); cursor: pointer;
  float: right; font-size: .78rem; padding: .15rem .6rem }
button:hover { color: var(--text); border-color: var(--sky) }
"""


def page(title: str, body: str, script: str = "") -> HTMLResponse:
    """A whole page; ``body`` is HTML, ``script`` the only script that it may run."""
    digest = base64.b64encode(hashlib.sha256(script.encode()).digest()).decode()
    policy = [
        "default-src 'none'",
        "img-src 'self' data: blob:",
        "connect-src 'self'",
        "style-src 'unsafe-inline'",
        f"script-src 'sha256-{digest}'" if script else "script-src 'none'",
        "base-uri 'none'",
        "form-action 'none'",
        "frame-ancestors 'none'",
    ]
    tail = f"<script>{script}</script>" if script else ""
    text = (
        '<!doctype html><html lang="en"><head><meta charset="utf-8">'
        '<meta name="viewport" content="width=device-width, initial-scale=1"><link rel="icon" href="data:,">'
        f"<title>{escape(title)}</title><style>{STYLE}</style></head><body><main>{body}</main>{tail}</body></html>"
    )
    return HTMLResponse(text, headers={"Content-Security-Policy": "; ".join(policy), "Cache-Control": "no-cache"})
