"""A ROS graph with its own master: programs, their logs and their memory."""
import os
import pathlib
import signal
import socket
import subprocess
import time


def program(name):
    """Returns the path of a program of this package."""
    found = subprocess.run(["catkin_find", "--first-only", "--libexec", "dtsdf_mapping", name],
                           capture_output=True, text=True, check=False)
    path = found.stdout.strip()
    if not path:
        raise FileNotFoundError(f"program {name} not found: is the build complete? {found.stderr}")
    return path


def free_port():
    with socket.socket() as free:
        free.bind(("", 0))
        return free.getsockname()[1]


def wait_until(condition, timeout_s, what):
    deadline = time.monotonic() + timeout_s
    while not condition():
        if time.monotonic() > deadline:
            raise TimeoutError(what)
        time.sleep(0.05)


class Graph:
    """A context manager that starts a ROS master, and stops all programs on exit."""

    def __init__(self, folder):
        self.logs = pathlib.Path(folder) / "logs"
        self.logs.mkdir(parents=True, exist_ok=True)
        self.programs = []
        self.port = free_port()
        os.environ.update(ROS_HOSTNAME="localhost", ROS_HOME=str(self.logs),
                          ROS_MASTER_URI=f"http://localhost:{self.port}")

    def __enter__(self):
        self.start("master", ["roscore", "-p", str(self.port)])
        import rosgraph
        wait_until(rosgraph.is_master_online, 60, "the ROS master did not start")
        return self

    def __exit__(self, *_):
        for program in reversed(self.programs):
            stop(program)

    def start(self, name, command):
        log = open(self.logs / f"{name}.log", "ab")
        program = subprocess.Popen(command, stdout=log, stderr=subprocess.STDOUT)
        log.close()
        self.programs.append(program)
        return program

    def end(self, program):
        """Stops a program as Ctrl-C would; returns False if it had to be killed."""
        self.programs.remove(program)
        return stop(program)


def stop(program):
    program.send_signal(signal.SIGINT)
    try:
        program.wait(timeout=30)
        return True
    except subprocess.TimeoutExpired:
        program.kill()
        program.wait()
        return False


def pid_of(node):
    """The process id of a node. For a nodelet, pass the name of its manager."""
    import rosgraph
    import xmlrpc.client
    uri = rosgraph.Master("/soak").lookupNode(node)
    return xmlrpc.client.ServerProxy(uri).getPid("/soak")[2]


def resident_mb(pid):
    """Resident memory of a process in MiB; 0 if it is a zombie, None if it does not exist."""
    answer = subprocess.run(["ps", "-o", "rss=", "-p", str(pid)], capture_output=True, text=True, check=False)
    return int(answer.stdout) / 1024.0 if answer.stdout else None
