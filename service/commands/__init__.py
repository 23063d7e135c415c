"""The commands of `millpond`: one module each, with `run(arguments) -> exit code`."""
