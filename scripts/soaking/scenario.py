"""What is done to a graph: cycles of a fixed course of events, and listeners that come and go at
random all the while. A cycle of the live graph begins with loading the nodelet into its manager and
ends with unloading it; the node of the bag graph runs from beginning to end."""
import pathlib
import random
import signal
import threading
import time

import rosgraph
import rospy
import yaml
from dtsdf_mapping.msg import Box, MapStatus, Sphere
from dtsdf_mapping.srv import ClearRegion, GetDistances, LoadMap, SaveMap, SaveMesh
from geometry_msgs.msg import Point, TransformStamped
from std_srvs.srv import SetBool, Trigger
from tf2_msgs.msg import TFMessage

from soaking.graph import Graph, gpu_mb, pid_of, program, resident_mb, wait_until
from soaking.record import Record

ROOT = pathlib.Path(__file__).resolve().parent.parent.parent
STEADY_TOPICS = ("mesh", "surface_points", "occupancy_grid")
TOPICS = ("mesh", "mesh_blocks", "surface_points", "occupancy_grid", "occupancy_grid_updates",
          "distance_slice")
CAMERA_TOPICS = ("/camera/depth/image_rect", "/camera/depth/camera_info",
                 "/camera/color/image_rect", "/camera/color/camera_info")
MANAGER, NODE = "/mapping_manager", "/mapping"
LAP_S = 20.0
POINTS_ASKED = 1000
RECOVERS_WITHIN_S = 30.0
SETTLES_WITHIN_S = 180.0
MOST_ON_THE_WAY = 70  # images that are between arriving and being counted: the queues' lengths


def cycle_seconds(hours):
    """Twelve cycles, none longer than five minutes nor shorter than what it does takes."""
    return min(max(3600.0 * hours / 12, 40.0), 300.0)


class Watch:
    """The status of a node, samples of it, and what it shows to be wrong."""

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
        """Whatever ends the sampling ends the run: what nobody watches shows nothing."""
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
        gpu = gpu_mb()
        if gpu is not None:
            fields["gpu_mb"] = gpu
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
            self.status_time = time.monotonic()  # say it again only after as long a time
        for stream in status.cameras[0].streams:
            missing = unaccounted(stream)
            if not 0 <= missing <= MOST_ON_THE_WAY:
                self.record.problem(f"{missing} {stream.kind} images have come to nothing that is "
                                    "counted")


def start_camera(graph, options, tf_topic="/tf"):
    return graph.start("camera", [
        program("simulated_camera"), "__name:=simulated_camera", "__ns:=/camera",
        f"/tf:={tf_topic}", f"_rate_hz:={options.rate_hz}", f"_lap_s:={LAP_S}", "_moving:=3"])


def record_bag(graph, options, path):
    """A lap of the camera."""
    camera = start_camera(graph, options)
    recorder = graph.start("record", ["rosbag", "record", "-O", str(path),
                                      f"--duration={LAP_S:.0f}", "/tf", "/tf_static",
                                      *CAMERA_TOPICS])
    recorder.wait(timeout=LAP_S + 60)
    graph.end(recorder)
    graph.end(camera)


def has_service(name):
    try:
        return rosgraph.Master("/soak").lookupService(name) is not None
    except rosgraph.MasterException:
        return False


def unaccounted(stream):
    """Images that were received and are neither fused, dropped nor waiting."""
    dropped = sum(drop.count for drop in stream.dropped)
    return stream.received - stream.fused - dropped - stream.waiting


