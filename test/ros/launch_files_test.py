#!/usr/bin/env python3
"""Tests that each launch file loads correctly and, with stub drivers, starts a mapper that fuses frames.
Needs the build environment (env.sh), but no camera."""
import ast
import concurrent.futures
import contextlib
import os
import pathlib
import re
import shlex
import signal
import struct
import subprocess
import sys
import tempfile
import unittest
import unittest.mock
import xml.etree.ElementTree

import roslaunch
import roslaunch.arg_dump
import roslaunch.node_args

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "support"))
import stub_drivers
import tum_folder
from free_port import free_port

SOURCE = os.path.realpath(os.path.join(os.path.dirname(__file__), "..", ".."))
LAUNCH = os.path.join(SOURCE, "launch")
CAMERAS = {"realsense": "/camera/depth/image_rect_raw", "azure_kinect": "/depth/image_rect_raw",
           "astra": "/camera/depth/image_raw", "openni2": "/camera/depth/image_rect_raw",
           "gazebo": "/camera/depth/image_raw"}
MANAGERS = {"realsense": "/camera/realsense2_camera_manager",
            "azure_kinect": "/k4a_nodelet_manager",
            "openni2": "/camera/camera_nodelet_manager"}
ENVIRONMENT = {("MALLOC_ARENA_MAX", "2")}
EXTRA = {"gazebo": ["world:=room.world"]}

# Waits until an expression in `status` is true or the time is up, then prints a second expression's value.
WATCH = """
import rospy, sys, time
from dtsdf_mapping.msg import MapStatus
until, shown, seconds = sys.argv[1:]
rospy.init_node("watch", anonymous=True, disable_signals=True)
end = time.monotonic() + float(seconds)
status = None
def on_status(message):
    global status
    status = message
rospy.Subscriber("/mapping/status", MapStatus, on_status)
while time.monotonic() < end and (status is None or not eval(until)):
    time.sleep(0.05)
print("no status" if status is None else eval(shown))
"""


def watch(environment, until, shown, seconds=30.0):
    """Waits at most `seconds` until `until` is true, then returns the value of `shown` as text. Both
    arguments are Python expressions in `status`."""
    output = subprocess.run([sys.executable, "-c", WATCH, until, shown, str(seconds)], text=True,
                            env=environment, stdout=subprocess.PIPE, check=False).stdout
    return output.splitlines()[-1] if output else ""


@contextlib.contextmanager
def free_master(folder):
    """Yields the environment for a separate ROS master."""
    port = free_port()
    with tempfile.TemporaryDirectory() as home:
        yield dict(os.environ, ROS_MASTER_URI=f"http://localhost:{port}", PORT=str(port),
                   ROS_HOME=home, ROS_LOG_DIR=home, ROS_HOSTNAME="localhost", PWD=folder)


def start(environment, *words, cwd=None):
    return subprocess.Popen(["roslaunch", *words], cwd=cwd, env=environment, text=True,
                            stdout=subprocess.PIPE, stderr=subprocess.STDOUT)


def of_mapping(name, environment, *arguments):
    """Arguments with which roslaunch starts a launch file of this package."""
    return ("-p", environment["PORT"], os.path.join(LAUNCH, name + ".launch"), "rviz:=false",
            "backend:=cpu", *arguments)


@contextlib.contextmanager
def launched(environment, *words, cwd=None):
    """Runs a launch file during a `with` block. Yields a list, to which the output is appended at the end."""
    launch, printed = start(environment, *words, cwd=cwd), []
    try:
        yield printed
    finally:
        launch.send_signal(signal.SIGINT)
        printed.append(launch.communicate(timeout=60)[0])


def cameras_page():
    with open(os.path.join(SOURCE, "docs", "cameras.md"), encoding="utf-8") as file:
        return file.read()


