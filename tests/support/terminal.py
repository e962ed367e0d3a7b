"""A program at a terminal of its own (a pseudo-terminal), as a user sits before it."""
import fcntl
import os
import pty
import re
import select
import signal
import struct
import termios
import time


class Session:
    """Use it in a with statement; what is left of the program is ended then."""

    def __init__(self, command, columns=120, rows=30, **variables):
        self.process, self.terminal = pty.fork()
        if self.process == 0:
            try:
                os.environ.update(variables | {"TERM": "xterm-256color", "LC_ALL": "C.UTF-8"})
                os.environ.pop("NO_COLOR", None)
                os.execvp(str(command[0]), [str(word) for word in command])
            finally:
                os._exit(127)
        self.text = ""
        self.settings = termios.tcgetattr(self.terminal)
        self.resize(columns, rows)

    def __enter__(self):
        return self

    def __exit__(self, *_):
        if self.process:
            os.kill(self.process, signal.SIGKILL)
            os.waitpid(self.process, 0)
        os.close(self.terminal)

    def resize(self, columns, rows):
        fcntl.ioctl(self.terminal, termios.TIOCSWINSZ, struct.pack("HHHH", rows, columns, 0, 0))

    def type(self, keys):
        os.write(self.terminal, keys.encode())

    def read(self, seconds=0.05):
        """What has come meanwhile; False when the program has closed the terminal."""
        if not select.select([self.terminal], [], [], seconds)[0]:
            return True
        try:
            got = os.read(self.terminal, 65536)
        except OSError:
            got = b""
        self.text += got.decode("utf-8", "replace")
        return bool(got)

    def expect(self, pattern, seconds=20):
        """Until what has come since the last time matches; what comes behind is looked at the next time."""
        deadline = time.monotonic() + seconds
        while not (found := re.search(pattern, self.text, re.S)):
            if time.monotonic() > deadline or not self.read() and not re.search(pattern, self.text, re.S):
                raise AssertionError(f"no {pattern!r} in {self.text!r}")
        self.text = self.text[found.end():]
        return found

    def expect_words(self, pattern, seconds=20):
        """The same without what moves the cursor and colours the text; all that has come is left behind."""
        deadline = time.monotonic() + seconds
        while not re.search(pattern, re.sub(r"\033\[[0-9;?]*[a-zA-Z]|[\a\b]", "", self.text), re.S):
            if time.monotonic() > deadline or not self.read():
                raise AssertionError(f"no {pattern!r} in {self.text!r}")
        self.text = ""

    def frame(self, condition, seconds=20):
        """The lines of the first whole picture from now on that are as wanted, without colours."""
        self.text = ""
        deadline = time.monotonic() + seconds
        lines = []
        while time.monotonic() < deadline:
            self.read()
            pictures = self.text.split("\033[H")
            for picture in pictures[1:]:
                if "\033[J" not in picture:
                    continue
                text = re.sub(r"\033\[[0-9;?]*[a-zA-Z]|\r", "", picture.split("\033[J")[0])
                lines = text.split("\n")
                if condition(lines):
                    return lines
        raise AssertionError(f"no such picture; the last one is {lines}")

    def end(self, seconds=20):
        """The exit code."""
        deadline = time.monotonic() + seconds
        while time.monotonic() < deadline:
            self.read(0.01)
            process, status = os.waitpid(self.process, os.WNOHANG)
            if process:
                self.process = 0
                while self.read(0.01) and select.select([self.terminal], [], [], 0)[0]:
                    pass
                return os.waitstatus_to_exitcode(status)
        raise AssertionError(f"it does not end: {self.text!r}")
