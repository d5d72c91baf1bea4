"""Stub camera drivers that publish images of a wall. Their packages, launch files, arguments, managers, topics
and frames are named like those of the real drivers, and encodings and distortion models are the same. As with
the real drivers, passing an unknown argument to a launch file is an error."""
import os
import stat

# Launch file, arguments and behaviour of each driver, by package.
DRIVERS = {
    "realsense2_camera": {
        "file": "rs_camera.launch",
        "arguments": {"camera": "camera", "serial_no": "", "usb_port_id": "", "device_type": "",
                      "json_file_path": "", "tf_prefix": "$(arg camera)", "filters": "",
                      "external_manager": "false", "manager": "realsense2_camera_manager",
                      "depth_width": "-1", "depth_height": "-1", "depth_fps": "-1",
                      "color_width": "-1", "color_height": "-1", "color_fps": "-1",
                      "enable_depth": "true", "enable_color": "true", "enable_sync": "false",
                      "align_depth": "false", "clip_distance": "-2", "initial_reset": "false"},
        "namespace": "$(arg camera)", "manager": "$(arg manager)",
        "topic": "depth/image_rect_raw", "base": "$(arg tf_prefix)_link",
        "frame": "$(arg tf_prefix)_depth_optical_frame", "distortion": "0 0 0 0 0"},
    "azure_kinect_ros_driver": {
        "file": "kinect_rgbd.launch",
        "arguments": {"camera": "k4a", "tf_prefix": "", "sensor_sn": "", "fps": "5",
                      "depth_mode": "NFOV_UNBINNED", "depth_unit": "16UC1",
                      "depth_enabled": "true", "color_enabled": "true",
                      "color_resolution": "1536P", "depth_registration": "true",
                      "rgb_processing": "true", "ir_processing": "true",
                      "depth_processing": "true", "depth_registered_processing": "true",
                      "num_worker_threads": "4"},
        "namespace": "", "manager": "$(arg camera)_nodelet_manager",
        "topic": "depth/image_rect_raw", "base": "$(arg tf_prefix)camera_base",
        "frame": "$(arg tf_prefix)depth_camera_link",
        "distortion": "0.5 0.1 0 0 0 0.8 0.1 0"},  # of the raw image; image_proc copies it unchanged
    "orbbec_camera": {
        "file": "astra.launch",
        "arguments": {"camera_name": "camera", "serial_number": "", "usb_port": "",
                      "depth_registration": "false", "enable_color": "true",
                      "enable_ir": "false", "enable_point_cloud": "true",
                      "enable_colored_point_cloud": "true", "depth_fps": "10"},
        "namespace": "$(arg camera_name)", "manager": "",
        "topic": "depth/image_raw", "base": "$(arg camera_name)_link",
        "frame": "$(arg camera_name)_depth_optical_frame", "distortion": "0.1 -0.05 0 0 0"},
    "astra_camera": {
        "file": "astra.launch",
        "arguments": {"camera_name": "camera", "serial_number": "", "device_num": "1",
                      "depth_align": "false", "enable_color": "true", "enable_ir": "true",
                      "enable_point_cloud": "true", "enable_point_cloud_xyzrgb": "false"},
        "namespace": "$(arg camera_name)", "manager": "",
        "topic": "depth/image_raw", "base": "$(arg camera_name)_link",
        "frame": "$(arg camera_name)_depth_optical_frame", "distortion": "0 0 0 0 0"},
    "openni2_launch": {
        "file": "openni2.launch",
        "arguments": {"camera": "camera", "device_id": "#1", "depth_registration": "false",
                      "rgb_processing": "true", "ir_processing": "false",
                      "depth_processing": "true", "depth_registered_processing": "true",
                      "depth_frame_id": "$(arg camera)_depth_optical_frame",
                      "publish_tf": "true", "num_worker_threads": "4"},
        "namespace": "$(arg camera)", "manager": "$(arg camera)_nodelet_manager",
        "topic": "depth/image_rect_raw", "base": "$(arg camera)_link",
        "frame": "$(arg depth_frame_id)", "distortion": "0 0 0 0 0"},
    "gazebo_ros": {
        "file": "empty_world.launch",
        "arguments": {"world_name": "worlds/empty.world", "gui": "true", "paused": "false",
                      "use_sim_time": "true"},
        "namespace": "camera", "manager": "", "topic": "depth/image_raw",
        "base": "camera_link", "frame": "camera_depth_optical_frame",
        "distortion": "0 0 0 0 0", "encoding": "32FC1", "clock": True},
}

