"""Pages for people: the front page with a live frame, the API's page, and one page for each kind of problem."""

from __future__ import annotations

from html import escape
from typing import Any

from fastapi import APIRouter, Request
from fastapi.responses import HTMLResponse, JSONResponse

from service.problem_kinds import KINDS
from service.problems import Problem
from service.routes.html import page

router = APIRouter(include_in_schema=False)

FRONT = """
<h1>Millpond</h1>
<p class="lead">Reflective and refractive water, drawn without a display. A frame is a pure function of its request.</p>
<img class="frame" id="frame" alt="The pond, as the controls below describe it" src="/v1/frame.jpg?msaa=4">
<form id="controls">
<label>time <output></output>
<input type="range" name="time" min="0" max="20" step="0.25" value="0" data-unit=" s"></label>
<label>sun, height <output></output>
<input type="range" name="sun.elevation" min="4" max="80" step="1" value="38" data-unit="°"></label>
<label>sun, direction <output></output>
<input type="range" name="sun.azimuth" min="0" max="355" step="5" value="135" data-unit="°"></label>
<label>water, refraction bias <output></output>
<input type="range" name="water.refraction_bias" min="-0.6" max="0.8" step="0.05" value="0.1" data-unit=""></label>
<label>water, ripples <output></output>
<input type="range" name="water.ripple_height" min="0" max="3" step="0.1" value="1" data-unit=""></label>
</form>
<p class="lead" id="facts">&nbsp;</p>
<h2>The same frame from a shell</h2>
<pre><button type="button" data-copies="curl">copy</button><code id="curl"
>curl -o frame.png 'http://127.0.0.1:8000/v1/frame.png'</code></pre>
<h2>The same frame from Python</h2>
<pre><button type="button" data-copies="python">copy</button><code id="python"
>import millpond

millpond.Millpond("http://127.0.0.1:8000").frame().save("frame.png")</code></pre>
<h2>More</h2>
<nav><a href="/docs">API</a><a href="/openapi.json">OpenAPI</a><a href="/v1/techniques">techniques</a>
<a href="/v1/scenes">scenes</a><a href="/v1/formats">formats</a><a href="/v1/limits">limits</a>
<a href="/v1/info">this server</a><a href="/problems">errors</a></nav>
"""

SCRIPT = """
const form = document.getElementById('controls'), image = document.getElementById('frame');
const facts = document.getElementById('facts'), text = id => document.getElementById(id);
let pending = null, shown = '';
function fields() {
  return [...form.querySelectorAll('input')].filter(i => i.value !== i.defaultValue).map(i => [i.name, i.value]);
}
function describe() {
  for (const i of form.querySelectorAll('input'))
    i.closest('label').querySelector('output').textContent = i.value + i.dataset.unit;
  const query = fields().map(([n, v]) => n + '=' + v).join('&');
  text('curl').textContent = "curl -o frame.png '" + location.origin + '/v1/frame.png' + (query && '?' + query) + "'";
  const nested = {};
  for (const [name, value] of fields()) {
    const [outer, inner] = name.split('.');
    if (inner) (nested[outer] ??= {})[inner] = Number(value); else nested[outer] = Number(value);
  }
  const said = Object.entries(nested).map(([n, v]) => n + '=' + JSON.stringify(v)).join(', ');
  text('python').textContent = 'import millpond\\n\\nmillpond.Millpond("' + location.origin + '").frame(' + said +
    ').save("frame.png")';
  return query;
}
async function draw() {
  const query = describe();
  if (query === shown) return;
  shown = query;
  pending?.abort();
  pending = new AbortController();
  try {
    const answer = await fetch('/v1/frame.jpg?msaa=4' + (query && '&' + query), {signal: pending.signal});
    if (!answer.ok) { facts.textContent = (await answer.json()).detail; return; }
    const old = image.src;
    image.src = URL.createObjectURL(await answer.blob());
    if (old.startsWith('blob:')) URL.revokeObjectURL(old);
    facts.textContent = answer.headers.get('X-Renderer') + ' · ' + answer.headers.get('Server-Timing');
  } catch (error) { if (error.name !== 'AbortError') facts.textContent = String(error); }
}
let timer = 0;
form.addEventListener('input', () => { describe(); clearTimeout(timer); timer = setTimeout(draw, 120); });
for (const button of document.querySelectorAll('button[data-copies]'))
  button.addEventListener('click', () => navigator.clipboard.writeText(text(button.dataset.copies).textContent));
describe();
"""


