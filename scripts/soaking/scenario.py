"""The events of a run: a fixed sequence that is repeated, from loading the nodelet into its manager to
unloading it."""
import pathlib
import random
import signal
import threading
import time

import rospy
import rosservice
import yaml
from dtsdf_mapping.msg import MapStatus, Sphere
from dtsdf_mapping.srv import ClearRegion, GetDistances, LoadMap, SaveMap, SaveMesh
from geometry_msgs.msg import Point
from std_srvs.srv import SetBool, Trigger
from tf2_msgs.msg import TFMessage

from soaking.graph import Graph, pid_of, program, resident_mb, wait_until
from soaking.record import Record

ROOT = pathlib.Path(__file__).resolve().parent.parent.parent
STEADY_TOPICS = ("mesh", "surface_points", "occupancy_grid")
TOPICS = ("mesh", "mesh_blocks", "surface_points", "occupancy_grid", "occupancy_grid_updates",
          "distance_slice")
CAMERA_TOPICS = ("/camera/depth/image_rect", "/camera/depth/camera_info",
                 "/camera/color/image_rect", "/camera/color/camera_info")
MANAGER, NODE = "/mapping_manager", "/mapping"
QUERIED_POINTS = 1000
RECOVERS_WITHIN_S = 30.0
SETTLES_WITHIN_S = 180.0
MAX_UNCOUNTED_IMAGES = 70  # see unaccounted(); the queues limit it


def cycle_seconds(hours):
    """A twelfth of the run, but at least 40 s (the time required by the events) and at most five minutes."""
    return min(max(3600.0 * hours / 12, 40.0), 300.0)


class Watch:
    """Watches the status of a node, records samples of it, and reports problems."""

    def __init__(self, record, process, sample_s):
        self.record, self.process = record, process
        self.status, self.status_time = None, time.monotonic()
        self.expects_status = False
        self.ended = threading.Event()
        rospy.Subscriber(NODE + "/status", MapStatus, self.on_status, queue_size=10)
        self.thread = threading.Thread(target=self.sample_all, args=(sample_s,), daemon=True)
        self.thread.start()

    def on_status(self, status):
        self.status_time, self.status = time.monotonic(), status

    def sample_all(self, sample_s):
        """Takes samples until the run ends. An error ends the run, which is useless without samples."""
        try:
            while not self.ended.wait(sample_s):
                self.sample()
        except Exception as error:
            self.record.problem(f"sampling ended: {type(error).__name__}: {error}")
            self.ended.set()

    def sample(self):
        mb = resident_mb(self.process)
        if mb is None:
            self.record.problem("the process has ended")
            self.ended.set()
            return
        fields = dict(rss_mb=round(mb, 1))
        if self.expects_status and self.status is not None:
            fields["memory_mb"] = {part.name: round(part.bytes / 1e6, 1)
                                   for part in self.status.memory}
            fields["status"] = self.status.message
            self.judge(self.status)
        self.record.write("sample", **fields)

    def judge(self, status):
        silent_s = time.monotonic() - self.status_time
        if silent_s > RECOVERS_WITHIN_S:
            self.record.problem(f"no status for {silent_s:.0f} s")
            self.status_time = time.monotonic()  # so that the next report is RECOVERS_WITHIN_S later
        for stream in status.cameras[0].streams:
            missing = unaccounted(stream)
            if not 0 <= missing <= MAX_UNCOUNTED_IMAGES:
                self.record.problem(f"{missing} {stream.kind} images are not accounted for")


def unaccounted(stream):
    """The number of images received that are neither fused, dropped nor waiting."""
    dropped = sum(drop.count for drop in stream.dropped)
    return stream.received - stream.fused - dropped - stream.waiting