def commands_of(page):
    """The shell commands in each section of a documentation page, by heading."""
    commands = {}
    for section in re.split(r"^## ", page, flags=re.M)[1:]:
        blocks = re.findall(r"^```sh\n(.*?)^```", section, flags=re.M | re.S)
        commands[section.split("\n", 1)[0]] = [
            line for block in blocks for line in block.splitlines()]
    return commands


def setUpModule():
    global stubs, package_path
    stubs = tempfile.TemporaryDirectory()
    stub_drivers.make_packages(stubs.name)
    package_path = os.environ.get("ROS_PACKAGE_PATH", SOURCE)
    os.environ["ROS_PACKAGE_PATH"] = f"{stubs.name}:{package_path}"


def tearDownModule():
    stubs.cleanup()


@contextlib.contextmanager
def drivers_alone():
    """Hides all packages from ROS except the drivers and this package."""
    with tempfile.TemporaryDirectory() as folder:
        stub_drivers.make_drivers(folder)
        with unittest.mock.patch.dict(os.environ, ROS_PACKAGE_PATH=f"{folder}:{package_path}"):
            yield


def load(name, *arguments):
    path = os.path.join(LAUNCH, name + ".launch")
    files = [(path, list(arguments))]
    return roslaunch.config.load_config_default(files, None, verbose=False,
                                                assign_machines=False)


def nodes_of(config):
    return {node.namespace + node.name: node for node in config.nodes}


