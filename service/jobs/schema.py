"""The job store's tables, and how a database gets them.

Written for SQLite and PostgreSQL alike. Every change is a migration under ``migrations``; the store brings its
database up to date when it opens it.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

from alembic import command
from alembic.config import Config
from sqlalchemy import (
    JSON,
    Column,
    Engine,
    Float,
    ForeignKey,
    Index,
    Integer,
    LargeBinary,
    MetaData,
    String,
    Table,
    create_engine,
    event,
)

MIGRATIONS = Path(__file__).with_name("migrations")
BUSY_SECONDS = 10
"""How long a writer waits for another one's transaction."""

METADATA = MetaData(
    naming_convention={
        "ix": "ix_%(table_name)s_%(column_0_N_name)s",
        "uq": "uq_%(table_name)s_%(column_0_N_name)s",
        "fk": "fk_%(table_name)s_%(column_0_N_name)s",
        "pk": "pk_%(table_name)s",
    }
)

JOBS = Table(
    "jobs",
    METADATA,
    Column("id", String(32), primary_key=True),
    Column("kind", String(16), nullable=False),
    Column("state", String(16), nullable=False),
    Column("spec", JSON, nullable=False),
    Column("total", Integer, nullable=False),
    Column("priority", Integer, nullable=False),
    Column("created", Float, nullable=False),
    Column("started", Float),
    Column("finished", Float),
    Column("error", JSON(none_as_null=True)),
    Column("idempotency_key", String(255), unique=True),
    Column("body_digest", String(64), nullable=False),
    Index(None, "state", "priority", "created"),
    Index(None, "created", "id"),
)
"""One row a job. ``body_digest`` tells whether an idempotency key comes with the same body again."""

FRAMES = Table(
    "frames",
    METADATA,
    Column("job_id", ForeignKey("jobs.id", ondelete="CASCADE"), primary_key=True),
    Column("number", Integer, primary_key=True),
    Column("rank", Integer, nullable=False),
    Column("state", String(8), nullable=False),
    Column("key", String(64), nullable=False),
    Column("request", LargeBinary, nullable=False),
    Column("fence", Integer, nullable=False, default=0),
    Column("lease_owner", String(64)),
    Column("lease_ends", Float),
    Column("attempts", Integer, nullable=False, default=0),
    Column("digest", String(64)),
    Column("size", Integer),
    Column("fingerprint", String(64)),
    Column("finished", Float),
    Column("error", JSON(none_as_null=True)),
    Index(None, "job_id", "state", "rank"),
)
"""One row a frame of a job.

``number`` is its index in the job, ``rank`` its place in the order of drawing; ``fence`` counts its leases.
"""


def open_database(url: str) -> Engine:
    """An engine on the database, which is brought up to date first."""
    engine = create_engine(url)
    if engine.dialect.name == "sqlite":
        event.listen(engine, "connect", _configure)
        event.listen(engine, "begin", _begin)
    _upgrade(engine)
    return engine


def _configure(connection: Any, _: object) -> None:
    """Set up a connection to SQLite.

    WAL lets readers and one writer work at the same time. ``synchronous=FULL`` makes what was acknowledged outlast a
    loss of power, at one fsync a transaction; hence transactions of many frames.
    """
    connection.isolation_level = None  # the driver's own idea of when to begin would break our transactions
    for pragma in (
        f"busy_timeout={BUSY_SECONDS * 1000}",
        "journal_mode=WAL",
        "synchronous=FULL",
        "foreign_keys=ON",
    ):
        connection.execute(f"PRAGMA {pragma}").close()


def _begin(connection: Any) -> None:
    """Begin as a writer at once where one writes: a reader that turns into one can be refused without waiting."""
    writes = connection.get_execution_options().get("writes", False)
    connection.exec_driver_sql("BEGIN IMMEDIATE" if writes else "BEGIN")


def _upgrade(engine: Engine) -> None:
    config = Config()
    config.set_main_option("script_location", str(MIGRATIONS))
    with engine.connect().execution_options(writes=True) as connection, connection.begin():
        config.attributes["connection"] = connection
        command.upgrade(config, "head")