# A node that publishes depth images of a wall 1 m away, with camera_info.
NODE = '''#!/usr/bin/env python3
import struct
import time

import rospy
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import CameraInfo, Image

rospy.init_node("stub_driver", disable_signals=False)
topic = rospy.get_param("~topic")
encoding = rospy.get_param("~encoding")
image = Image(height=48, width=64, encoding=encoding)
image.header.frame_id = rospy.get_param("~frame")
pixel = struct.pack("<H", 1000) if encoding == "16UC1" else struct.pack("<f", 1.0)
image.step = 64 * len(pixel)
image.data = pixel * (64 * 48)
info = CameraInfo(height=48, width=64)
info.K = [60.0, 0.0, 31.5, 0.0, 60.0, 23.5, 0.0, 0.0, 1.0]
info.R = [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0]
info.P = [60.0, 0.0, 31.5, 0.0, 0.0, 60.0, 23.5, 0.0, 0.0, 0.0, 1.0, 0.0]
info.D = [float(word) for word in rospy.get_param("~distortion").split()]
info.distortion_model = "plumb_bob" if len(info.D) == 5 else "rational_polynomial"
images = rospy.Publisher(topic, Image, queue_size=5)
infos = rospy.Publisher(topic.rsplit("/", 1)[0] + "/camera_info", CameraInfo, queue_size=5)
clock = rospy.Publisher("/clock", Clock, queue_size=5) if rospy.get_param("~clock") else None
now = 100.0
while not rospy.is_shutdown():
    now += 0.1
    stamp = rospy.Time.from_sec(now) if clock else rospy.Time.now()
    if clock:
        clock.publish(Clock(stamp))
    image.header.stamp = info.header.stamp = stamp
    infos.publish(info)
    images.publish(image)
    time.sleep(0.1)
'''

# Odometry of a stationary camera. The node has the name of rtabmap's odometry node.
ODOMETRY = '''#!/bin/sh
exec rosrun tf2_ros static_transform_publisher 0 0 0 0 0 0 odom camera_link "$@"
'''

# A stub of rtabmap that publishes poses on TF and adds every fifth image to its graph. After 25 images
# it closes a loop, which moves all poses by 0.1 m. MapData contains only the fields used here. As in
# rtabmap, the stamp of each graph node is sent only once.
SLAM = '''#!/usr/bin/env python3
import genpy.dynamic
import rospy
import tf2_ros
from geometry_msgs.msg import Pose, TransformStamped
from sensor_msgs.msg import Image

LINE = "=" * 80
DEFINITION = f"""Header header
MapGraph graph
Node[] nodes
{LINE}
MSG: std_msgs/Header
uint32 seq
time stamp
string frame_id
{LINE}
MSG: rtabmap_msgs/MapGraph
Header header
geometry_msgs/Transform mapToOdom
int32[] posesId
geometry_msgs/Pose[] poses
{LINE}
MSG: rtabmap_msgs/Node
int32 id
int32 weight
float64 stamp
string label
geometry_msgs/Pose pose
uint8[] word_descriptors
{LINE}
MSG: geometry_msgs/Transform
geometry_msgs/Vector3 translation
geometry_msgs/Quaternion rotation
{LINE}
MSG: geometry_msgs/Pose
geometry_msgs/Point position
geometry_msgs/Quaternion orientation
{LINE}
MSG: geometry_msgs/Vector3
float64 x
float64 y
float64 z
{LINE}
MSG: geometry_msgs/Point
float64 x
float64 y
float64 z
{LINE}
MSG: geometry_msgs/Quaternion
float64 x
float64 y
float64 z
float64 w
"""
CLASSES = genpy.dynamic.generate_dynamic("rtabmap_msgs/MapData", DEFINITION)
MapData, Node = CLASSES["rtabmap_msgs/MapData"], CLASSES["rtabmap_msgs/Node"]

rospy.init_node("rtabmap")
graphs = rospy.Publisher("mapData", MapData, queue_size=1)
broadcaster = tf2_ros.TransformBroadcaster()
stamps = []


def is_closed():
    return len(stamps) >= 25


def publish_transform(_):
    transform = TransformStamped()
    transform.header.frame_id = rospy.get_param("~map_frame_id")
    transform.child_frame_id = rospy.get_param("~odom_frame_id")
    transform.header.stamp = rospy.Time.now() + rospy.Duration(0.1)
    transform.transform.translation.x = 0.1 if is_closed() else 0.0
    transform.transform.rotation.w = 1.0
    broadcaster.sendTransform(transform)


def on_image(image):
    stamps.append(image.header.stamp)
    if len(stamps) % 5:
        return
    data = MapData()
    data.header.frame_id = rospy.get_param("~map_frame_id")
    data.header.stamp = rospy.Time.now()
    for i in range(5, len(stamps) + 1, 5):
        pose = Pose()
        pose.position.x = 0.1 if is_closed() else 0.0
        pose.orientation.w = 1.0
        data.graph.posesId.append(i)
        data.graph.poses.append(pose)
    data.graph.posesId.append(-1)  # a landmark
    data.graph.poses.append(Pose())
    node = Node()
    node.id = len(stamps)
    node.stamp = image.header.stamp.to_sec()
    data.nodes.append(node)
    graphs.publish(data)


rospy.Timer(rospy.Duration(0.05), publish_transform)
rospy.Subscriber("depth/image", Image, on_image, queue_size=50)
rospy.spin()
'''