class Scenario:
    """What both graphs have in common."""

    def __init__(self, graph, record, options, folder):
        self.graph, self.record, self.options = graph, record, options
        self.random = random.Random(1)
        self.listeners, self.stalled = [], None
        self.files = folder / "files"
        self.watch = None

    def set_parameters(self):
        config = yaml.safe_load((ROOT / "config" / "default.yaml").read_text())
        config["map"]["voxel_size_m"] = self.options.voxel_mm / 1000.0
        config["backend"] = self.options.backend
        config["space"]["enabled"] = True
        config["publish"]["status_rate_hz"] = 2.0
        config["output_directory"] = str(self.files)
        rospy.set_param(NODE, config)

    def remappings(self):
        return [f"{topic[len('/camera/'):]}:={topic}" for topic in CAMERA_TOPICS]

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
        """At places all over the room, as a planner does."""
        points = [Point(self.random.uniform(-2.5, 2.5), self.random.uniform(-2.0, 2.0),
                        self.random.uniform(0.0, 2.0)) for _ in range(POINTS_ASKED)]
        answer = self.call("get_distances", GetDistances, refusals=["nothing is mapped yet"],
                           points=points)
        if answer is None:
            return
        counts = {len(answer.known), len(answer.distances), len(answer.gradients)}
        if counts != {POINTS_ASKED}:
            self.record.problem(f"get_distances: {POINTS_ASKED} points, but {counts} answers")
        elif any(known != (d >= 0.0) for known, d in zip(answer.known, answer.distances)):
            self.record.problem("get_distances: an unknown place with a distance, or the reverse")

    def save_mesh(self):
        self.call("save_mesh", SaveMesh, file_name="mesh.ply")

    def save_part(self):
        """Fewer triangles, of a box."""
        box = Box()
        box.pose.position.z = 1.0
        box.size.x = box.size.y = box.size.z = 4.0
        self.call("save_mesh", SaveMesh, refusals=["this build cannot simplify"],
                  file_name="part.glb", simplify_error_m=0.005, region=box)

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

    def pause(self, wanted=True):
        self.call("pause", SetBool, data=wanted)

    def go_on(self):
        self.pause(False)

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
        """One that is connected to all and never reads again."""
        self.stalled = self.graph.start("stalled", ["rostopic", "hz", *(f"{NODE}/{topic}" for topic in TOPICS)])
        time.sleep(4.0)
        self.stalled.send_signal(signal.SIGSTOP)

    def listeners_break_off(self):
        """In the middle of a message, if there is one."""
        if self.stalled is not None:
            self.stalled.kill()
            self.stalled = None

    def come_and_go(self, ended):
        """One more of a random topic, for some seconds, again and again."""
        while not ended.wait(self.random.uniform(0.5, 3.0)):
            listener = self.listen(self.random.choice([topic for topic in TOPICS if topic not in STEADY_TOPICS]))
            ended.wait(self.random.uniform(0.5, 4.0))
            listener.unregister()

    # ---- running -------------------------------------------------------------------------------
    def must_map(self):
        """Whatever was done: frames are fused again, and the status is OK by itself."""
        before = self.watch.status.frames_fused if self.watch.status else 0
        wait_until(lambda: self.watch.status and self.watch.status.level == 0 and
                   self.watch.status.frames_fused > before, RECOVERS_WITHIN_S, "not mapping again")

    def must_be_settled(self):
        """Nothing comes in any more: each image becomes something that is counted, but for one whose
        camera_info never came, which waits until the next one."""
        wait_until(lambda: all(unaccounted(stream) + stream.waiting <= 1 for stream in
                               self.watch.status.cameras[0].streams), SETTLES_WITHIN_S, "images without a fate")

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

    def run(self, is_loaded=False):
        hours = self.options.hours
        end = time.monotonic() + 3600.0 * hours
        self.watch = Watch(self.record, self.process(), max(1.0, hours))
        self.watch.expects_status = is_loaded
        ended = threading.Event()
        visitors = threading.Thread(target=self.come_and_go, args=(ended,), daemon=True)
        visitors.start()
        while time.monotonic() < end and not self.watch.ended.is_set():
            self.record.event("cycle")
            self.run_cycle(cycle_seconds(hours))
        ended.set()
        visitors.join(timeout=30)
        self.watch.ended.set()
        self.watch.thread.join(timeout=30)