class Loading(unittest.TestCase):
    def test_each_camera_has_its_topics_and_manager(self):
        for name, depth in CAMERAS.items():
            with self.subTest(name):
                nodes = nodes_of(load(name, "rviz:=false", *EXTRA.get(name, [])))
                mapping = nodes["/mapping"]
                remaps = dict(mapping.remap_args)
                self.assertEqual(remaps["depth/image_rect"], depth)
                self.assertEqual(remaps["depth/camera_info"],
                                 depth.rsplit("/", 1)[0] + "/camera_info")
                manager = mapping.args.split()[-1]
                self.assertEqual(manager, MANAGERS.get(name, "mapping_manager"))
                self.assertIn(manager if manager[0] == "/" else "/" + manager, nodes)

    def test_mapping_processes_limit_malloc_arenas(self):
        for name in list(CAMERAS) + ["mapping", "demo"]:
            with self.subTest(name):
                nodes = nodes_of(load(name, "rviz:=false", *EXTRA.get(name, [])))
                for node in nodes.values():
                    if node.args.strip() == "manager":
                        self.assertLessEqual(ENVIRONMENT, set(node.env_args), node.name)
        node = nodes_of(load("mapping", "rviz:=false", "nodelet:=false"))["/mapping"]
        self.assertLessEqual(ENVIRONMENT, set(node.env_args))

    def test_settings_reach_the_node(self):
        for name in CAMERAS:
            with self.subTest(name):
                params = load(name, "rviz:=false", "backend:=cpu", "output_directory:=/tmp/out",
                              "map_frame:=earth", "colour:=height", "voxel_size_m:=0.05",
                              "max_depth_m:=3.5",
                              *EXTRA.get(name, [])).params
                self.assertEqual(params["/mapping/backend"].value, "cpu")
                self.assertEqual(params["/mapping/output_directory"].value, "/tmp/out")
                self.assertEqual(params["/mapping/map_frame"].value, "earth")
                self.assertEqual(params["/mapping/mesh/colour"].value, "height")
                self.assertEqual(params["/mapping/map/voxel_size_m"].value, 0.05)
                self.assertEqual(params["/mapping/fusion/max_depth_m"].value, 3.5)

    def test_common_arguments_exist_and_are_documented(self):
        with open(os.path.join(SOURCE, "docs", "ros.md"), encoding="utf-8") as file:
            page = file.read()
        for file in sorted(os.listdir(LAUNCH)):
            arguments = roslaunch.arg_dump.get_args([os.path.join(LAUNCH, file)])
            if file == "poses.launch":
                continue
            for name in ("voxel_size_m", "max_depth_m", "backend", "output_directory", "config",
                         "colour", "space", "rviz", "display"):
                self.assertIn(name, arguments, file)
            for name in arguments:
                if file in ("mapping.launch", "bag.launch", "demo.launch"):
                    self.assertIn(f"`{name}`", page, f"{file}: {name} should be described in docs/ros.md")

    def test_poses_argument(self):
        for name in CAMERAS:
            with self.subTest(name):
                extra = EXTRA.get(name, [])
                self.assertNotIn("/rgbd_odometry", nodes_of(load(name, *extra)))
                fixed = load(name, "poses:=fixed", *extra)
                self.assertIn("/camera_stands_still", nodes_of(fixed))
                self.assertEqual(fixed.params["/mapping/map_frame"].value, "odom")
                moving = load(name, "poses:=rtabmap", *extra)
                self.assertEqual(moving.params["/rgbd_odometry/odom_frame_id"].value, "odom")
                tracked = load(name, "poses:=track", *extra)
                self.assertEqual(tracked.params["/mapping/poses/mode"].value, "track")
                self.assertEqual(tracked.params["/mapping/map_frame"].value, "odom")
                base = tracked.params["/mapping/poses/base_frame"].value
                self.assertEqual(base, "camera_base" if name == "azure_kinect" else "camera_link")
                self.assertFalse({"/rgbd_odometry", "/camera_stands_still"} &
                                 set(nodes_of(tracked)))
                self.assertEqual(load(name, *extra).params["/mapping/poses/mode"].value, "tf")
                refined = load(name, "poses:=refine", *extra)
                self.assertEqual(refined.params["/mapping/poses/mode"].value, "refine")
                self.assertEqual(refined.params["/mapping/map_frame"].value, "map")
                with self.assertRaisesRegex(
                        Exception, "poses must be tf, refine, track, rtabmap or fixed, not 'guess'"):
                    load(name, "poses:=guess", *extra)

    def test_tracking_needs_only_the_driver(self):
        """All nodes must be found even if no package that estimates poses is installed."""
        ours = {"dtsdf_mapping", "nodelet", "tf2_ros"}  # the stubs start nodes of tf2_ros
        for name in CAMERAS:
            for package in ([], ["package:=astra_camera"]) if name == "astra" else ([],):
                with self.subTest(name, package=package):
                    # roslaunch caches package paths, so load() comes before drivers_alone().
                    config = load(name, "poses:=track", *package, *EXTRA.get(name, []))
                    others = {node.package for node in config.nodes} - ours
                    self.assertLessEqual(others, set(stub_drivers.DRIVERS))
                    with drivers_alone():
                        for node in config.nodes:
                            roslaunch.node_args.create_local_process_args(
                                node, config.machines.get(""), env=dict(os.environ))
                    self.assertEqual(config.params["/mapping/poses/mode"].value, "track")

    def test_poses_argument_of_a_bag(self):
        params = load("bag", "bag:=some.bag", "rviz:=false", "poses:=track",
                      "base_frame:=base").params
        self.assertEqual(params["/mapping/poses/mode"].value, "track")
        self.assertEqual(params["/mapping/poses/base_frame"].value, "base")
        for name in ("bag", "tum_bag"):
            for given, mode in (([], "refine"), (["poses:=tf"], "tf"), (["poses:=from_config"], "tf")):
                params = load(name, "bag:=some.bag", "rviz:=false", *given).params
                self.assertEqual(params["/mapping/poses/mode"].value, mode)

    def test_serial_numbers_stay_strings(self):
        # The driver compares serial numbers as strings, so 0123 must not become a number.
        load("realsense", "serial_no:=0123", "filters:=spatial,temporal")
        load("azure_kinect", "sensor_sn:=000123")
        load("astra", "serial_number:=0123", "package:=astra_camera")

    def test_several_cameras(self):
        params = load("mapping", "rviz:=false", "cameras:=[front, rear]").params
        self.assertEqual(params["/mapping/cameras"].value, ["front", "rear"])

    def test_every_argument_is_documented_and_optional(self):
        for file in sorted(os.listdir(LAUNCH)):
            arguments = roslaunch.arg_dump.get_args([os.path.join(LAUNCH, file)])
            for name, (doc, default) in arguments.items():
                self.assertTrue(doc, f"{file}: {name} should have a doc")
                self.assertNotRegex(doc.lower(), "not to be set", f"{file}: {name}")
                self.assertTrue(default or name == "bag", f"{file}: {name} should have a default")
                self.assertEqual(name == "bag", doc.startswith("Required"), f"{file}: {name}")

    def test_docs_mention_every_launch_file(self):
        text = cameras_page()
        for name in list(CAMERAS) + ["tum_bag", "rtabmap"]:
            self.assertRegex(text, rf"`{name}.launch`")


