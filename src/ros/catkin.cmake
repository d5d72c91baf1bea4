# The ROS side of the build: dependencies, messages and the exported package. Included by the
# top-level CMakeLists.txt, because catkin looks for msg/, srv/ and package.xml beside it.
find_package(catkin REQUIRED COMPONENTS
  diagnostic_msgs diagnostic_updater geometry_msgs image_transport message_filters
  message_generation nodelet pluginlib roscpp sensor_msgs std_msgs std_srvs tf2 tf2_msgs tf2_ros
  visualization_msgs)

# Not among the components above: their exported libraries (VTK, rosbag) would end up in every
# target. Only their headers are used, but for dtsdf_bag and dtsdf_surface_points.
find_package(pcl_conversions REQUIRED)
find_package(pcl_ros REQUIRED)
find_package(rosbag REQUIRED)
find_package(PCL REQUIRED COMPONENTS common)

add_message_files(FILES DropCount.msg MapStatus.msg)
add_service_files(FILES SaveMesh.srv)
generate_messages(DEPENDENCIES std_msgs)

# What other packages use are the messages; they come with the generated headers by themselves.
catkin_package(CATKIN_DEPENDS message_runtime std_msgs)
