"""Tasks for the worker tests: they must be importable in a spawned process."""

import os
import signal
import sys
import time

from evalsuite.errors import EvalsuiteError


def square(x):
    return x * x


def abort():
    print("LLVM ERROR: out of registers", file=sys.stderr, flush=True)
    os.abort()


def leave():
    os._exit(7)


def hang():
    time.sleep(60)


def refuse():
    raise EvalsuiteError("scene.xml", "a cube", "a sphere")


def interrupt_is_ignored():
    os.kill(os.getpid(), signal.SIGINT)
    return "alive"


def slow_square(x, seconds):
    time.sleep(seconds)
    return x * x