class Running(unittest.TestCase):
    """Runs each launch file with its stub driver and a separate ROS master."""

    def fused(self, name, *arguments, then=()):
        """Starts a launch file and runs the commands `then` once frames are fused. Returns the map frame."""
        with tempfile.TemporaryDirectory() as home, free_master(os.getcwd()) as environment:
            with launched(environment, *of_mapping(
                    name, environment, f"output_directory:={home}", *arguments)) as printed:
                answer = watch(environment, "status.frames_fused >= 3",
                               "status.frames_fused, status.header.frame_id, status.message")
                for command in then:
                    self.save(command, environment, home)
        self.assertTrue(answer.startswith("("), f"{name}: {answer}\n{printed}")
        count, frame, message = ast.literal_eval(answer)
        self.assertGreaterEqual(count, 3, f"{name}: {message}\n{printed}")
        return frame

    def test_rtabmap_corrects_the_map(self):
        with tempfile.TemporaryDirectory() as folder, free_master(folder) as environment:
            with launched(environment, *of_mapping(
                    "rtabmap", environment, f"output_directory:={folder}",
                    f"journal_folder:={folder}/journals", "voxel_size_m:=0.05",
                    "registered_depth:=/camera/depth/image_rect_raw")) as printed:
                with launched(environment, "--wait", "realsense2_camera", "rs_camera.launch"):
                    answer = watch(environment, "'fused again' in status.last_correction",
                                   "status.last_correction")
            output = printed[0]
            self.assertIn("fused again", answer, output)
            self.assertRegex(output, r"correction of poses: \d+ frames moved, by up to 0\.1 m and 0 rad")
            reconstruct = os.path.join(os.environ["DTSDF_PROGRAMS"], "reconstruct")
            journal = next(pathlib.Path(folder, "journals").glob("*.dtsdfj"))
            made = subprocess.run([reconstruct, str(journal), "--backend", "cpu", "--mesh",
                                   f"{folder}/wall.obj"], text=True, check=False,
                                  stdout=subprocess.PIPE, stderr=subprocess.STDOUT)
            self.assertEqual(made.returncode, 0, made.stdout)
            with open(f"{folder}/wall.obj", encoding="utf-8") as mesh:
                ahead = [float(line.split()[1]) for line in mesh if line.startswith("v ")]
            self.assertGreater(len(ahead), 10)
            for x in ahead:  # no wall remains at the uncorrected poses
                self.assertAlmostEqual(x, 1.1, delta=0.02)

    def save(self, command, environment, folder):
        answer = subprocess.run(command, shell=True, env=environment, text=True, check=False,
                                stdout=subprocess.PIPE, stderr=subprocess.STDOUT).stdout
        self.assertIn("success: True", answer, command)
        name = re.search(r"file_name: '(.*?)'", command).group(1)
        self.assertGreater(os.path.getsize(os.path.join(folder, name)), 1000)

    def test_commands_of_the_cameras_page(self):
        """Runs the commands in docs/cameras.md with stub drivers and synthetic recordings instead of cameras.
        Installs nothing."""
        sections = commands_of(cameras_page())
        self.assertIn("roslaunch dtsdf_mapping rtabmap.launch",
                      "\n".join(sections.pop("rtabmap as SLAM")))  # has a separate test
        self.assertEqual(len([s for s in sections.values() if s]), 5)
        for title, commands in sections.items():
            with self.subTest(title):
                self.follow([c for c in commands if not c.startswith("sudo apt install ")])

    def follow(self, commands):
        for i, command in enumerate(commands):
            words = shlex.split(command)
            if words[:2] == ["roslaunch", "dtsdf_mapping"]:
                name, arguments = words[2].rsplit(".", 1)[0], words[3:]
                with tempfile.TemporaryDirectory() as folder:
                    if name == "tum_bag":
                        write_tum_bag(os.path.join(folder, "tum.bag"))
                        arguments = [f"bag:={folder}/tum.bag"]
                    if name == "gazebo":  # replaces the simulation and the robot's odometry
                        arguments += EXTRA["gazebo"] + ["poses:=fixed"]
                    self.fused(name, *arguments, then=commands[i + 1:])
            elif words[:3] == ["rosrun", "dtsdf_mapping", "reconstruct"]:
                with tempfile.TemporaryDirectory() as folder:
                    write_tum_folder(os.path.join(folder, words[3]))
                    program = os.path.join(os.environ["DTSDF_PROGRAMS"], "reconstruct")
                    subprocess.run([program] + words[3:], cwd=folder, check=True,
                                   stdout=subprocess.DEVNULL)
                    self.assertGreater(os.path.getsize(os.path.join(folder, words[5])), 1000)
            else:
                self.assertEqual(words[:2], ["rosservice", "call"], command)

    def test_a_bag_with_colour_by_relative_path(self):
        with tempfile.TemporaryDirectory() as folder:
            write_tum_bag(os.path.join(folder, "tum.bag"), with_colour=True)
            # The path is relative to PWD, although roslaunch starts nodes in another folder.
            counts = self.counts("tum_bag", "bag:=tum.bag", cwd=folder)
            self.assertGreaterEqual(counts["depth"], 3)
            self.assertGreaterEqual(counts["color"], 3)
            counts = self.counts("bag", "bag:=tum.bag", "depth:=/camera/depth/image",
                                 "color:=/camera/rgb/other", "map_frame:=world",
                                 kinds=("depth",), least=15, cwd=folder)
            self.assertGreaterEqual(counts["depth"], 15)
            self.assertEqual(counts["color"], 0)

    def test_tum_to_bag_writes_the_topics_of_bag_launch(self):
        import rosbag
        launch = xml.etree.ElementTree.parse(os.path.join(LAUNCH, "bag.launch"))
        expected = {arg.get("name"): arg.get("default") for arg in launch.iter("arg")}
        with tempfile.TemporaryDirectory() as folder:
            tum, bag = os.path.join(folder, "tum"), os.path.join(folder, "tum.bag")
            write_tum_folder(tum)
            for name, data in (
                    ("camera_info.yaml", b"{image_width: 640, image_height: 480, camera_matrix: "
                                         b"{data: [525, 0, 319.5, 0, 525, 239.5, 0, 0, 1]}}"),
                    ("rgb.txt", b"1305031102.16 rgb.png"),
                    ("rgb.png", tum_folder.png([bytes(1920)] * 480, bits=8, channels=3))):
                pathlib.Path(tum, name).write_bytes(data)
            subprocess.run([os.path.join(SOURCE, "scripts", "tum_to_bag"), tum, bag], check=True,
                           stdout=subprocess.DEVNULL)
            with rosbag.Bag(bag) as written:
                topics = written.get_type_and_topic_info()[1]
        for name in ("depth", "camera_info", "color", "color_info"):
            self.assertIn(expected[name], topics)

    def counts(self, name, *arguments, cwd, kinds=("depth", "color"), least=3):
        """Waits up to 15 s until at least `least` images of each kind are fused. Returns {kind: fused images}."""
        with free_master(cwd) as environment:
            with launched(environment, *of_mapping(
                    name, environment, f"output_directory:={cwd}", *arguments), cwd=cwd) as printed:
                streams = "for s in status.cameras[0].streams"
                answer = watch(environment,
                               f"min(s.fused {streams} if s.kind in {kinds}) >= {least}",
                               f"{{s.kind: s.fused {streams}}}", 15.0)
        self.assertTrue(answer.startswith("{"), f"{answer}\n{printed}")
        return ast.literal_eval(answer)

    def test_a_bag_with_imu_and_masks(self):
        with tempfile.TemporaryDirectory() as folder:
            write_tum_bag(os.path.join(folder, "tum.bag"), with_colour=True, with_imu=True,
                          with_masks=True)
            with open(os.path.join(folder, "masked.yaml"), "w", encoding="utf-8") as file:
                file.write("input: {mask: true}\n")
            own = ["bag:=tum.bag", "depth:=/camera/depth/image", "color:=/camera/rgb/image_color",
                   "map_frame:=world", "loop:=true"]
            self.assertGreaterEqual(self.counts("bag", *own, "level:=imu", "imu:=/imu/data",
                                                cwd=folder)["depth"], 3)
            self.assertGreaterEqual(self.counts("bag", *own, "mask:=/masks",
                                                f"config:={folder}/masked.yaml",
                                                cwd=folder)["depth"], 3)

    def test_bags_of_compressed_images_and_named_cameras(self):
        with tempfile.TemporaryDirectory() as folder:
            write_tum_bag(os.path.join(folder, "packed.bag"), packed=True)
            counts = self.counts("bag", "bag:=packed.bag", "depth:=/camera/depth/image",
                                 "image_transport:=compressedDepth", "map_frame:=world", "loop:=true",
                                 kinds=("depth",), cwd=folder)
            self.assertGreaterEqual(counts["depth"], 3)
            write_tum_bag(os.path.join(folder, "two.bag"),
                          depth="/front/depth/image_rect", info="/front/depth/camera_info")
            counts = self.counts("bag", "bag:=two.bag", "cameras:=[front]", "map_frame:=world",
                                 kinds=("depth",), cwd=folder)
            self.assertGreaterEqual(counts["depth"], 3)

    def output_of(self, name, *arguments, cwd):
        """Output of a launch file that is expected to exit by itself."""
        with free_master(cwd) as environment:
            launch = start(environment, *of_mapping(name, environment, *arguments), cwd=cwd)
            try:
                return launch.communicate(timeout=60)[0]
            except subprocess.TimeoutExpired:
                launch.send_signal(signal.SIGINT)
                self.fail(f"{arguments}: the launch did not exit:\n{launch.communicate(timeout=60)[0]}")

    def test_errors_are_printed_and_end_the_launch(self):
        with tempfile.TemporaryDirectory() as folder:
            write_tum_bag(os.path.join(folder, "tum.bag"))
            write_tum_bag(os.path.join(folder, "packed.bag"), packed=True)
            depth = "depth:=/camera/depth/image"
            cases = (
                ([], "no bag to play: give one"),
                (["bag:=none.bag"], f"no such file: '{folder}/none.bag'"),
                (["bag:=tum.bag", "depth:=/d"], "it has depth images on: '/camera/depth/image'"),
                (["bag:=packed.bag", depth], "image_transport:=compressedDepth"),
                (["bag:=tum.bag", depth, "voxel_size_m:=5"], "map/voxel_size_m = 5"),
                (["bag:=tum.bag", depth, "voxel_size_m:=5", "nodelet:=false"],
                 "map/voxel_size_m = 5"))
            with concurrent.futures.ThreadPoolExecutor(2) as pool:  # the launches mostly sleep
                outputs = list(pool.map(
                    lambda case: self.output_of("bag", *case[0], cwd=folder), cases))
            for (_, text), output in zip(cases, outputs):
                self.assertIn(text, output)
                self.assertNotIn("Traceback", output)

    def test_cameras_without_commands_on_the_page(self):
        with drivers_alone():  # no odometry is needed
            self.assertEqual(self.fused("openni2", "poses:=track"), "odom")
        self.assertEqual(self.fused("astra", "poses:=fixed", "package:=astra_camera",
                                    "camera:=head"), "odom")


