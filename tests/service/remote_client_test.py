"""The command line and the Python client against a server beyond the machine: contexts, tokens, and what they say when they are
turned away."""
import json
import os
import pathlib
import stat
import subprocess
import tempfile
import unittest
import unittest.mock

import bedflow
from bedflow.v1 import access_pb2, context_pb2, service_pb2
from google.protobuf import text_format
from real_server import BIN, bed, wait_until
from secure_server import SecureServer, SlowWay, make_certificates


def setUpModule():
    global server, strict
    server = unittest.enterModuleContext(SecureServer())
    strict = unittest.enterModuleContext(SecureServer(wants_certificates=True))


class RemoteClient(unittest.TestCase):
    def setUp(self):
        self.home = pathlib.Path(tempfile.mkdtemp(dir=server.path))
        self.environment = {key: value for key, value in os.environ.items() if not key.startswith("BEDFLOW_")}
        self.environment |= {"XDG_CONFIG_HOME": str(self.home / "config"), "XDG_STATE_HOME": str(self.home / "state")}

    def run_it(self, *words, **variables):
        return subprocess.run([BIN / "bedflow", *map(str, words)], capture_output=True, text=True, timeout=60, stdin=subprocess.DEVNULL,
                              env=self.environment | variables)

    def bedflow(self, *words, code=0, **variables):
        done = self.run_it(*words, **variables)
        self.assertEqual(done.returncode, code, done.stdout + done.stderr)
        return done

    def add(self, name, *more, server_address=None):
        return self.bedflow("context", "add", name, "--server", server_address or server.network, "--ca", server.keys / "ca.pem", *more)

    def token_file(self, owner, scope, *more):
        """Made by whoever runs the server, over its socket."""
        path = self.home / f"{owner}-{scope}.token"
        self.bedflow("server", "token", "create", owner, "--scope", scope, "--out", path, *more, "--server", server.address)
        return path

    def test_a_token_is_made_into_a_file_of_one_s_own_and_used_by_a_context(self):
        path = self.home / "alice.token"
        made = self.bedflow("server", "token", "create", "alice", "--scope", "submit", "--expires", "12h", "--out", path, "--server",
                            server.address)
        self.assertEqual(stat.S_IMODE(path.stat().st_mode), 0o600)
        secret = path.read_text().strip().rpartition("_")[2]
        self.assertNotIn(secret, made.stdout + made.stderr)
        self.add("lab", "--token", path)
        self.assertIn("alice, SUBMIT", self.bedflow("server", "info").stdout)
        case = self.home / "case.txtpb"
        case.write_text(bed(end=0.002))
        job = self.bedflow("submit", case).stdout.strip()
        self.bedflow("wait", job)
        self.assertEqual(json.loads(self.bedflow("get", job, "-o", "json").stdout)["owner"], "alice")
        self.assertIn(job, self.bedflow("list", "--owner", "alice").stdout)
        self.assertNotIn(job, self.bedflow("list", "--owner", "bob").stdout)
        self.bedflow("checkpoint", "download", job, "-o", self.home / "bed.h5")
        self.assertNotIn(secret, (self.home / "config/bedflow/contexts.txtpb").read_text())

    def test_contexts_are_added_listed_used_shown_and_removed(self):
        self.assertIn("no contexts", self.bedflow("context", "list").stderr)
        self.add("lab")
        self.add("other", server_address="localhost:1")
        listed = json.loads(self.bedflow("context", "list", "-o", "json").stdout)
        self.assertEqual([one["name"] for one in listed["contexts"]], ["lab", "other"])
        self.assertEqual(listed["current"], "lab")
        self.bedflow("context", "use", "other")
        self.assertIn("localhost:1", self.bedflow("context", "show").stdout)
        self.bedflow("server", "info", code=7)
        self.assertIn("TOKEN_MISSING", self.bedflow("server", "info", "--context", "lab", code=4).stderr)
        self.assertIn("TOKEN_MISSING", self.bedflow("server", "info", code=4, BEDFLOW_CONTEXT="lab").stderr)
        self.assertIn("local, ADMIN", self.bedflow("server", "info", "--server", server.address).stdout)
        self.assertIn("local, ADMIN", self.bedflow("server", "info", BEDFLOW_SERVER=server.address).stdout)
        self.bedflow("context", "remove", "other")
        self.assertIn("no context is in use", self.bedflow("context", "show", code=5).stderr)
        self.assertIn("there are lab", self.bedflow("context", "use", "other", code=5).stderr)
        self.bedflow("server", "info", "--context", "lab", "--server", server.address, code=2)
        self.assertEqual(stat.S_IMODE((self.home / "config/bedflow/contexts.txtpb").stat().st_mode), 0o600)

    def test_a_context_that_cannot_serve_is_refused_when_it_is_added(self):
        token = self.token_file("bob", "read")
        text = self.home / "text"
        text.write_text("no token")
        text.chmod(0o600)
        key = self.home / "open.key"
        key.write_bytes((server.keys / "server.key").read_bytes())
        key.chmod(0o644)
        token_of_all = self.home / "all.token"
        token_of_all.write_bytes(token.read_bytes())
        token_of_all.chmod(0o644)
        base = ["context", "add", "lab", "--server", server.network]
        for more, code, words in ((["--token", self.home / "nothing"], 2, "nothing"), (["--token", text], 2, "no token of bedflow"),
                                  (["--token", token_of_all], 4, "chmod 600"), (["--ca", text], 2, "not in PEM"),
                                  (["--certificate", server.keys / "server.pem"], 2, "come together"),
                                  (["--certificate", server.keys / "server.pem", "--key", key], 4, "chmod 600")):
            with self.subTest(more=more):
                self.assertIn(words, self.bedflow(*base, *more, code=code).stderr)
        self.assertIn("Unix socket", self.bedflow("context", "add", "x", "--server", server.address, "--token", token, code=2).stderr)
        self.bedflow("context", "add", "a b", "--server", server.network, code=2)
        self.assertFalse((self.home / "config/bedflow/contexts.txtpb").exists())

    def test_a_token_file_that_has_become_readable_by_others_is_no_longer_used(self):
        token = self.token_file("bob", "read")
        self.add("lab", "--token", token)
        self.bedflow("list")
        token.chmod(0o604)
        self.assertIn("chmod 600", self.bedflow("list", code=4).stderr)

    def test_who_is_turned_away_is_told_why_and_what_helps_with_exit_code_4(self):
        reader, brief = self.token_file("bob", "read"), self.token_file("bob", "submit", "--expires", "1s")
        self.add("reader", "--token", reader)
        self.add("brief", "--token", brief)
        case = self.home / "case.txtpb"
        case.write_text(bed(end=100))
        job = self.bedflow("submit", case, "--server", server.address).stdout.strip()
        denied = self.bedflow("cancel", job, "--context", "reader", code=4).stderr
        self.assertIn("[SCOPE_TOO_SMALL]", denied)
        self.assertIn("next: ", denied)
        self.add("submitter", "--token", self.token_file("carol", "submit"))
        denied = self.bedflow("cancel", job, "--context", "submitter", code=4).stderr
        self.assertIn("is local's", denied)
        self.assertIn("[NOT_OWNER]", denied)
        self.bedflow("cancel", job, "--skip-checkpoint", "--server", server.address)
        self.assertTrue(wait_until(lambda: "[TOKEN_EXPIRED]" in self.run_it("list", "--context", "brief").stderr))
        self.bedflow("list", "--context", "brief", code=4)
        self.bedflow("server", "token", "revoke", "--owner", "bob", "--server", server.address)
        denied = self.bedflow("list", "--context", "reader", code=4).stderr
        self.assertIn("[TOKEN_UNKNOWN]", denied)
        self.assertIn("bedflow server token create", denied)

    def test_a_server_that_is_far_away_is_reached(self):
        """A handshake over ways of 150 ms takes longer than a near server is given."""
        token = self.token_file("frank", "read")
        with SlowWay(int(server.network.rpartition(":")[2]), 0.15) as way:
            address = f"localhost:{way.port}"
            self.add("far", "--token", token, server_address=address)
            self.assertIn("frank, READ", self.bedflow("server", "info").stdout)
            with bedflow.connect(address, ca=server.keys / "ca.pem", token=token) as there:
                self.assertEqual(there.info().caller, "frank")

    def test_a_server_that_cannot_be_trusted_is_left_alone(self):
        stranger = self.home / "stranger"
        make_certificates(stranger, "localhost")
        self.bedflow("context", "add", "lab", "--server", server.network, "--ca", stranger / "ca.pem")
        said = self.bedflow("list", code=7).stderr
        self.assertIn("not of an authority that you trust", said)
        self.assertTrue(said.startswith("bedflow: "), "something else was told first")
        port = server.network.rpartition(":")[2]
        make_certificates(stranger, "bed.example.org")
        with SecureServer() as other:
            for file in ("server.pem", "server.key"):
                (other.keys / file).write_bytes((stranger / file).read_bytes())
            self.bedflow("context", "add", "lab", "--server", other.network, "--ca", stranger / "ca.pem")
            self.assertTrue(wait_until(lambda: "not for this host name" in self.bedflow("list", code=7).stderr))
        self.bedflow("context", "add", "lab", "--server", f"localhost:{port}", "--ca", server.keys / "ca.pem")
        self.assertIn("[TOKEN_MISSING]", self.bedflow("list", code=4).stderr)

    def test_a_token_is_written_over_nothing_and_left_nowhere_when_it_is_refused(self):
        path = self.home / "there"
        path.write_text("mine")
        create = ["server", "token", "create"]
        self.bedflow(*create, "alice", "--scope", "read", "--out", path, "--server", server.address, code=2)
        self.assertEqual(path.read_text(), "mine")
        self.assertIn("--scope: all not in {read,submit,admin}",
                      self.bedflow(*create, "alice", "--scope", "all", "--out", self.home / "new", code=2).stderr)
        for owner, more in (("../x", []), ("local", []), ("alice", ["--expires", "11y"]), ("alice", ["--expires", "99999d"])):
            self.bedflow(*create, owner, "--scope", "read", "--out", self.home / "new", *more, "--server", server.address, code=2)
            self.assertFalse((self.home / "new").exists())

    def test_tokens_are_listed_and_revoked(self):
        self.token_file("erin", "admin")
        self.add("boss", "--token", self.home / "erin-admin.token")
        listed = json.loads(self.bedflow("server", "token", "list", "-o", "json").stdout)["tokens"]
        token = next(one for one in listed if one["owner"] == "erin")
        self.assertEqual(token["scope"], "ADMIN")
        self.assertNotIn("secret_sha256", token)
        self.bedflow("server", "token", "revoke", token["id"])
        self.assertIn("[TOKEN_UNKNOWN]", self.bedflow("server", "token", "list", code=4).stderr)
        self.bedflow("server", "token", "revoke", token["id"], "--server", server.address, code=5)


