# ruff: noqa: INP001 -- Alembic loads it by its path
"""How Alembic runs the migrations: on the connection that the store hands it."""

from __future__ import annotations

from alembic import context

from service.jobs.schema import METADATA

context.configure(
    connection=context.config.attributes["connection"],
    target_metadata=METADATA,
    render_as_batch=True,
    transactional_ddl=True,
)
context.run_migrations()
