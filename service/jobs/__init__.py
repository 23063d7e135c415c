"""Jobs: requests with a state, durable, drawn by a dispatcher, put together into products."""

from service.jobs.office import Jobs
from service.jobs.view import FramePage, JobPage, JobView

__all__ = ["FramePage", "JobPage", "JobView", "Jobs"]
