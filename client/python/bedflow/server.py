"""Servers and jobs."""
from __future__ import annotations

import os
import pathlib
import time
import uuid
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from google.protobuf import json_format, text_format

from bedflow.v1 import case_pb2, fields_pb2, job_pb2, service_pb2

from .checksum import crc32c
from .connection import CALL_SECONDS, Connection, Error, may_come_back
from .contexts import Context, PathLike, read_context
from .results import Field, FieldParts, Profile, Reduced, Series

PART_BYTES = 1 << 20
CaseLike = case_pb2.Case | str | os.PathLike[str]
Range = tuple[float | None, float | None]

_ENDED = {job_pb2.SUCCEEDED, job_pb2.FAILED, job_pb2.STATE_CANCELLED, job_pb2.STATE_SUSPENDED}


def read_case(case: CaseLike) -> case_pb2.Case:
    """A case from a message, from text (protobuf text format or JSON), or from a file."""
    if isinstance(case, case_pb2.Case):
        return case
    text = str(case)
    if isinstance(case, os.PathLike) or "\n" not in text and "{" not in text:
        text = pathlib.Path(case).read_text(encoding="utf-8")
    message = case_pb2.Case()
    return json_format.Parse(text, message) if text.lstrip().startswith("{") else text_format.Parse(text, message)


def _state_name(state: int) -> str:
    return job_pb2.JobState.Name(state).removeprefix("STATE_")


class Server:
    """A connection to a bedflowd. Use it in a with statement, or close it."""

    def __init__(self, context: Context):
        self._connection = Connection(context)

    def __enter__(self) -> Server:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        self._connection.close()

    def info(self) -> service_pb2.ServerInfo:
        return self._connection.call(self._connection.stub.GetServerInfo, service_pb2.GetServerInfoRequest())

    def job(self, job_id: str) -> Job:
        """A job that is there. Raises Error (JOB_NOT_FOUND)."""
        job = Job(self._connection, job_id)
        job.refresh()
        return job

    def jobs(self, states: Sequence[str] = (), labels: Mapping[str, str] | None = None) -> Iterator[Job]:
        """All jobs, newest first."""
        request = service_pb2.ListJobsRequest(page_size=1000, labels=labels or {})
        for state in states:
            prefix = "" if state in job_pb2.JobState.keys() else "STATE_"
            request.states.append(job_pb2.JobState.Value(prefix + state))
        while True:
            page = self._connection.call(self._connection.stub.ListJobs, request)
            for message in page.jobs:
                yield Job(self._connection, message.id, message)
            if not page.next_page_token:
                return
            request.page_token = page.next_page_token

    def submit(self, case: CaseLike | None = None, *, ranks: int = 1, start_from: Job | None = None, step: int | None = None,
               labels: Mapping[str, str] | None = None, checkpoint_every: float | None = None,
               wall_limit: float | None = None, requeue: bool = False, executor: str | None = None, priority: int = 0,
               spec: str = "") -> Job:
        """Hands a case to the server; the job is safe once this returns. start_from: begin at a checkpoint of that job (the newest,
        or that of a step), without a case with its own. wall_limit: s an attempt; requeue: go on after it when its turn comes
        again. executor: "local" or "slurm". spec: what else a JobSpec holds, as in "checkpoints { keep: 4 when_disk_full: GO_ON }".
        Raises Error with all faults of the case."""
        request = self._request(case, ranks, labels, checkpoint_every, wall_limit)
        if requeue:
            request.spec.at_wall_limit = job_pb2.JobSpec.REQUEUE
        if executor is not None:
            request.spec.executor = executor
        if priority:
            request.spec.priority = priority
        text_format.Merge(spec, request.spec)
        request.request_id = str(uuid.uuid4())  # makes a retry harmless
        if start_from is not None:
            request.start_from.job = start_from.id
            if step is not None:
                request.start_from.step = step
        message = self._connection.call(self._connection.stub.CreateJob, request).job
        return Job(self._connection, message.id, message)

    def plan(self, case: CaseLike, *, ranks: int = 1) -> Any:
        """Every check, and what the case requires (PlanReport); no job."""
        request = self._request(case, ranks, None, None, None)
        request.validate_only = True
        return self._connection.call(self._connection.stub.CreateJob, request).plan

    def import_checkpoint(self, file: str | os.PathLike[str], *, ranks: int | None = None) -> Job:
        """A suspended job of a checkpoint file: resume it, or start others from it."""
        path = pathlib.Path(file)

        def parts() -> Iterator[service_pb2.ImportCheckpointRequest]:
            head = service_pb2.ImportCheckpointRequest.Head(bytes=path.stat().st_size, request_id=str(uuid.uuid4()))
            if ranks is not None:
                head.spec.ranks = ranks
            yield service_pb2.ImportCheckpointRequest(head=head)
            with path.open("rb") as source:
                offset = 0
                while data := source.read(PART_BYTES):
                    yield service_pb2.ImportCheckpointRequest(offset=offset, data=data, crc32c=crc32c(data))
                    offset += len(data)

        message = self._connection.call(self._connection.stub.ImportCheckpoint, parts(), 3600)
        return Job(self._connection, message.id, message)

    @staticmethod
    def _request(case: CaseLike | None, ranks: int, labels: Mapping[str, str] | None, checkpoint_every: float | None,
                 wall_limit: float | None) -> service_pb2.CreateJobRequest:
        request = service_pb2.CreateJobRequest()
        if case is not None:
            request.case.CopyFrom(read_case(case))
        request.spec.ranks = ranks
        request.spec.labels.update(labels or {})
        if checkpoint_every is not None:
            request.spec.checkpoints.every_simulated_seconds = checkpoint_every
        if wall_limit is not None:
            request.spec.wall_limit_seconds = wall_limit
        return request