class Start(unittest.TestCase):
    """What the server says when it is not to be started so."""

    def refused(self, *options):
        with tempfile.TemporaryDirectory() as folder:
            done = subprocess.run([BIN / "bedflowd", "--data", f"{folder}/data", *map(str, options)], capture_output=True, text=True,
                                  timeout=30)
            self.assertEqual(done.returncode, 2, done.stderr)
            self.assertFalse(pathlib.Path(folder, "data").exists())
            return done.stderr

    def test_beyond_the_machine_only_with_tls(self):
        for address in ("0.0.0.0:0", "[::]:0", "192.0.2.1:7443"):
            self.assertIn("--tls-certificate FILE --tls-key FILE", self.refused("--listen", address))

    def test_with_files_that_cannot_serve(self):
        pem, key = server.keys / "server.pem", server.keys / "server.key"
        with tempfile.TemporaryDirectory() as folder:
            make_certificates(folder, "localhost", days=0)
            other = pathlib.Path(folder, "server.key")
            listen = ["--listen", "0.0.0.0:0"]
            for certificate, private, words in ((pem, other, "is not the key of"), (pathlib.Path(folder, "server.pem"), other, "has expired"),
                                                (key, key, "no certificate in PEM"), (pem, pem, "no private key"), ("/x", key, "is not there")):
                self.assertIn(words, self.refused(*listen, "--tls-certificate", certificate, "--tls-key", private))
            other.chmod(0o604)
            self.assertIn("chmod 600", self.refused(*listen, "--tls-certificate", pathlib.Path(folder, "server.pem"), "--tls-key", other))
            self.assertIn("--tls-key FILE is missing", self.refused(*listen, "--tls-certificate", pem))
            self.assertIn("--tls-certificate FILE is missing", self.refused(*listen, "--client-ca", pem))
            self.assertIn("--client-ca", self.refused(*listen, "--tls-certificate", pem, "--tls-key", key, "--client-ca", key))


