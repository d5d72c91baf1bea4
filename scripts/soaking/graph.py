"""A ROS graph with a master of its own: its programs, their logs and their memory."""
import os
import pathlib
import shutil
import signal
import socket
import subprocess
import sys
import time


def program(name):
    """Path of a program of the package."""
    found = subprocess.run(["catkin_find", "--first-only", "--libexec", "dtsdf_mapping", name],
                           capture_output=True, text=True, check=False)
    path = found.stdout.strip()
    if not path:
        raise FileNotFoundError(f"no program {name}: is the build complete? {found.stderr}")
    return path


def free_port():
    with socket.socket() as free:
        free.bind(("", 0))
        return free.getsockname()[1]


def run_in_build(build, command, **env):
    """Starts a script with a build's environment."""
    wrapper = pathlib.Path(build) / "devel" / "env.sh"
    if not wrapper.exists():
        sys.exit(f"{wrapper} does not exist: build with ROS first (scripts/test), or give --build")
    env = dict(os.environ, ROS_HOSTNAME="localhost", PATH="/usr/bin:" + os.environ["PATH"], **env)
    return subprocess.Popen([str(wrapper), "/usr/bin/python3", *command], env=env)


def wait_until(condition, timeout_s, what):
    deadline = time.monotonic() + timeout_s
    while not condition():
        if time.monotonic() > deadline:
            raise TimeoutError(what)
        time.sleep(0.05)


class Graph:
    """Ends its programs when it is left."""

    def __init__(self, folder):
        self.logs = pathlib.Path(folder) / "logs"
        self.logs.mkdir(parents=True, exist_ok=True)
        self.programs = []
        self.port = free_port()
        os.environ["ROS_MASTER_URI"] = f"http://localhost:{self.port}"

    def __enter__(self):
        self.start("master", ["roscore", "-p", str(self.port)])
        import rosgraph
        wait_until(rosgraph.is_master_online, 60, "no master")
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
        """Ends a program as Ctrl-C does; returns whether it went by itself."""
        self.programs.remove(program)
        return stop(program)


def stop(program):
    if program.poll() is not None:
        return True
    for what, seconds in ((signal.SIGINT, 30), (signal.SIGTERM, 10)):
        program.send_signal(what)
        try:
            program.wait(timeout=seconds)
            return what == signal.SIGINT
        except subprocess.TimeoutExpired:
            continue
    program.kill()
    program.wait()
    return False


def pid_of(node):
    """The process of a node: of a nodelet, that of its manager."""
    import rosgraph
    import xmlrpc.client
    uri = rosgraph.Master("/soak").lookupNode(node)
    return xmlrpc.client.ServerProxy(uri).getPid("/soak")[2]


def resident_mb(pid):
    """None if the process has ended."""
    try:
        with open(f"/proc/{pid}/status") as status:
            for line in status:
                if line.startswith("VmRSS:"):
                    return int(line.split()[1]) / 1024.0
    except (FileNotFoundError, ProcessLookupError):
        pass
    return None


def gpu_mb():
    """Memory in use on all GPUs; None where there is none."""
    if shutil.which("nvidia-smi") is None:
        return None
    answer = subprocess.run(["nvidia-smi", "--query-gpu=memory.used", "--format=csv,noheader,nounits"],
                            capture_output=True, text=True, check=False)
    numbers = [word for word in answer.stdout.split() if word.isdigit()]
    return float(sum(map(int, numbers))) if numbers else None
