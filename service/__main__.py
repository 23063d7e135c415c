"""The command line: ``millpond COMMAND``.

Exit codes: 0 done, 2 bad input, 3 no device to draw on, 4 failed, 130 interrupted.
"""

from __future__ import annotations

import importlib
import sys
from collections.abc import Mapping, Sequence

from renderer.errors import FieldProblem, InvalidRequest, MillpondError, NoDevice
from service.commands.options import HelpWanted, Usage

COMMANDS: Mapping[str, str] = {
    "serve": "serve frames, turntables and jobs over HTTP",
    "frame": "draw one frame into a file",
    "turntable": "draw a camera's way round a scene into a movie, an archive or a folder",
    "image": "keep an image of yours, so that requests may name it",
    "doctor": "say what drawing needs, and what of it is here",
}
DONE, BAD_INPUT, NO_DEVICE, FAILED, INTERRUPTED = 0, 2, 3, 4, 130


def main(arguments: Sequence[str] | None = None) -> int:
    """Run a command; its exit code."""
    words = list(sys.argv[1:] if arguments is None else arguments)
    if not words or words[0] in {"-h", "--help", "help"}:
        sys.stdout.write(overview() + "\n")
        return DONE if words else BAD_INPUT
    name, *rest = words
    try:
        return _run(name, rest)
    except KeyboardInterrupt:
        return _complain("interrupted", INTERRUPTED)
    except BrokenPipeError:  # the reader of a pipe has had enough
        sys.stderr.close()
        return FAILED
    except MillpondError as error:
        is_bad = isinstance(error, InvalidRequest | Usage)
        code = BAD_INPUT if is_bad else NO_DEVICE if isinstance(error, NoDevice) else FAILED
        mistakes = error.problems if isinstance(error, InvalidRequest) else ()
        return _complain("\n".join(map(told, mistakes)) or str(error), code)


def _run(name: str, arguments: Sequence[str]) -> int:
    if name not in COMMANDS:
        raise Usage(f"there is no command {name!r}; there are {', '.join(COMMANDS)}")
    command = importlib.import_module(f"service.commands.{name}")  # one command's imports, not everyone's
    try:
        return int(command.run(arguments))
    except HelpWanted:
        sys.stdout.write(command.help_page() + "\n")
        return DONE


def overview() -> str:
    """The commands and the exit codes."""
    lines = ["usage: millpond COMMAND [--help]", ""]
    lines += [f"  {name:<11}{text}" for name, text in COMMANDS.items()]
    codes = f"{DONE} done, {BAD_INPUT} bad input, {NO_DEVICE} no device, {FAILED} failed, {INTERRUPTED} interrupted"
    return "\n".join([*lines, "", f"exit codes: {codes}"])


def told(problem: FieldProblem) -> str:
    """A mistake in one line: path, message, value, bound."""
    path = problem.path or "the request"
    facts = [f"given {problem.value!r}"] if problem.value is not None else []
    facts += [f"allowed {problem.bound}"] if problem.bound else []
    return f"{path}: {problem.message}" + (f" ({'; '.join(facts)})" if facts else "")


def _complain(text: str, code: int) -> int:
    sys.stderr.write("".join(f"millpond: {line}\n" for line in text.splitlines()))
    return code


if __name__ == "__main__":
    sys.exit(main())
