"""The record of a run: one line of JSON per sample, event, call and problem."""
import json
import pathlib
import threading
import time


class Record:
    """Writes the record of a run. Thread-safe."""

    def __init__(self, folder):
        self.file = open(pathlib.Path(folder) / "record.jsonl", "w")
        self.lock = threading.Lock()
        self.begin = time.monotonic()

    def seconds(self):
        return time.monotonic() - self.begin

    def write(self, kind, **fields):
        with self.lock:
            self.file.write(json.dumps(dict(kind=kind, t=round(self.seconds(), 2), **fields)) + "\n")
            self.file.flush()

    def event(self, what):
        self.write("event", what=what)

    def problem(self, what):
        print(f"soak: at {self.seconds():.0f} s: {what}", flush=True)
        self.write("problem", what=what)

    def call(self, service, outcome, text, took_s):
        """`outcome`: "done", "refused" (as expected) or "failed"."""
        self.write("call", service=service, outcome=outcome, text=text, took_s=round(took_s, 3))
        if outcome == "failed":
            self.problem(f"{service} failed: {text}")
