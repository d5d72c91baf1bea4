# The ROS side of the build: dependencies, messages and the exported package. Included by the
# top-level CMakeLists.txt, because catkin looks for msg/, srv/ and package.xml beside it.
find_package(catkin REQUIRED COMPONENTS
  diagnostic_msgs diagnostic_updater dynamic_reconfigure geometry_msgs image_transport
  message_generation nodelet pluginlib roscpp sensor_msgs std_msgs std_srvs tf2 tf2_msgs tf2_ros
  visualization_msgs)

# Not among the components above: their exported libraries (VTK, rosbag, with cv_bridge the whole of
# OpenCV) would end up in every target. Only their headers are used, but for dtsdf_bag,
# dtsdf_surface_points and dtsdf_ros_conversions.
find_package(cv_bridge REQUIRED)
find_package(pcl_conversions REQUIRED)
find_package(pcl_ros REQUIRED)
find_package(rosbag REQUIRED)
find_package(PCL REQUIRED COMPONENTS common)

# cv_bridge itself brings the parts of OpenCV that it needs.
set(DTSDF_CV_BRIDGE_LIBRARY ${cv_bridge_LIBRARIES})
list(FILTER DTSDF_CV_BRIDGE_LIBRARY INCLUDE REGEX "cv_bridge")

add_message_files(FILES CameraStatus.msg DropCount.msg MapStatus.msg MemoryPart.msg StreamStatus.msg)
add_service_files(FILES SaveMesh.srv)
generate_messages(DEPENDENCIES std_msgs)
generate_dynamic_reconfigure_options(cfg/Publish.cfg)

# For other packages: the messages, whose headers come by themselves, and the library, as a target
# by the extras and in catkin's variables as well.
catkin_package(
  INCLUDE_DIRS include
  LIBRARIES dtsdf_mapping
  CATKIN_DEPENDS message_runtime std_msgs
  DEPENDS EIGEN3
  CFG_EXTRAS dtsdf_mapping-extras.cmake)
