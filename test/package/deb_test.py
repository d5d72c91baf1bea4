#!/usr/bin/env python3
"""deb_test.py BUILD: builds the Debian package of a build folder, unpacks it elsewhere, and runs
reconstruct and roslaunch from there."""
import glob
import os
import signal
import subprocess
import sys
import tempfile
import time
import unittest

HERE = os.path.dirname(os.path.realpath(__file__))
sys.path[:0] = [os.path.join(HERE, "..", folder) for folder in ("ros", "support")]
from free_port import free_port


class Deb(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = tempfile.TemporaryDirectory()
        # Not inside the build folder, where roslaunch would find each launch file twice.
        packed, root = os.path.join(cls.folder.name, "deb"), os.path.join(cls.folder.name, "root")
        cls.run_quietly(["cpack", "-G", "DEB", "-B", packed], cwd=BUILD,
                        env=dict(os.environ, DTSDF_PACKAGING="1"))
        (cls.deb,) = glob.glob(packed + "/*.deb")
        cls.run_quietly(["dpkg-deb", "-x", cls.deb, root])
        (share,) = glob.glob(root + "/**/share/dtsdf_mapping/package.xml", recursive=True)
        cls.root = root
        cls.prefix = os.path.dirname(os.path.dirname(os.path.dirname(share)))
        cls.of_a_workspace = [
            path for name in ("*setup*.*sh", "env.sh", "_setup_util.py", ".catkin", ".rosinstall")
            for path in glob.glob(f"{root}/**/{name}", recursive=True)]
        # Marks the prefix as a catkin workspace, like /opt/ros/noetic, so that roslaunch finds programs.
        open(cls.prefix + "/.catkin", "w", encoding="utf-8").close()
        paths = [cls.prefix] + os.environ.get("CMAKE_PREFIX_PATH", "").split(":")
        packages = [cls.prefix + "/share"] + os.environ.get("ROS_PACKAGE_PATH", "").split(":")
        python = glob.glob(cls.prefix + "/lib/python3*/*-packages")
        cls.environment = dict(
            os.environ, CMAKE_PREFIX_PATH=":".join(p for p in paths if p and BUILD not in p),
            ROS_PACKAGE_PATH=":".join(p for p in packages if p),
            PYTHONPATH=":".join(python + [os.environ.get("PYTHONPATH", "")]),
            LD_LIBRARY_PATH=cls.prefix + "/lib:" + os.environ.get("LD_LIBRARY_PATH", ""),
            ROS_HOME=cls.folder.name, ROS_LOG_DIR=cls.folder.name, ROS_HOSTNAME="localhost")

    @classmethod
    def tearDownClass(cls):
        cls.folder.cleanup()

    @staticmethod
    def run_quietly(command, **options):
        done = subprocess.run(command, text=True, stdout=subprocess.PIPE,
                              stderr=subprocess.STDOUT, check=False, **options)
        if done.returncode != 0:
            raise AssertionError(f"{command} failed:\n{done.stdout}")
        return done.stdout

    def test_the_package_states_its_name_and_dependencies(self):
        fields = self.run_quietly(["dpkg-deb", "-f", self.deb])
        self.assertRegex(fields, r"Package: ros-.*dtsdf-mapping")
        self.assertRegex(fields, r"Depends: .*\w")

    def test_no_workspace_files_are_installed(self):
        self.assertEqual(self.of_a_workspace, [])

    def test_reconstruct_runs(self):
        from launch_files_test import write_tum_folder
        recording = os.path.join(self.folder.name, "rgbd_dataset_freiburg1_wall")
        write_tum_folder(recording)
        mesh = os.path.join(self.folder.name, "wall.ply")
        self.run_quietly([self.prefix + "/lib/dtsdf_mapping/reconstruct", recording,
                          "--mesh", mesh], env=self.environment)
        self.assertGreater(os.path.getsize(mesh), 1000)

    def test_python_has_the_mapper_and_the_messages(self):
        if not glob.glob(BUILD + "/devel/lib/python3*/*-packages/dtsdf_mapping/_core.*.so"):
            self.skipTest("built without the Python module")
        printed = self.run_quietly(
            [sys.executable, "-c", "import dtsdf_mapping; from dtsdf_mapping.msg import MapStatus; "
             "print(dtsdf_mapping.__file__, dtsdf_mapping.Mapper('cpu'), MapStatus._type)"],
            env=self.environment)
        self.assertIn(self.prefix, printed)
        self.assertIn("0 blocks", printed)

    def test_roslaunch_maps_the_simulated_room(self):
        port = free_port()
        environment = dict(self.environment, ROS_MASTER_URI=f"http://localhost:{port}")
        launch = subprocess.Popen(
            ["roslaunch", "-p", str(port), "dtsdf_mapping", "demo.launch", "rviz:=false",
             "backend:=cpu", f"output_directory:={self.folder.name}"],
            env=environment, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
        try:
            answer, end = "", time.monotonic() + 60.0
            while "success: True" not in answer and time.monotonic() < end:
                time.sleep(1.0)
                answer = subprocess.run(
                    ["rosservice", "call", "/mapping/save_mesh", "file_name: 'room.ply'"],
                    env=environment, text=True, stdout=subprocess.PIPE,
                    stderr=subprocess.STDOUT, check=False).stdout
        finally:
            launch.send_signal(signal.SIGINT)
            output = launch.communicate(timeout=60)[0]
        self.assertIn("success: True", answer, output)
        self.assertGreater(os.path.getsize(os.path.join(self.folder.name, "room.ply")), 10000)


if __name__ == "__main__":
    BUILD = os.path.realpath(sys.argv.pop(1))
    unittest.main()