@router.get("/")
async def front() -> HTMLResponse:
    """A live frame, a few controls, and the calls that draw the same."""
    return page("Millpond", FRONT, SCRIPT)


@router.get("/openapi.json")
async def openapi(request: Request) -> JSONResponse:
    """The OpenAPI document."""
    return JSONResponse(request.app.openapi())


@router.get("/docs")
async def docs(request: Request) -> HTMLResponse:
    """The OpenAPI document as a page."""
    document = request.app.openapi()
    parts = [
        "<h1>The API</h1>",
        f'<p class="lead">{escape(document["info"]["description"])}</p>',
        '<nav><a href="/">Millpond</a><a href="/openapi.json">OpenAPI document</a><a href="/problems">errors</a></nav>',
    ]
    for path, methods in document["paths"].items():
        for method, operation in methods.items():
            parts.append(_operation(f"{method.upper()} {path}", operation))
    return page("Millpond: the API", "".join(parts))


def _operation(title: str, operation: dict[str, Any]) -> str:
    rows = "".join(
        f"<tr><td><code>{escape(parameter['name'])}</code></td><td>{escape(parameter.get('description', ''))}</td></tr>"
        for parameter in operation.get("parameters", ())
    )
    table = f"<details><summary>parameters</summary><table>{rows}</table></details>" if rows else ""
    content = operation.get("requestBody", {}).get("content", {})
    body = "".join(f"<p>Body: <code>{escape(kind)}</code>{_schema_name(facts)}</p>" for kind, facts in content.items())
    answers = "".join(
        f"<tr><td>{escape(str(status))}</td><td>{escape(answer.get('description', ''))}</td>"
        f"<td><code>{escape(', '.join(answer.get('content', {})))}</code></td></tr>"
        for status, answer in operation["responses"].items()
    )
    text = escape(operation.get("description", "")).replace("``", "").replace("\n\n", "<br>")
    return f"<h3>{escape(title)}</h3><p>{text}</p>{body}{table}<table>{answers}</table>"


def _schema_name(facts: dict[str, Any]) -> str:
    name = facts.get("schema", {}).get("$ref", "").rpartition("/")[2]
    return f", schema <code>{escape(name)}</code> of the OpenAPI document" if name else ""


@router.get("/problems")
async def problems() -> HTMLResponse:
    """Every kind of problem."""
    rows = "".join(
        f'<tr><td>{kind.status}</td><td><a href="{kind.path}">{escape(kind.title)}</a></td></tr>'
        for kind in sorted(KINDS.values(), key=lambda kind: kind.status)
    )
    return page("Millpond: errors", f'<h1>Errors</h1><p class="lead">What they mean.</p><table>{rows}</table>')


@router.get("/problems/{name}")
async def problem(name: str) -> HTMLResponse:
    """What a kind of problem means, and how to mend it."""
    kind = KINDS.get(name)
    if kind is None:
        raise Problem("not-found", "There is no such kind of problem; they are listed under /problems.")
    return page(
        f"Millpond: {kind.title}",
        f'<h1>{escape(kind.title)}</h1><p class="lead">HTTP status {kind.status} · <code>{kind.name}</code></p>'
        f"<h2>What it means</h2><p>{escape(kind.meaning)}</p><h2>How to mend it</h2><p>{escape(kind.mend)}</p>"
        '<nav><a href="/problems">all errors</a><a href="/docs">API</a></nav>',
    )
