"""Server errors as exceptions with the server's details."""
from __future__ import annotations

import functools
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, Optional

import grpc

from mbcosim.v1 import common_pb2

if TYPE_CHECKING:
    from .calls import StepResult
    from .histories import History
    from .table import Rows


class Error(Exception):
    """A call was refused or failed.

    code      grpc.StatusCode
    reason    name of a `mbcosim.v1.Reason`: "WRONG_STEP", ...; empty when the server gave none
    metadata  particulars by name, as text
    field     of the request that is at fault; empty: none, or not known
    """

    def __init__(self, message: Optional[str], code: Any = None, reason: str = "", metadata: Optional[Mapping[str, str]] = None) -> None:
        super().__init__(message)
        self.code = code
        self.reason = reason
        self.metadata = dict(metadata or {})
        self.field = ""
        self.diagnostics: list[common_pb2.Diagnostic] = []
        self.failure: Optional[common_pb2.SolverFailure] = None


class DeckError(Error):
    """The deck is wrong; `diagnostics` has every finding."""

    def __str__(self) -> str:
        if not self.diagnostics:
            return super().__str__()
        return "\n".join(diagnostic_text(d) for d in self.diagnostics)


class NotFound(Error):
    """No such simulation, snapshot, variable, port or model."""


class PreconditionFailed(Error):
    """The call does not fit the simulation's state."""


class Busy(PreconditionFailed):
    """Another call advances the simulation at the moment; try again."""


class LimitExceeded(Error):
    """A limit of the server; its name is `metadata["limit"]`."""


class NotAllowed(Error):
    """Credentials are missing, wrong or too weak."""


class Unavailable(Error):
    """The server cannot be reached or is shutting down."""


class TimedOut(Unavailable):
    """A call took longer than its `timeout`. What it asked for may have happened, or happen yet."""


class StepFailed(Error):
    """A step failed; the simulation stands at its last accepted step.

    `failure` is a `mbcosim.v1.SolverFailure`; `result` the StepResult, None when the initial solution failed; `history` what
    Simulation.simulate had kept until then, else None.
    """

    result: Optional[StepResult] = None
    history: Optional[History] = None
    rows: Rows  # of which `history` is made


_CLASSES: dict[Any, type[Error]] = {
    grpc.StatusCode.NOT_FOUND: NotFound,
    grpc.StatusCode.FAILED_PRECONDITION: PreconditionFailed,
    grpc.StatusCode.RESOURCE_EXHAUSTED: LimitExceeded,
    grpc.StatusCode.UNAUTHENTICATED: NotAllowed,
    grpc.StatusCode.PERMISSION_DENIED: NotAllowed,
    grpc.StatusCode.UNAVAILABLE: Unavailable,
    grpc.StatusCode.DEADLINE_EXCEEDED: TimedOut,
}
_REASONS: dict[str, type[Error]] = {
    "DECK_ERROR": DeckError,
    "SIMULATION_BUSY": Busy,
    "NOT_CONVERGED": StepFailed,
    "SINGULAR": StepFailed,
    "EVALUATION": StepFailed,
    "PEER_LOST": StepFailed,
}


@functools.lru_cache(maxsize=1024)
def enum_name(kind: Any, value: int, prefix: str) -> str:
    """Name of a value without its prefix; one that this client does not know: "UNKNOWN_17"."""
    return str(kind.Name(value))[len(prefix):] if value in kind.values() else f"UNKNOWN_{value}"


def diagnostic_text(diagnostic: common_pb2.Diagnostic) -> str:
    """`file:line:column: error: message`, the line and a caret."""
    severity = {1: "error", 2: "warning", 3: "note"}.get(diagnostic.severity, "error")
    place = ":".join(str(part) for part in (diagnostic.file, diagnostic.line, diagnostic.column) if part)
    text = f"{place}: {severity}: {diagnostic.message}"
    if diagnostic.source_line:
        blanks = " " * max(diagnostic.column - 1, 0)
        text += f"\n  {diagnostic.source_line}\n  {blanks}{'^' * max(diagnostic.length, 1)}"
    return text + (f"\n  {diagnostic.hint}" if diagnostic.hint else "")


def _first_text(data: bytes) -> bytes:
    """The bytes of a message's first field, which is of bytes: `google.rpc` messages without their package."""
    size = shift = 0
    for at in range(1, len(data)):
        size |= (data[at] & 127) << shift
        shift += 7
        if data[at] < 128:
            return data[at + 1:at + 1 + size]
    return b""


def cancelled_here(rpc_error: Any) -> bool:
    """Was it this side that cancelled the call? gRPC answers one that comes while its server is being shut down with CANCELLED, too; its text is
    the code's name then, and nothing has been done."""
    return bool(rpc_error.code() == grpc.StatusCode.CANCELLED) and rpc_error.details() != "CANCELLED"


def from_rpc_error(rpc_error: Any) -> Error:
    """The exception that tells what a grpc.RpcError carries."""
    code = rpc_error.code()
    if code == grpc.StatusCode.CANCELLED and not cancelled_here(rpc_error):
        return Unavailable("the server is shutting down", grpc.StatusCode.UNAVAILABLE)
    if code == grpc.StatusCode.CANCELLED and rpc_error.details() == "Channel closed!":  # a text of gRPC's
        return Unavailable("the connection is closed", grpc.StatusCode.UNAVAILABLE)
    status = common_pb2.ErrorStatus()
    for key, value in rpc_error.trailing_metadata() or ():
        if key == "grpc-status-details-bin":
            status.ParseFromString(value)
    info, failure, field = common_pb2.ErrorInfo(), None, ""
    diagnostics: list[common_pb2.Diagnostic] = []
    for detail in status.details:
        if detail.type_url.endswith("google.rpc.ErrorInfo"):
            info.ParseFromString(detail.value)
        elif detail.type_url.endswith("google.rpc.BadRequest"):
            field = _first_text(_first_text(detail.value)).decode()
        elif detail.Is(common_pb2.SolverFailure.DESCRIPTOR):
            failure = common_pb2.SolverFailure.FromString(detail.value)
        elif detail.Is(common_pb2.DeckDiagnostics.DESCRIPTOR):
            diagnostics = list(common_pb2.DeckDiagnostics.FromString(detail.value).diagnostics)
    kind = _REASONS[info.reason] if info.reason in _REASONS else _CLASSES.get(code, Error)
    error = kind(rpc_error.details(), code, info.reason, info.metadata)
    error.failure, error.field = failure, field
    error.diagnostics = diagnostics
    return error


def bad_argument(field: str, message: str) -> Error:
    """What the server would say about a field of a request, where it cannot even be sent."""
    error = Error(message, grpc.StatusCode.INVALID_ARGUMENT, "BAD_ARGUMENT")
    error.field = field
    return error


class translated:
    """Context manager that turns grpc errors raised inside into exceptions of this module."""

    def __enter__(self) -> None:
        pass

    def __exit__(self, kind: object, error: Optional[BaseException], trace: object) -> None:
        if isinstance(error, grpc.RpcError):
            raise from_rpc_error(error) from None
