# ruff: noqa: INP001 -- Alembic loads it by its path
"""Jobs and their frames."""

from __future__ import annotations

import sqlalchemy as sa
from alembic import op

revision = "0001"
down_revision = None
branch_labels = None
depends_on = None


def upgrade() -> None:
    """Make both tables."""
    op.create_table(
        "jobs",
        sa.Column("id", sa.String(32), nullable=False),
        sa.Column("kind", sa.String(16), nullable=False),
        sa.Column("state", sa.String(16), nullable=False),
        sa.Column("spec", sa.JSON(), nullable=False),
        sa.Column("total", sa.Integer(), nullable=False),
        sa.Column("priority", sa.Integer(), nullable=False),
        sa.Column("created", sa.Float(), nullable=False),
        sa.Column("started", sa.Float()),
        sa.Column("finished", sa.Float()),
        sa.Column("error", sa.JSON(none_as_null=True)),
        sa.Column("idempotency_key", sa.String(255)),
        sa.Column("body_digest", sa.String(64), nullable=False),
        sa.PrimaryKeyConstraint("id", name="pk_jobs"),
        sa.UniqueConstraint("idempotency_key", name="uq_jobs_idempotency_key"),
    )
    op.create_index("ix_jobs_state_priority_created", "jobs", ["state", "priority", "created"])
    op.create_index("ix_jobs_created_id", "jobs", ["created", "id"])
    op.create_table(
        "frames",
        sa.Column("job_id", sa.String(32), nullable=False),
        sa.Column("number", sa.Integer(), nullable=False),
        sa.Column("rank", sa.Integer(), nullable=False),
        sa.Column("state", sa.String(8), nullable=False),
        sa.Column("key", sa.String(64), nullable=False),
        sa.Column("request", sa.LargeBinary(), nullable=False),
        sa.Column("fence", sa.Integer(), nullable=False),
        sa.Column("lease_owner", sa.String(64)),
        sa.Column("lease_ends", sa.Float()),
        sa.Column("attempts", sa.Integer(), nullable=False),
        sa.Column("digest", sa.String(64)),
        sa.Column("size", sa.Integer()),
        sa.Column("fingerprint", sa.String(64)),
        sa.Column("finished", sa.Float()),
        sa.Column("error", sa.JSON(none_as_null=True)),
        sa.PrimaryKeyConstraint("job_id", "number", name="pk_frames"),
        sa.ForeignKeyConstraint(["job_id"], ["jobs.id"], name="fk_frames_job_id", ondelete="CASCADE"),
    )
    op.create_index("ix_frames_job_id_state_rank", "frames", ["job_id", "state", "rank"])


def downgrade() -> None:
    """Drop both tables."""
    op.drop_table("frames")
    op.drop_table("jobs")
