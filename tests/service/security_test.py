"""Who gets in over TLS, how far, and for how long; what is kept of secrets. On the real server and the real engine."""
import concurrent.futures
import itertools
import os
import pathlib
import secrets
import shutil
import socket
import tempfile
import time
import unittest

import bedflow
import grpc
from bedflow.v1 import access_pb2, fields_pb2, job_pb2, service_pb2, study_pb2
from real_server import bed, wait_until
from secure_server import OTHERS, SERVICE, SecureServer, make_certificates, outcome, path_of, reason_of

READ, SUBMIT, ADMIN = access_pb2.READ, access_pb2.SUBMIT, access_pb2.ADMIN
OK, UNAUTHENTICATED, DENIED = grpc.StatusCode.OK, grpc.StatusCode.UNAUTHENTICATED, grpc.StatusCode.PERMISSION_DENIED


def setUpModule():
    global server, foreign
    server = unittest.enterModuleContext(SecureServer())
    foreign = unittest.enterModuleContext(SecureServer(wants_certificates=True))


def methods():
    """Every method that the server has, with the scope that its schema asks for."""
    return {path_of(method): method.GetOptions().Extensions[access_pb2.needs] for method in SERVICE.methods} | OTHERS


def submit(token, case=None):
    """A job of the token's owner."""
    request = service_pb2.CreateJobRequest(case=bedflow.read_case(case or bed(end=0.002)))
    return server.stub(token).CreateJob(request).job.id


class EveryMethod(unittest.TestCase):
    def test_has_a_scope(self):
        self.assertEqual([path for path, scope in methods().items() if scope == access_pb2.SCOPE_NONE], [])

    def test_turns_away_who_shows_no_good_token(self):
        good, revoked, brief = server.token("alice", ADMIN), server.token("alice", ADMIN), server.token("alice", ADMIN, seconds=0.5)
        server.revoke(revoked)
        info = path_of(SERVICE.methods_by_name["GetServerInfo"])
        late = server.channel(brief)
        self.assertTrue(wait_until(lambda: outcome(late, info)[0] == UNAUTHENTICATED))
        another = f"bedflow_{good.id}_{secrets.token_hex(32)}"
        callers = {
            "none": (server.channel(), "TOKEN_MISSING"),
            "malformed": (server.channel("admin"), "TOKEN_MALFORMED"),
            "cut": (server.channel(good.text[:-1]), "TOKEN_MALFORMED"),
            "wrong secret": (server.channel(another), "TOKEN_UNKNOWN"),
            "foreign": (server.channel(foreign.token("alice", ADMIN)), "TOKEN_UNKNOWN"),
            "revoked": (server.channel(revoked), "TOKEN_UNKNOWN"),
            "expired": (late, "TOKEN_EXPIRED"),
        }
        for path, (name, (channel, reason)) in itertools.product([*methods(), "/nothing/AtAll"], callers.items()):
            with self.subTest(method=path, token=name):
                code, message = outcome(channel, path)
                self.assertEqual(code, UNAUTHENTICATED, message)
                self.assertTrue(message.endswith(f"[{reason}]"), message)

    def test_lets_each_scope_as_far_as_it_goes(self):
        for scope in (READ, SUBMIT, ADMIN):
            channel = server.channel(server.token("alice", scope))
            for path, needed in methods().items():
                with self.subTest(method=path, scope=access_pb2.Scope.Name(scope)):
                    code, message = outcome(channel, path)
                    self.assertNotEqual(code, UNAUTHENTICATED, message)
                    if scope < needed:
                        self.assertEqual(code, DENIED, message)
                        self.assertTrue(message.endswith("[SCOPE_TOO_SMALL]"), message)
                    else:
                        self.assertNotEqual(code, DENIED, message)
            self.assertEqual(outcome(channel, "/nothing/AtAll")[0], DENIED)

    def test_takes_one_bearer_token_in_the_header_and_no_word_of_the_caller_s(self):
        token = server.token("alice", SUBMIT)
        info = path_of(SERVICE.methods_by_name["GetServerInfo"])
        channel = server.channel()
        self.assertEqual(outcome(channel, info, metadata=[("authorization", f"Bearer {token.text}")])[0], OK)
        for metadata in ([("authorization", token.text)], [("authorization", f"Basic {token.text}")],
                         [("authorization", f"Bearer {token.text}"), ("authorization", f"Bearer {token.text}")],
                         [("bedflow-caller", "local")], [("bedflow-caller", token.id)], [("Authorization-".lower(), f"Bearer {token.text}")]):
            with self.subTest(metadata=metadata):
                self.assertEqual(outcome(channel, info, metadata=metadata)[0], UNAUTHENTICATED)
        sly = server.stub(token).GetServerInfo(service_pb2.GetServerInfoRequest(), metadata=[("bedflow-caller", "local")])
        self.assertEqual((sly.caller, sly.caller_scope), ("alice", SUBMIT))
        there = server.local.GetServerInfo(service_pb2.GetServerInfoRequest(), metadata=[("bedflow-caller", token.id)])
        self.assertEqual((there.caller, there.caller_scope), ("local", ADMIN))


