"""The web service round the renderer: workers, frames, jobs, HTTP and the command line."""
