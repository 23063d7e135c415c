"""The kinds of problem that the service answers with: data for the bodies and for the pages under /problems."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass


@dataclass(frozen=True)
class Kind:
    """A kind of problem: what the page under ``/problems/{name}`` says."""

    name: str
    status: int
    title: str
    meaning: str
    mend: str

    @property
    def path(self) -> str:
        """The path of the kind's page, which is also its ``type``."""
        return f"/problems/{self.name}"


KINDS: Mapping[str, Kind] = {
    kind.name: kind
    for kind in (
        Kind(
            "invalid-request",
            422,
            "The request is not valid",
            "A field is unknown, of the wrong type, out of its bounds, or two fields contradict each other. Each entry "
            "of errors names one mistake: the field's path as you wrote it, the value, and the bound.",
            "Correct the fields that errors names. The schemas with all bounds are under /docs and /v1/techniques; "
            "the caps of this server are under /v1/limits.",
        ),
        Kind(
            "malformed-body",
            400,
            "The body is not JSON",
            "The body could not be read as one JSON value in UTF-8.",
            "Send one JSON object, as a JSON library writes it.",
        ),
        Kind(
            "malformed-request",
            400,
            "The request is not HTTP",
            "The bytes that came could not be read as an HTTP/1.1 request, or its head is too long.",
            "Use an HTTP client; keep addresses and headers below 128 kB together.",
        ),
        Kind(
            "unknown-host",
            421,
            "This server does not answer for that host",
            "The Host header names neither loopback, nor the bound address, nor one of the hosts that the operator "
            "allowed. This guards against DNS rebinding and poisoned links.",
            "Use the address that the server printed at its start, or have the operator add the name to "
            "MILLPOND_ALLOWED_HOSTS.",
        ),
        Kind(
            "unauthorized",
            401,
            "An API key is needed",
            "This server asks for an API key, and the request carried none, or one that it does not know.",
            "Send the key as 'Authorization: Bearer KEY' or as 'X-API-Key: KEY'.",
        ),
        Kind(
            "cross-origin-write",
            403,
            "A page of another origin may not write here",
            "A browser sent this request for a page that another origin served; only GET and HEAD are open to those.",
            "Call from a page of this service or from a program, or have the operator add the origin to "
            "MILLPOND_ALLOWED_ORIGINS.",
        ),
        Kind(
            "not-found",
            404,
            "There is nothing here",
            "No resource has this path.",
            "Look up the paths under /docs.",
        ),
        Kind(
            "unknown-job",
            404,
            "No such job",
            "No job of this server has that id.",
            "Look up the jobs under /v1/jobs, or submit the job again.",
        ),
        Kind(
            "unknown-frame",
            404,
            "The job has no such frame",
            "A job's frames are numbered from 0; this number lies past the last, or is none.",
            "Look up the job's frames under /v1/jobs/{id}/frames.",
        ),
        Kind(
            "unknown-product",
            404,
            "The job has no such product",
            "A job's products are its archive, its movie and its contact sheet.",
            "Look up the job's links at its own address.",
        ),
        Kind(
            "expired-job",
            410,
            "The job has expired",
            "The job ended long ago, and its frames and products were dropped.",
            "Submit the job again; frames that are still kept are not rendered again.",
        ),
        Kind(
            "method-not-allowed",
            405,
            "This path does not take that method",
            "The path exists, but not for this method. The Allow header lists those that it takes.",
            "Use one of the methods of the Allow header.",
        ),
        Kind(
            "job-unfinished",
            409,
            "The job is not finished",
            "The product of a job exists once all its frames are drawn. The body carries the progress so far.",
            "Ask again after the seconds in Retry-After, or follow the job at its own address.",
        ),
        Kind(
            "product-incomplete",
            409,
            "The product will not come",
            "Frames of the job failed or were lost, and a product that lacks frames is never handed out. The body "
            "names the missing frames.",
            "Retry the job, or submit it again: frames that are kept are not rendered again.",
        ),
        Kind(
            "job-state",
            409,
            "The job's state does not allow that",
            "The job has ended in a way that has no such product, or its state does not allow this change.",
            "Look at the job's state and at its failed frames; submit the job again if need be.",
        ),
        Kind(
            "idempotency-conflict",
            422,
            "This Idempotency-Key was used for another request",
            "A job was made with this Idempotency-Key and a different body.",
            "Use a new key for a new job, and the same key only to repeat the same request.",
        ),
        Kind(
            "missing-image",
            422,
            "An image of the request is not where it is drawn",
            "The request names an uploaded image that was here when the request came, and is missing or damaged now, "
            "or is not on the machine that draws.",
            "Upload the image again with POST /v1/images; its id stays the same.",
        ),
        Kind(
            "too-large",
            413,
            "The body is too large",
            "The body has more bytes than this server reads; the cap is in bound.",
            "Send a shorter body. The caps are under /v1/limits.",
        ),
        Kind(
            "url-too-long",
            414,
            "The address is too long",
            "Path and query have more bytes than this server reads; the cap is in bound.",
            "Send the request as a JSON body to POST /v1/frame.",
        ),
        Kind(
            "unsupported-media-type",
            415,
            "The body is not of a type that is read here",
            "The Content-Type of the body is not the one that this path reads.",
            "Send JSON with 'Content-Type: application/json'; images go to /v1/images as 'multipart/form-data'.",
        ),
        Kind(
            "range-not-satisfiable",
            416,
            "The file has no such range",
            "The Range header asks for bytes past the end of the file.",
            "Ask for a range within the length that Content-Range states.",
        ),
        Kind(
            "queue-full",
            503,
            "Too much work is waiting",
            "The frames that wait are predicted to take longer than this server lets callers wait.",
            "Ask again after the seconds in Retry-After. Work that can wait belongs in POST /v1/jobs.",
        ),
        Kind(
            "not-ready",
            503,
            "The renderer is not ready",
            "Not every worker has drawn its canary frame: they are starting, or something keeps them from drawing. The "
            "detail says what is known.",
            "Ask again after the seconds in Retry-After. If it stays, run 'millpond doctor' on the server.",
        ),
        Kind(
            "no-device",
            503,
            "No OpenGL device can be used",
            "The renderer found no EGL device that meets the demand; the detail is the doctor's report.",
            "Follow the doctor's report: it names the one command that mends it.",
        ),
        Kind(
            "stopping",
            503,
            "The server is stopping",
            "The server was told to stop and takes no new work; jobs go on when it is back.",
            "Ask again after the seconds in Retry-After.",
        ),
        Kind(
            "renderer-crashed",
            503,
            "The process that drew the frame ended",
            "The worker process ended while it drew this frame. Other frames are not affected.",
            "Ask again after the seconds in Retry-After.",
        ),
        Kind(
            "frame-set-aside",
            503,
            "This frame ended two processes and is set aside",
            "The process that drew this frame died, the frame was tried once more alone, and that process died too. "
            "Other frames are not affected.",
            "Please report it with the frame's key. The server tries it again after the seconds in Retry-After.",
        ),
        Kind(
            "store-unavailable",
            503,
            "The store does not answer",
            "Frames or jobs could not be read or written just now.",
            "Ask again after the seconds in Retry-After. If it stays, look at the server's disk and log.",
        ),
        Kind(
            "deadline",
            504,
            "The frame took too long",
            "The frame was not drawn by its deadline, and its process was ended.",
            "Ask for fewer pixels or samples. Deadlines follow from the predicted cost.",
        ),
        Kind(
            "render-failed",
            500,
            "The frame could not be drawn",
            "The renderer refused to hand out an image that it can't vouch for.",
            "Please report it with the frame's key and the detail.",
        ),
        Kind(
            "internal-error",
            500,
            "Something went wrong in the server",
            "An error that the server does not expect; its log has the whole story under the request_id.",
            "Please report it with the request_id.",
        ),
    )
}