class Scenario:
    """A simulated camera, and a nodelet that is loaded into a manager and unloaded again in each cycle."""

    def __init__(self, graph, record, options):
        self.graph, self.record, self.options = graph, record, options
        self.random = random.Random(1)
        self.listeners, self.stalled, self.loader = [], None, None
        config = yaml.safe_load((ROOT / "config" / "default.yaml").read_text())
        config["backend"] = options.backend
        config["space"]["enabled"] = True
        config["publish"]["status_rate_hz"] = 2.0
        config["output_directory"] = str(options.out / "files")
        rospy.set_param(NODE, config)
        self.tf_passes = True
        self.tf = rospy.Publisher("/tf", TFMessage, queue_size=100)
        rospy.Subscriber("/tf_of_camera", TFMessage, self.on_tf, queue_size=100)
        self.camera_returns()
        graph.start("manager", ["rosrun", "nodelet", "nodelet", "manager", f"__name:={MANAGER[1:]}"])
        rospy.wait_for_service(MANAGER + "/load_nodelet", 60)
        self.watch = Watch(record, pid_of(MANAGER), max(1.0, options.hours))

    # ---- services ------------------------------------------------------------------------------
    def call(self, name, kind, refusals=(), **request):
        proxy = rospy.ServiceProxy(f"{NODE}/{name}", kind)
        begin = time.monotonic()
        try:
            answer = proxy(**request)
        except Exception as error:
            self.record.call(name, "failed", str(error), time.monotonic() - begin)
            return None
        outcome = "done" if answer.success else "failed"
        if not answer.success and any(text in answer.message for text in refusals):
            outcome = "refused"
        self.record.call(name, outcome, answer.message, time.monotonic() - begin)
        return answer if outcome == "done" else None

    def ask_distances(self):
        """Queries distances at points all over the room, as a planner would."""
        points = [Point(self.random.uniform(-2.5, 2.5), self.random.uniform(-2.0, 2.0),
                        self.random.uniform(0.0, 2.0)) for _ in range(QUERIED_POINTS)]
        answer = self.call("get_distances", GetDistances, refusals=["nothing is mapped yet"],
                           points=points)
        if answer is None:
            return
        counts = {len(answer.known), len(answer.distances), len(answer.gradients)}
        if counts != {QUERIED_POINTS}:
            self.record.problem(f"get_distances: {QUERIED_POINTS} points, but {counts} answers")
        elif any(known != (d >= 0.0) for known, d in zip(answer.known, answer.distances)):
            self.record.problem("get_distances: an unknown point has a distance, or a known one has none")

    def save_mesh(self):
        self.call("save_mesh", SaveMesh, file_name="mesh.ply")

    def save_map(self):
        self.call("save_map", SaveMap, file_name="map.dtsdf")

    def load_map(self):
        self.call("load_map", LoadMap, file_name="map.dtsdf")

    def clear_region(self):
        ball = Sphere(radius=0.8)
        ball.center.z = 0.8
        self.call("clear_region", ClearRegion, sphere=ball)

    def clear_map(self):
        self.call("clear_map", Trigger)

    def pause(self):
        self.call("pause", SetBool, data=True)

    def resume(self):
        self.call("pause", SetBool, data=False)

    # ---- listeners -----------------------------------------------------------------------------
    def listen(self, topic):
        return rospy.Subscriber(f"{NODE}/{topic}", rospy.AnyMsg, queue_size=1)

    def listeners_come(self):
        self.listeners = [self.listen(topic) for topic in STEADY_TOPICS]

    def listeners_go(self):
        for listener in self.listeners:
            listener.unregister()
        self.listeners_break_off()

    def listeners_stall(self):
        """Starts a listener to all topics and suspends it, so that it no longer reads."""
        self.stalled = self.graph.start("stalled", ["rostopic", "hz", *(f"{NODE}/{topic}" for topic in TOPICS)])
        time.sleep(4.0)
        self.stalled.send_signal(signal.SIGSTOP)

    def listeners_break_off(self):
        """Kills the stalled listener, perhaps in the middle of a message."""
        if self.stalled is not None:
            self.stalled.kill()
            self.stalled = None

    # ---- running -------------------------------------------------------------------------------
    def must_map(self):
        """Waits until frames are fused again and the status is OK."""
        before = self.watch.status.frames_fused if self.watch.status else 0
        wait_until(lambda: self.watch.status and self.watch.status.level == 0 and
                   self.watch.status.frames_fused > before, RECOVERS_WITHIN_S, "not mapping again")

    def must_be_settled(self):
        """Waits until all images are accounted for, except at most one: if the camera died after publishing an
        image but before its camera_info, that image stays in the queue."""
        wait_until(lambda: all(unaccounted(stream) + stream.waiting <= 1 for stream in
                               self.watch.status.cameras[0].streams), SETTLES_WITHIN_S, "images not accounted for")

    def run_cycle(self, seconds):
        begin = time.monotonic()
        for share, step in self.course():
            time.sleep(max(0.0, begin + share * seconds - time.monotonic()))
            if self.watch.ended.is_set():
                return
            self.record.event(step.__name__)
            try:
                step()
            except Exception as error:
                self.record.problem(f"{step.__name__}: {type(error).__name__}: {error}")
        time.sleep(max(0.0, begin + seconds - time.monotonic()))

    def run(self):
        end = time.monotonic() + 3600.0 * self.options.hours
        while time.monotonic() < end and not self.watch.ended.is_set():
            self.record.event("cycle")
            self.run_cycle(cycle_seconds(self.options.hours))
        self.watch.ended.set()
        self.watch.thread.join(timeout=30)


    def on_tf(self, message):
        if self.tf_passes:
            self.tf.publish(message)

    def course(self):
        return [(0.00, self.load), (0.06, self.listeners_come), (0.10, self.listeners_stall),
                (0.16, self.ask_distances), (0.20, self.save_mesh), (0.24, self.save_map),
                (0.28, self.ask_distances), (0.30, self.tf_stops), (0.36, self.tf_goes_on),
                (0.42, self.listeners_break_off), (0.46, self.clear_region),
                (0.54, self.load_map),
                (0.56, self.ask_distances), (0.58, self.pause), (0.61, self.resume),
                (0.66, self.ask_distances), (0.68, self.clear_map),
                (0.72, self.camera_dies), (0.74, self.must_be_settled), (0.80, self.camera_returns),
                (0.84, self.must_map), (0.94, self.listeners_go), (0.96, self.unload)]

    def load(self):
        self.watch.status = None
        self.loader = self.graph.start(
            "nodelet", ["rosrun", "nodelet", "nodelet", "load", "dtsdf_mapping/MappingNodelet",
                        MANAGER[1:], f"__name:={NODE[1:]}",
                        *(f"{topic[len('/camera/'):]}:={topic}" for topic in CAMERA_TOPICS)])
        wait_until(lambda: self.watch.status is not None, 60, "the nodelet did not start")
        self.watch.expects_status = True

    def unload(self):
        self.watch.expects_status = False
        if not self.graph.end(self.loader):
            self.record.problem("the nodelet's loader had to be killed")
        wait_until(lambda: rosservice.get_service_node(NODE + "/save_mesh") is None, 30,
                   "the nodelet was not unloaded")

    def tf_stops(self):
        self.tf_passes = False

    def tf_goes_on(self):
        self.tf_passes = True

    def camera_dies(self):
        self.graph.end(self.camera)

    def camera_returns(self):
        self.camera = self.graph.start("camera", [
            program("simulated_camera"), "__name:=simulated_camera", "__ns:=/camera",
            "/tf:=/tf_of_camera", f"_rate_hz:={self.options.rate_hz}", "_lap_s:=20", "_moving:=3"])


def run(options):
    with Graph(options.out) as graph:
        record = Record(options.out)
        rospy.init_node("soak", disable_signals=True)
        Scenario(graph, record, options).run()