class Owners(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.alice, cls.bob, cls.admin = (server.token(*who) for who in (("alice", SUBMIT), ("bob", SUBMIT), ("carol", ADMIN)))
        cls.job = submit(cls.alice, bed(end=100))
        with server.connect_as(cls.alice) as there:
            assert wait_until(lambda: there.job(cls.job).state == "RUNNING")

    @classmethod
    def tearDownClass(cls):
        server.stub(cls.admin).CancelJob(service_pb2.CancelJobRequest(id=cls.job, skip_checkpoint=True))

    def test_own_what_they_submit(self):
        for stub in (server.local, server.stub(self.bob)):
            self.assertEqual(stub.GetJob(service_pb2.GetJobRequest(id=self.job)).owner, "alice")
        mine = server.stub(self.bob).ListJobs(service_pb2.ListJobsRequest(owner="alice", page_size=1000)).jobs
        self.assertIn(self.job, [job.id for job in mine])
        self.assertEqual({job.owner for job in mine}, {"alice"})
        self.assertEqual(list(server.stub(self.bob).ListJobs(service_pb2.ListJobsRequest(owner="nobody")).jobs), [])

    def test_are_alone_with_what_changes_a_job(self):
        """All methods that need more than reading and name a job, of today and of later."""
        tried = []
        for method in SERVICE.methods:
            request = method.input_type._concrete_class()
            fields = request.DESCRIPTOR.fields_by_name
            if method.GetOptions().Extensions[access_pb2.needs] != SUBMIT or "Study" in method.name:
                continue
            if "id" in fields:
                request.id = self.job
            elif "name" in fields:
                request.name.job = self.job
            else:
                continue
            tried.append(method.name)
            with self.subTest(method=method.name), self.assertRaises(grpc.RpcError) as caught:
                getattr(server.stub(self.bob), method.name)(request, timeout=20)
            if caught.exception.code() != grpc.StatusCode.UNIMPLEMENTED:
                self.assertEqual((caught.exception.code(), reason_of(caught.exception)), (DENIED, "NOT_OWNER"), method.name)
        self.assertLessEqual({"CancelJob", "SuspendJob", "ResumeJob", "DeleteJob", "CreateCheckpoint"}, set(tried))
        self.assertEqual(server.local.GetJob(service_pb2.GetJobRequest(id=self.job)).state, job_pb2.RUNNING)

    def test_are_alone_with_questions_that_have_the_job_write(self):
        request = service_pb2.QueryFieldRequest(name=service_pb2.CheckpointName(job=self.job), fresh=True)
        request.query.CopyFrom(fields_pb2.FieldQuery(quantities=["solids_fraction"], reduction={}))
        for token, reason in ((self.bob, "NOT_OWNER"), (server.token("alice", READ), "NOT_OWNER")):
            with self.assertRaises(grpc.RpcError) as caught:
                list(server.stub(token).QueryField(request, timeout=30))
            self.assertEqual((caught.exception.code(), reason_of(caught.exception)), (DENIED, reason))
        self.assertTrue(list(server.stub(self.alice).QueryField(request, timeout=30)))

    def test_can_be_stood_in_for_by_an_admin(self):
        job = submit(self.alice, bed(end=100))
        server.stub(self.admin).SuspendJob(service_pb2.SuspendJobRequest(id=job))
        with server.connect_as(self.bob) as there:
            there.job(job).wait(30)
        self.assertEqual(server.stub(self.alice).ResumeJob(service_pb2.ResumeJobRequest(id=job)).owner, "alice")
        server.stub(self.admin).CancelJob(service_pb2.CancelJobRequest(id=job, skip_checkpoint=True))

    def test_may_start_from_each_other_s_checkpoints_and_own_what_comes_of_it(self):
        with server.connect_as(self.alice) as mine, server.connect_as(self.bob) as theirs:
            job = mine.submit(bed(end=0.002)).wait(60)
            other = theirs.submit(start_from=theirs.job(job.id))
            self.assertEqual(other.message.owner, "bob")
            file = pathlib.Path(tempfile.mkdtemp(dir=server.path)) / "bed.h5"
            theirs.job(job.id).download(file)
            self.assertEqual(theirs.import_checkpoint(file).message.owner, "bob")

    def test_own_their_studies_and_the_runs_of_them(self):
        case = bedflow.read_case(bed(end=100))
        case.monitors[1].averaging.bin = 0.01
        spec = study_pb2.StudySpec(name="two", axes=["nothing"], quantities=[{"monitor": "bed_height"}], same_packing=False,
                                              points=[{"values": [str(i)], "case": case} for i in range(2)])
        stub, request = server.stub(self.alice), study_pb2.CreateStudyRequest(spec=spec, request_id="a-study-of-one")
        study = stub.CreateStudy(request).id
        self.assertNotEqual(server.stub(self.bob).CreateStudy(request).owner, "alice", "a request id of another")
        self.assertEqual(stub.CreateStudy(request).id, study)

        def told(who=self.bob):
            return server.stub(who).GetStudy(study_pb2.GetStudyRequest(id=study))
        self.assertTrue(wait_until(lambda: all(run.job for run in told().runs)))
        self.assertEqual(told().owner, "alice")
        self.assertEqual({server.local.GetJob(service_pb2.GetJobRequest(id=run.job)).owner for run in told().runs}, {"alice"})
        for name in ("CancelStudy", "DeleteStudy"):
            with self.assertRaises(grpc.RpcError) as caught:
                getattr(server.stub(self.bob), name)(SERVICE.methods_by_name[name].input_type._concrete_class(id=study))
            self.assertEqual((caught.exception.code(), reason_of(caught.exception)), (DENIED, "NOT_OWNER"))
        stub.CancelStudy(study_pb2.CancelStudyRequest(id=study))
        for other in server.local.ListStudies(study_pb2.ListStudiesRequest()).studies:
            if other.owner == "bob":
                server.stub(self.admin).CancelStudy(study_pb2.CancelStudyRequest(id=other.id))

    def test_do_not_meet_in_their_request_ids(self):
        request = service_pb2.CreateJobRequest(case=bedflow.read_case(bed(end=0.002)), request_id="the-same-id")
        jobs = [server.stub(token).CreateJob(request).job for token in (self.alice, self.bob, self.alice)]
        self.assertEqual(jobs[0].id, jobs[2].id)
        self.assertNotEqual(jobs[0].id, jobs[1].id)
        self.assertEqual([job.owner for job in jobs], ["alice", "bob", "alice"])
        request.case.time.end = 0.003
        with self.assertRaises(grpc.RpcError) as caught:
            server.stub(self.alice).CreateJob(request)
        self.assertEqual(reason_of(caught.exception), "REQUEST_ID_REUSED")

    def test_keep_their_jobs_over_a_restart_of_the_server(self):
        with SecureServer() as other:
            alice, bob = other.token("alice", SUBMIT), other.token("bob", SUBMIT)
            request = service_pb2.CreateJobRequest(case=bedflow.read_case(bed(end=100)))
            job = other.stub(alice).CreateJob(request).job.id
            other.kill()
            other.start()
            with self.assertRaises(grpc.RpcError) as caught:
                other.stub(bob).CancelJob(service_pb2.CancelJobRequest(id=job))
            self.assertEqual(reason_of(caught.exception), "NOT_OWNER")
            self.assertEqual(other.stub(alice).CancelJob(service_pb2.CancelJobRequest(id=job, skip_checkpoint=True)).owner, "alice")


class Tokens(unittest.TestCase):
    def test_end_the_streams_that_they_opened(self):
        """Revoked, or expired: watches and statistics of a job that goes on."""
        admin = server.token("carol", ADMIN)
        job = submit(admin, bed(end=100))
        self.addCleanup(server.stub(admin).CancelJob, service_pb2.CancelJobRequest(id=job, skip_checkpoint=True))
        revoked, brief = server.token("bob", READ), server.token("bob", READ, seconds=3)
        with concurrent.futures.ThreadPoolExecutor() as pool:
            def last_word(stream, begun):
                try:
                    for _ in stream:
                        begun.set_result(True) if not begun.done() else None
                except grpc.RpcError as failure:
                    return failure.code(), reason_of(failure)
                return None
            begins = [concurrent.futures.Future() for _ in range(4)]
            ends = []
            for token, begun in zip((revoked, revoked, brief, brief), begins, strict=True):
                stub = server.stub(token)
                call = (stub.WatchJob(service_pb2.WatchJobRequest(id=job), timeout=30) if len(ends) % 2 == 0 else
                        stub.StreamStatistics(service_pb2.StreamStatisticsRequest(id=job), timeout=30))
                ends.append(pool.submit(last_word, call, begun))
            for begun in begins:
                begun.result(20)
            server.revoke(revoked)
            for end in ends:
                self.assertEqual(end.result(30), (UNAUTHENTICATED, "TOKEN_ENDED"))

    def test_can_be_made_and_revoked_by_an_admin_from_afar(self):
        admin = server.token("carol", ADMIN)
        stub = server.stub(admin)
        made = server.token("dave", READ)
        self.assertIn(made.id, [token.id for token in stub.ListTokens(access_pb2.ListTokensRequest()).tokens])
        self.assertEqual([token for token in stub.ListTokens(access_pb2.ListTokensRequest()).tokens if token.secret_sha256], [])
        self.assertEqual([token.id for token in stub.RevokeToken(access_pb2.RevokeTokenRequest(owner="dave")).tokens], [made.id])
        with self.assertRaises(grpc.RpcError) as caught:
            stub.RevokeToken(access_pb2.RevokeTokenRequest(id=made.id))
        self.assertEqual(reason_of(caught.exception), "TOKEN_NOT_FOUND")

    def test_leave_no_secret_anywhere(self):
        token = server.token("erin", SUBMIT)
        wrong = f"bedflow_{token.id}_{secrets.token_hex(32)}"
        for shown in (token, wrong, f"x{token.text}"):
            channel = server.channel(shown)
            for path in methods():
                outcome(channel, path)
                outcome(channel, path, metadata=[("authorization", f"Bearer {token.text}")])
        submit(token)
        seen = 0
        for file in server.path.rglob("*"):
            if file.is_file() and not file.is_socket():
                content = file.read_bytes()
                seen += content.count(token.id.encode())
                for secret in [*server.secrets, wrong.rpartition("_")[2]]:
                    self.assertNotIn(secret.encode(), content, file)
                    self.assertNotIn(bytes.fromhex(secret), content, file)
        self.assertGreater(seen, 1, "the places where a token could be were not looked at")


class Attackers(unittest.TestCase):
    def test_cost_no_memory_with_what_they_send(self):
        """The request of a caller without a token is not taken in; nor is anything kept of it."""
        often = 10 if "BEDFLOW_LONG" in os.environ else 1
        big = secrets.token_bytes(1 << 20) * 16
        path = path_of(SERVICE.methods_by_name["CreateJob"])
        channel = server.channel(f"bedflow_{'0' * 12}_{'0' * 64}")
        outcome(channel, path, big)
        before = server.rss()
        with concurrent.futures.ThreadPoolExecutor(16) as pool:
            codes = set(pool.map(lambda _: outcome(channel, path, big)[0], range(often * 40)))
        self.assertEqual(codes, {UNAUTHENTICATED})
        for number in range(often * 1000):
            outcome(channel, path, metadata=[("authorization", f"Bearer bedflow_{number:012x}_{'0' * 64}")])
        self.assertLess(server.rss() - before, 48 << 20, "all that was offered: 0.6 GB, or 6 GB")

    def test_do_not_fill_the_log(self):
        log = server.path / "server.log"
        lines, of_grpc = log.read_text().count("turned away"), log.read_text().count("grpc: ")
        begin = time.monotonic()
        channel = server.channel()
        for _ in range(500):
            outcome(channel, "/x/" + "y" * 4000)
        port = int(server.network.rpartition(":")[2])
        for _ in range(200):  # no handshake comes of these: gRPC has a line for each
            with socket.create_connection(("127.0.0.1", port)) as one:
                one.sendall(b"GET / HTTP/1.1\r\n\r\n")
                one.shutdown(socket.SHUT_WR)
                one.recv(100)
        told = log.read_text().count("turned away") - lines
        self.assertLessEqual(log.read_text().count("grpc: ") - of_grpc, 4 * (time.monotonic() - begin + 2))  # each place of it by itself
        self.assertGreater(log.read_text().count("grpc: "), 0, "what gRPC says has gone elsewhere")
        self.assertLessEqual(told, time.monotonic() - begin + 2)
        self.assertLess(max(map(len, log.read_text().splitlines())), 1000)

    def test_that_say_nothing_or_nonsense_hold_nobody_up(self):
        port = int(server.network.rpartition(":")[2])
        hanging = [socket.create_connection(("127.0.0.1", port)) for _ in range(100)]
        for one, said in zip(hanging, itertools.cycle([b"", b"GET / HTTP/1.1\r\n\r\n", b"PRI * HTTP/2.0\r\n\r\nSM\r\n\r\n", bytes(200),
                                                       b"\x16\x03\x01\x02\x00" + secrets.token_bytes(512)])):
            one.sendall(said)
        code, message = outcome(server.channel(server.token("alice", READ)), path_of(SERVICE.methods_by_name["GetServerInfo"]))
        self.assertEqual(code, OK, message)
        for number, one in enumerate(hanging):
            with one:
                if "BEDFLOW_LONG" not in os.environ and number % 5 != 1:
                    continue  # those who spoke HTTP/1.1 are cut off at once, others when the handshake's ten seconds are over
                one.settimeout(15)
                try:
                    while one.recv(4096):
                        pass
                except ConnectionResetError:
                    pass

    def test_in_the_clear_get_nothing(self):
        channel = grpc.insecure_channel(server.network)
        code, _ = outcome(channel, path_of(SERVICE.methods_by_name["GetServerInfo"]))
        self.assertEqual(code, grpc.StatusCode.UNAVAILABLE)


class Certificates(unittest.TestCase):
    def info(self, where, channel):
        return outcome(channel, path_of(SERVICE.methods_by_name["GetServerInfo"]))[0]

    def test_of_clients_are_asked_for_besides_the_token(self):
        make_certificates(foreign.keys, "--client", "lab")
        stranger = pathlib.Path(tempfile.mkdtemp(dir=server.path))
        make_certificates(stranger, "--client", "lab")
        token = foreign.token("alice", READ)
        self.assertEqual(self.info(foreign, foreign.channel(token, certificate=(foreign.keys, "lab"))), OK)
        self.assertEqual(self.info(foreign, foreign.channel(certificate=(foreign.keys, "lab"))), UNAUTHENTICATED)
        self.assertEqual(self.info(foreign, foreign.channel(token)), grpc.StatusCode.UNAVAILABLE)
        self.assertEqual(self.info(foreign, foreign.channel(token, certificate=(stranger, "lab"))), grpc.StatusCode.UNAVAILABLE)

    def test_of_another_authority_or_name_are_not_believed_by_clients(self):
        stranger = pathlib.Path(tempfile.mkdtemp(dir=server.path))
        make_certificates(stranger, "localhost")
        token = server.token("alice", READ)
        self.assertEqual(self.info(server, server.channel(token, ca=stranger / "ca.pem")), grpc.StatusCode.UNAVAILABLE)

    def test_are_renewed_without_a_restart_and_a_broken_one_shuts_nobody_out_for_good(self):
        with SecureServer() as other:
            token = other.token("alice", READ)
            before = other.channel(token)
            self.assertEqual(self.info(other, before), OK)
            renewed = pathlib.Path(tempfile.mkdtemp(dir=other.path))
            make_certificates(renewed, "localhost")
            (other.keys / "server.key").write_text("nonsense")
            shutil.copy(renewed / "server.pem", other.keys / "server.pem")
            shutil.copy(renewed / "server.key", other.keys / "server.key")
            self.assertTrue(wait_until(lambda: self.info(other, other.channel(token, ca=renewed / "ca.pem")) == OK))
            self.assertEqual(self.info(other, other.channel(token)), grpc.StatusCode.UNAVAILABLE)
            self.assertEqual(self.info(other, before), OK, "a connection that there was is not cut")
            shutil.copy(other.keys / "ca.key", other.keys / "server.key")  # a key that is not the certificate's
            self.assertTrue(wait_until(lambda: self.info(other, other.channel(token, ca=renewed / "ca.pem")) != OK))
            self.assertEqual(self.info(other, before), OK)
            shutil.copy(renewed / "server.key", other.keys / "server.key")
            self.assertTrue(wait_until(lambda: self.info(other, other.channel(token, ca=renewed / "ca.pem")) == OK))


if __name__ == "__main__":
    unittest.main()