def grey_png(width, height, value):
    return tum_folder.png([struct.pack(">H", value) * width] * height)


def write_tum_folder(folder):
    """Writes a folder laid out like an unpacked freiburg1 archive, with images of a wall at 2 m."""
    image = grey_png(640, 480, 10000)
    tum_folder.write(folder, [
        (f"{1305031102.16 + 0.1 * i:.6f}", image, (0.01 * i, 0, 0, 0, 0, 0, 1)) for i in range(5)])


def write_tum_bag(path, with_colour=False, with_imu=False, with_masks=False, packed=False,
                  depth="/camera/depth/image", info="/camera/depth/camera_info"):
    """Writes a bag like the published TUM bags: frame names begin with a slash, and depth is in metres. If
    `packed`, the bag contains depth only as compressedDepth, in millimetres."""
    import rosbag
    import rospy
    from geometry_msgs.msg import TransformStamped
    from sensor_msgs.msg import CameraInfo, CompressedImage, Image, Imu
    from tf2_msgs.msg import TFMessage
    with rosbag.Bag(path, "w") as bag:
        for i in range(30):
            stamp = rospy.Time.from_sec(1305031102.0 + 0.1 * i)
            image = Image(height=48, width=64, encoding="32FC1", step=64 * 4)
            image.data = struct.pack("<f", 1.0) * (64 * 48)
            image.header.stamp = stamp
            image.header.frame_id = "/openni_rgb_optical_frame"
            camera = CameraInfo(header=image.header, height=48, width=64)
            camera.K = [52.5, 0.0, 31.5, 0.0, 52.5, 23.5, 0.0, 0.0, 1.0]
            camera.P = [52.5, 0.0, 31.5, 0.0, 0.0, 52.5, 23.5, 0.0, 0.0, 0.0, 1.0, 0.0]
            camera.D = [0.0] * 5
            transform = TransformStamped()
            transform.header.stamp = stamp
            transform.header.frame_id = "/world"
            transform.child_frame_id = "/openni_rgb_optical_frame"
            transform.transform.translation.x = 0.01 * i
            transform.transform.rotation.w = 1.0
            if packed:
                data = bytes(12) + grey_png(64, 48, 1000)
                bag.write(depth + "/compressedDepth", CompressedImage(
                    header=image.header, format="16UC1; compressedDepth png", data=data), stamp)
            else:
                bag.write(depth, image, stamp)
            bag.write(info, camera, stamp)
            if with_colour:
                colour = Image(header=image.header, height=48, width=64, encoding="rgb8",
                               step=64 * 3, data=bytes([200, 100, 50]) * (64 * 48))
                bag.write("/camera/rgb/image_color", colour, stamp)
                bag.write("/camera/rgb/camera_info", camera, stamp)
            if with_masks:
                bag.write("/masks", Image(header=image.header, height=48, width=64,
                                          encoding="mono8", step=64, data=bytes(64 * 48)), stamp)
            if with_imu:
                for part in range(5):  # upright and at rest
                    sample = Imu(header=image.header)
                    sample.header.stamp = stamp + rospy.Duration(0.02 * part)
                    sample.linear_acceleration.y = -9.81
                    bag.write("/imu/data", sample, sample.header.stamp)
            bag.write("/tf", TFMessage([transform]), stamp)


def load_tests(_, suites, __):
    """Selects every n-th test if the environment sets GoogleTest's sharding variables."""
    tests = [test for suite in suites for test in suite]
    count = int(os.environ.get("GTEST_TOTAL_SHARDS", 1))
    return unittest.TestSuite(tests[int(os.environ.get("GTEST_SHARD_INDEX", 0))::count])


if __name__ == "__main__":
    unittest.main()