class PythonContexts(unittest.TestCase):
    def test_are_the_same_to_the_python_client(self):
        token = server.token("alice", access_pb2.SUBMIT)
        folder = pathlib.Path(tempfile.mkdtemp(dir=server.path))
        with unittest.mock.patch.dict("os.environ", XDG_CONFIG_HOME=str(folder)):
            self.assertEqual(bedflow.read_context().server, bedflow.default_address())
            contexts = context_pb2.Contexts(current="lab")
            contexts.contexts.add(name="lab", server=server.network, ca=str(server.keys / "ca.pem"), token=str(token.file))
            (folder / "bedflow").mkdir()
            (folder / "bedflow/contexts.txtpb").write_text(text_format.MessageToString(contexts))
            for how in ({}, {"context": "lab"}):
                with bedflow.connect(**how) as there:
                    self.assertEqual(there.info().caller, "alice")
            with self.assertRaises(KeyError):
                bedflow.connect(context="other")


class PythonClient(unittest.TestCase):
    def test_takes_authority_certificate_and_token(self):
        make_certificates(strict.keys, "--client", "python")
        token = strict.token("alice", access_pb2.SUBMIT)
        pair = {"certificate": strict.keys / "python.pem", "key": strict.keys / "python.key"}
        with bedflow.connect(strict.network, ca=strict.keys / "ca.pem", token=token.file, **pair) as there:
            self.assertEqual(there.info().caller, "alice")
            self.assertEqual(there.submit(bed(end=0.002)).wait(60).message.owner, "alice")
        with bedflow.connect(strict.network, ca=strict.keys / "ca.pem", **pair) as there, self.assertRaises(bedflow.Error) as caught:
            there.info()
        self.assertEqual(caught.exception.reason, "TOKEN_MISSING")

    def test_uses_no_token_and_no_key_that_others_can_read(self):
        token = server.token("alice", access_pb2.READ)
        token.file.chmod(0o640)
        with self.assertRaises(PermissionError):
            server.connect_as(token)
        token.file.chmod(0o600)
        token.file.write_text("my password")
        with self.assertRaises(ValueError):
            server.connect_as(token)


if __name__ == "__main__":
    unittest.main()