class Live(Scenario):
    """A camera in wall time; a nodelet in a manager, loaded and unloaded in each cycle."""

    def __init__(self, *arguments):
        super().__init__(*arguments)
        self.set_parameters()
        self.tf_passes = True
        self.tf = rospy.Publisher("/tf", TFMessage, queue_size=100)
        rospy.Subscriber("/tf_of_camera", TFMessage, self.on_tf, queue_size=100)
        self.camera = start_camera(self.graph, self.options, "/tf_of_camera")
        self.manager = self.graph.start(
            "manager", ["rosrun", "nodelet", "nodelet", "manager", f"__name:={MANAGER[1:]}"])
        self.loader = None

    def on_tf(self, message):
        if self.tf_passes:
            self.tf.publish(message)

    def process(self):
        wait_until(lambda: has_service(MANAGER + "/load_nodelet"), 60, "no nodelet manager")
        return pid_of(MANAGER)

    def course(self):
        return [(0.00, self.load), (0.06, self.listeners_come), (0.10, self.listeners_stall),
                (0.16, self.ask_distances), (0.20, self.save_mesh), (0.24, self.save_map),
                (0.28, self.ask_distances), (0.30, self.tf_stops), (0.36, self.tf_goes_on),
                (0.42, self.listeners_break_off), (0.46, self.clear_region),
                (0.50, self.save_part), (0.54, self.load_map),
                (0.56, self.ask_distances), (0.58, self.pause), (0.61, self.go_on),
                (0.64, self.tf_is_ahead), (0.66, self.ask_distances), (0.68, self.clear_map),
                (0.72, self.camera_dies), (0.74, self.must_be_settled), (0.80, self.camera_returns),
                (0.84, self.must_map), (0.94, self.listeners_go), (0.96, self.unload)]

    def load(self):
        self.watch.status = None
        self.loader = self.graph.start(
            "nodelet", ["rosrun", "nodelet", "nodelet", "load", "dtsdf_mapping/MappingNodelet",
                        MANAGER[1:], f"__name:={NODE[1:]}"] + self.remappings())
        wait_until(lambda: self.watch.status is not None, 60, "the nodelet does not come up")
        self.watch.expects_status = True

    def unload(self):
        self.watch.expects_status = False
        if not self.graph.end(self.loader):
            self.record.problem("the nodelet's loader had to be killed")
        wait_until(lambda: not has_service(NODE + "/save_mesh"), 30,
                   "the nodelet was not unloaded")

    def tf_stops(self):
        self.tf_passes = False

    def tf_goes_on(self):
        self.tf_passes = True

    def tf_is_ahead(self):
        """One transform that cannot be true, by decades; the next ones are right."""
        ahead = TransformStamped()
        ahead.header.frame_id, ahead.child_frame_id = "map", "camera_depth_optical_frame"
        ahead.header.stamp = rospy.Time.now() + rospy.Duration(10 ** 9)
        ahead.transform.rotation.w = 1.0
        self.tf.publish(TFMessage([ahead]))

    def camera_dies(self):
        self.graph.end(self.camera)

    def camera_returns(self):
        self.camera = start_camera(self.graph, self.options, "/tf_of_camera")


class Bag(Scenario):
    """A node that maps a bag, which loops under simulated time."""

    def __init__(self, *arguments):
        super().__init__(*arguments)
        self.set_parameters()
        self.node = self.graph.start(
            "node", [program("mapping_node"), f"__name:={NODE[1:]}"] + self.remappings())
        self.player = self.play()

    def play(self):
        return self.graph.start("play", ["rosbag", "play", "--clock", "--loop", "-q",
                                         str(self.files.parent / "room.bag")])

    def process(self):
        wait_until(lambda: has_service(NODE + "/save_mesh"), 60, "the node does not come up")
        return pid_of(NODE)

    def run(self):
        super().run(is_loaded=True)

    def course(self):
        return [(0.02, self.must_map), (0.05, self.listeners_come), (0.10, self.listeners_stall),
                (0.18, self.ask_distances), (0.24, self.save_mesh), (0.30, self.save_map),
                (0.38, self.listeners_break_off), (0.46, self.clear_region),
                (0.49, self.ask_distances), (0.52, self.save_part), (0.58, self.load_map),
                (0.61, self.ask_distances), (0.64, self.player_dies), (0.70, self.must_be_settled),
                (0.72, self.player_returns), (0.80, self.clear_map), (0.84, self.must_map),
                (0.92, self.ask_distances), (0.95, self.listeners_go)]

    def player_dies(self):
        self.graph.end(self.player)

    def player_returns(self):
        self.player = self.play()


def run(name, options):
    folder = options.out / name
    record = Record(folder)
    with Graph(folder) as graph:
        if name == "bag":
            record_bag(graph, options, folder / "room.bag")
            rospy.set_param("/use_sim_time", True)  # which rospy asks for when it begins
        rospy.init_node("soak", disable_signals=True)
        (Live if name == "live" else Bag)(graph, record, options, folder).run()
    return 0