def connect(address: str | None = None, *, ca: PathLike | None = None, certificate: PathLike | None = None, key: PathLike | None = None,
            token: PathLike | None = None, context: str | None = None) -> Server:
    """A server by its address, "unix:/path/bedflowd.sock", "127.0.0.1:port" or, over TLS, "host:port"; or by the name of a context of
    `bedflow context`; or, without either, the one that `bedflow` would take. Nothing is sent yet.

    ca, certificate, key and token are files: the authorities that may vouch for the server (the system's if absent), the client's own
    certificate and key for servers that ask for one, and the token. A key or a token that others may read raises PermissionError."""
    if address is None:
        if any((ca, certificate, key, token)):
            raise ValueError("ca, certificate, key and token go with an address; a context has its own")
        return Server(read_context(context))
    if context is not None:
        raise ValueError("an address and a context both name a server")
    return Server(Context(address, ca, certificate, key, token))


class Job:
    """One job of a server. What it shows is as of the last call that told; refresh() asks again."""

    def __init__(self, connection: Connection, job_id: str, message: service_pb2.Job | None = None):
        self._connection = connection
        self.id = job_id
        self.message = message or service_pb2.Job(id=job_id)

    def __repr__(self) -> str:
        return f"<Job {self.id} {self.message.case_name!r} {self.state}>"

    @property
    def state(self) -> str:
        return _state_name(self.message.state)

    @property
    def has_ended(self) -> bool:
        """No engine runs, and none will without a command."""
        return self.message.state in _ENDED

    @property
    def progress(self) -> job_pb2.Progress:
        return self.message.progress

    def refresh(self) -> Job:
        return self._told(self._connection.stub.GetJob, service_pb2.GetJobRequest(id=self.id))

    def case(self) -> case_pb2.Case:
        request = service_pb2.GetJobRequest(id=self.id, with_case=True)
        return self._connection.call(self._connection.stub.GetJob, request).case

    # ---- following

    def watch(self, *, history: bool = True, away: float = 120) -> Iterator[job_pb2.Event]:
        """Events in order, none twice, until the job has ended; the stream is taken up again when it breaks."""
        request = service_pb2.WatchJobRequest(id=self.id, from_now=not history)
        for answer in self._resumed(self._connection.stub.WatchJob, request, away):
            if answer.HasField("job"):
                self.message = answer.job
            request.after_sequence = max(request.after_sequence, answer.sequence)
            if request.after_sequence:
                request.from_now = False
            if answer.HasField("event"):
                yield answer.event
            if self.has_ended and request.after_sequence >= self.message.last_sequence:
                return

    def wait(self, timeout: float | None = None) -> Job:
        """Until the job has ended. Raises TimeoutError, and Error (the reason of its end) when it has failed."""
        deadline = None if timeout is None else time.monotonic() + timeout
        while not self.refresh().has_ended:
            if deadline is not None and time.monotonic() > deadline:
                raise TimeoutError(f"job {self.id} is still {self.state} after {timeout} s")
            time.sleep(0.2)
        if self.message.state == job_pb2.FAILED:
            raise Error(job_pb2.StopReason.Name(self.message.reason), self.message.message, f"bedflow logs {self.id}")
        return self

    # ---- commands

    def cancel(self, *, skip_checkpoint: bool = False) -> Job:
        return self._told(self._connection.stub.CancelJob,
                          service_pb2.CancelJobRequest(id=self.id, skip_checkpoint=skip_checkpoint))

    def suspend(self) -> Job:
        return self._told(self._connection.stub.SuspendJob, service_pb2.SuspendJobRequest(id=self.id))

    def resume(self, *, step: int | None = None, ranks: int | None = None) -> Job:
        return self._told(self._connection.stub.ResumeJob, service_pb2.ResumeJobRequest(id=self.id, step=step, ranks=ranks))

    def delete(self) -> int:
        """With all that it left. Returns the bytes that are free again."""
        return self._connection.call(self._connection.stub.DeleteJob, service_pb2.DeleteJobRequest(id=self.id)).freed_bytes

    # ---- statistics

    def series_names(self) -> list[str]:
        answer = self._connection.call(self._connection.stub.ListSeries, service_pb2.ListSeriesRequest(id=self.id))
        return [one.monitor.name for one in answer.series]

    def statistics(self, *names: str, time_range: Range = (None, None), most: int | None = None) -> dict[str, Series | Profile]:
        """Monitors so far, by name; all if none is named. most: thin each series to so many groups of samples."""
        request = service_pb2.QueryStatisticsRequest(id=self.id, names=names, from_time=time_range[0], to_time=time_range[1],
                                                     most=most)
        answer = self._connection.call(self._connection.stub.QueryStatistics, request)
        return {**{one.name: Series.of(one) for one in answer.series}, **{one.name: Profile.of(one) for one in answer.profiles}}

    def follow_statistics(self, *names: str, away: float = 120) -> Iterator[tuple[str, int, float, float]]:
        """(name, step, time, value) of each sample as it comes, until the job has ended. After a resume earlier steps come again."""
        request = service_pb2.StreamStatisticsRequest(id=self.id, names=names)
        monitors: list[str] = []
        for answer in self._resumed(self._connection.stub.StreamStatistics, request, away):
            if answer.HasField("schema"):
                monitors = [one.name for one in answer.schema.monitors]
            request.after_record = answer.record
            for record in answer.records:
                if record.WhichOneof("what") == "sample":
                    sample = record.sample
                    yield monitors[sample.monitor], sample.step, sample.time, sample.value

    # ---- fields

    def slice(self, *quantities: str, axis: str = "z", at: float | None = None, step: int | None = None, fresh: bool = False,
              **region: Range) -> Field:
        """The layer of cells across an axis that holds a place (m). region: x=, y=, z= as (low, high), either of them None."""
        query = self._query(quantities, region)
        query.slice.axis = self._axis(axis)
        if at is not None:
            query.slice.place = at
        return self._ask(query, step, fresh).field()

    def profile(self, *quantities: str, axis: str = "y", bins: int | None = None, step: int | None = None, fresh: bool = False,
                **region: Range) -> Field:
        """Means along an axis; beside each quantity its _minimum, _maximum, and _volume of cells or _count of particles."""
        query = self._query(quantities, region)
        query.profile.axis = self._axis(axis)
        if bins is not None:
            query.profile.bins = bins
        return self._ask(query, step, fresh).field()

    def sample(self, *quantities: str, most: int = 1000, seed: int = 0, step: int | None = None, fresh: bool = False,
               **region: Range) -> Field:
        """Some of the particles in a region; the same seed gives the same ones, at other steps too."""
        query = self._query(quantities, region)
        query.sample.most = most
        query.sample.seed = seed
        return self._ask(query, step, fresh).field()

    def reduce(self, *quantities: str, bins: int | None = None, step: int | None = None, fresh: bool = False,
               **region: Range) -> dict[str, Reduced]:
        """Minimum, maximum, mean, deviation and integral of each quantity over a region, with a histogram if bins are asked for."""
        query = self._query(quantities, region)
        query.reduction.SetInParent()
        if bins is not None:
            query.reduction.histogram_bins = bins
        return self._ask(query, step, fresh).reduced()

    # ---- checkpoints

    def checkpoints(self) -> list[service_pb2.Checkpoint]:
        """Newest first."""
        request = service_pb2.ListCheckpointsRequest(id=self.id)
        return list(self._connection.call(self._connection.stub.ListCheckpoints, request).checkpoints)

    def checkpoint_now(self, timeout: float = CALL_SECONDS) -> service_pb2.Checkpoint:
        request = service_pb2.CreateCheckpointRequest(id=self.id, timeout_seconds=timeout)
        return self._connection.call(self._connection.stub.CreateCheckpoint, request, timeout + 10)

    def verify(self, step: int | None = None) -> list[str]:
        """What is wrong with a checkpoint, by dataset and block; nothing if it is good."""
        request = service_pb2.VerifyCheckpointRequest(name=self._name(step))
        answer = self._connection.call(self._connection.stub.VerifyCheckpoint, request, 3600)
        return [f"{fault.path}: {fault.text}" if fault.path else fault.text for fault in answer.faults]

    def download(self, file: str | os.PathLike[str], step: int | None = None, away: float = 120) -> pathlib.Path:
        """Writes a checkpoint to a file, which is there when it is whole."""
        path = pathlib.Path(file)
        part = path.with_name(path.name + ".part")
        request = service_pb2.DownloadCheckpointRequest(name=self._name(step), offset=0)
        with part.open("wb") as target:
            for answer in self._resumed(self._connection.stub.DownloadCheckpoint, request, away):
                if answer.HasField("seal"):
                    request.seal, request.name.step = answer.seal, answer.step
                if answer.offset != request.offset or crc32c(answer.data) != answer.crc32c:
                    raise Error("BAD_PART", f"the part at byte {answer.offset} came damaged or out of turn")
                target.write(answer.data)
                request.offset += len(answer.data)
            target.flush()
            os.fsync(target.fileno())
        return part.rename(path)

    # ---- within

    def _told(self, method: Any, request: Any) -> Job:
        self.message = self._connection.call(method, request)
        return self

    def _name(self, step: int | None) -> service_pb2.CheckpointName:
        return service_pb2.CheckpointName(job=self.id, step=step)

    @staticmethod
    def _axis(axis: str) -> int:
        return {"x": fields_pb2.FIELD_X, "y": fields_pb2.FIELD_Y, "z": fields_pb2.FIELD_Z}[axis]

    @staticmethod
    def _query(quantities: Sequence[str], region: Mapping[str, Range]) -> fields_pb2.FieldQuery:
        query = fields_pb2.FieldQuery(quantities=quantities)
        for axis, (low, high) in region.items():
            if axis not in "xyz":
                raise TypeError(f"a region has x, y and z, not {axis}")
            if low is not None:
                setattr(query.region, f"{axis}_low", low)
            if high is not None:
                setattr(query.region, f"{axis}_high", high)
        return query

    def _ask(self, query: fields_pb2.FieldQuery, step: int | None, fresh: bool) -> FieldParts:
        request = service_pb2.QueryFieldRequest(name=self._name(step), query=query, fresh=fresh)
        parts = FieldParts()
        for part in self._connection.stream(self._connection.stub.QueryField, request):
            parts.take(part)
        return parts

    def _resumed(self, method: Any, request: Any, away: float) -> Iterator[Any]:
        """The answers of a stream that is asked for again, with the request as it then is, while the server is away."""
        heard = time.monotonic()
        while True:
            try:
                for answer in self._connection.stream(method, request):
                    heard = time.monotonic()
                    yield answer
                return
            except Error as error:
                if not may_come_back(error) or time.monotonic() - heard > away:
                    raise
                time.sleep(0.3)
