"""Settings: from the environment, a file and the command line; none that is misspelt, none that is unsafe."""

from __future__ import annotations

from pathlib import Path

import pytest
from pydantic import ValidationError

from service.commands import serve
from service.commands.options import Usage
from service.settings import Limits, Settings, is_loopback, unknown_variables


@pytest.fixture(autouse=True)
def _no_settings_from_outside(monkeypatch: pytest.MonkeyPatch) -> None:
    import os  # noqa: PLC0415 -- this fixture alone

    for name in [name for name in os.environ if name.startswith("MILLPOND_")]:
        monkeypatch.delenv(name)


def test_the_environment_is_read_with_its_prefix(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("MILLPOND_PORT", "9001")
    monkeypatch.setenv("MILLPOND_LIMITS__PIXELS", "1000")
    monkeypatch.setenv("MILLPOND_API_KEYS", '["a", "b"]')
    settings = Settings()

    assert settings.port == 9001
    assert settings.limits.pixels == 1000
    assert settings.limits.width == Limits().width
    assert [key.get_secret_value() for key in settings.api_keys] == ["a", "b"]


def test_a_file_lies_beneath_the_environment(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    file = tmp_path / "millpond.toml"
    file.write_text("port = 9002\nworkers = 3\n[limits]\npixels = 77\n")
    monkeypatch.setenv("MILLPOND_CONFIG", str(file))
    monkeypatch.setenv("MILLPOND_PORT", "9003")
    settings = Settings()

    assert (settings.port, settings.workers, settings.limits.pixels) == (9003, 3, 77)
    file.write_text("prt = 1\n")
    with pytest.raises(ValidationError, match="prt"):
        Settings()


def test_a_misspelt_variable_is_noticed(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("MILLPOND_PROT", "1")
    monkeypatch.setenv("MILLPOND_LIMITS__PIXLES", "1")
    monkeypatch.setenv("MILLPOND_LIMITS__PIXELS", "10")

    assert unknown_variables() == ("MILLPOND_LIMITS__PIXLES", "MILLPOND_PROT")


@pytest.mark.parametrize("host", ["0.0.0.0", "::", "192.0.2.7", "millpond.example"])  # noqa: S104 -- that is the point
def test_an_open_address_needs_keys_or_a_word(host: str) -> None:
    with pytest.raises(ValidationError, match="not loopback"):
        Settings(host=host)

    assert Settings(host=host, api_keys=("secret",)).host == host
    assert Settings(host=host, allow_anonymous=True).host == host


def test_what_counts_as_loopback() -> None:
    assert all(is_loopback(host) for host in ("127.0.0.1", "127.8.9.1", "::1", "localhost"))
    assert not any(is_loopback(host) for host in ("0.0.0.0", "::", "10.0.0.1", "localhost.example"))  # noqa: S104 -- as above


def test_secrets_are_not_shown() -> None:
    assert "hush" not in repr(Settings(api_keys=("hush",)))


def test_options_of_serve_are_the_settings() -> None:
    page = serve.help_page()

    for name in Settings.model_fields:
        assert name == "limits" or f"--{name.replace('_', '-')} " in page
    for name in Limits.model_fields:
        assert f"--limits.{name.replace('_', '-')} " in page


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--prt=1"], "--prt: there is no such setting"),
        (["--port=x"], "--port: "),
        (["--port=70000"], "--port: "),
        (["--limits.pixels=0"], "--limits.pixels: "),
        (["--limits.pixles=9"], "--limits.pixles: there is no such setting"),
        (["--host=0.0.0.0"], "not loopback"),
        (["--require=tpu"], "--require: "),
        (["--port"], "--port needs a value"),
        (["somewhere"], "no arguments are taken"),
        (["--allowed-hosts=[1"], "--allowed-hosts is no JSON list"),
        (["--host=nowhere.invalid", "--allow-anonymous=true"], "can't be bound"),
    ],
)
def test_serve_refuses_what_it_does_not_understand(arguments: list[str], message: str) -> None:
    with pytest.raises(Usage) as refused:
        serve.run(arguments)

    assert message in str(refused.value)


def test_serve_never_repeats_a_key_that_it_refuses() -> None:
    with pytest.raises(Usage) as refused:
        serve.run(["--api-keys=[5]", "--port=x"])

    assert "5" not in str(refused.value).replace("api-keys", "")