def write(path, text, executable=False):
    os.makedirs(os.path.dirname(path), exist_ok=True)
    with open(path, "w", encoding="utf-8") as file:
        file.write(text)
    if executable:
        os.chmod(path, os.stat(path).st_mode | stat.S_IXUSR)


def launch_file(driver):
    lines = ["<launch>"]
    for name, default in driver["arguments"].items():
        lines.append(f'  <arg name="{name}" default="{default}"/>')
    namespace = f' ns="{driver["namespace"]}"' if driver["namespace"] else ""
    lines.append(f"  <group{namespace}>")
    if driver["manager"]:
        lines.append(f'    <node pkg="nodelet" type="nodelet" name="{driver["manager"]}" '
                     'args="manager"/>')
    lines.append(f'    <node pkg="{driver["package"]}" type="stub_driver" name="stub_driver">')
    for name, value in (("topic", driver["topic"]), ("frame", driver["frame"]),
                        ("distortion", driver["distortion"]),
                        ("encoding", driver.get("encoding", "16UC1"))):
        lines.append(f'      <param name="{name}" type="str" value="{value}"/>')
    lines.append(f'      <param name="clock" value="{str(driver.get("clock", False)).lower()}"/>')
    lines.append("    </node>")
    lines.append("  </group>")
    lines.append('  <node pkg="tf2_ros" type="static_transform_publisher" name="frames" '
                 f'args="0 0 0 -0.5 0.5 -0.5 0.5 {driver["base"]} {driver["frame"]}"/>')
    lines.append("</launch>")
    return "\n".join(lines) + "\n"


def make_packages(folder):
    """Writes stub packages of all drivers and of rtabmap to the folder."""
    make_drivers(folder)
    write(f"{folder}/rtabmap_slam/package.xml", manifest("rtabmap_slam"))
    write(f"{folder}/rtabmap_slam/scripts/rtabmap", SLAM, executable=True)
    write(f"{folder}/rtabmap_odom/package.xml", manifest("rtabmap_odom"))
    write(f"{folder}/rtabmap_odom/scripts/rgbd_odometry", ODOMETRY, executable=True)


def make_drivers(folder):
    """Writes stub packages of all drivers, but not of rtabmap, to the folder."""
    for name, driver in DRIVERS.items():
        driver = dict(driver, package=name)
        write(f"{folder}/{name}/package.xml", manifest(name))
        write(f"{folder}/{name}/launch/{driver['file']}", launch_file(driver))
        write(f"{folder}/{name}/scripts/stub_driver", NODE, executable=True)


def manifest(name):
    return (f"<package format=\"2\"><name>{name}</name><version>0.0.0</version>"
            "<description>Stands in for a driver</description>"
            "<maintainer email=\"a@b.invalid\">test</maintainer><license>BSD</license>"
            "</package>\n")
