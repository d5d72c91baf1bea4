# The ROS side of the build: dependencies, messages and the exported package. Included by the
# top-level CMakeLists.txt, because catkin looks for msg/, srv/ and package.xml beside it.

# catkin runs Python scripts that need catkin_pkg. The system's Python has it; conda's or pyenv's may
# come first on PATH.
if(NOT PYTHON_EXECUTABLE)
  execute_process(COMMAND python3 -c "import catkin_pkg" RESULT_VARIABLE catkin_pkg_missing
                  OUTPUT_QUIET ERROR_QUIET)
  if(catkin_pkg_missing)
    set(PYTHON_EXECUTABLE /usr/bin/python3 CACHE FILEPATH "The Python that has catkin's modules")
  endif()
endif()
if(PYTHON_EXECUTABLE)
  set(Python3_EXECUTABLE ${PYTHON_EXECUTABLE})  # as newer modules call it
endif()
find_package(catkin REQUIRED COMPONENTS
  diagnostic_msgs diagnostic_updater dynamic_reconfigure geometry_msgs image_transport
  map_msgs message_generation nav_msgs nodelet pluginlib roscpp sensor_msgs std_msgs std_srvs tf2
  tf2_msgs tf2_ros visualization_msgs)

# Not among the components above: their exported libraries (VTK, rosbag, with cv_bridge the whole of
# OpenCV) would end up in every target. Only their headers are used, but for dtsdf_bag
# and dtsdf_ros_conversions.
find_package(cv_bridge REQUIRED)
find_package(pcl_conversions REQUIRED)
find_package(pcl_ros REQUIRED)
find_package(rosbag REQUIRED)
find_package(PCL REQUIRED COMPONENTS common)

# Free and occupied space is published as an OctoMap only with it: it is not in Debian's archive.
find_package(octomap_msgs QUIET)

# The display for RViz needs RViz's headers, and the Qt that it was built with. Without them the mesh
# is shown by its markers elsewhere.
set(DTSDF_RVIZ OFF)
if(WITH_RVIZ)
  find_package(rviz QUIET)
  if(rviz_FOUND)
    find_package(Qt5 ${rviz_QT_VERSION} QUIET COMPONENTS Widgets)
  endif()
  if(rviz_FOUND AND Qt5_FOUND)
    set(DTSDF_RVIZ ON)
  else()
    message(STATUS "dtsdf_mapping: no display for RViz, which needs librviz-dev (Debian) or "
                   "ros-noetic-rviz; markers are there all the same")
  endif()
endif()

# cv_bridge itself brings the parts of OpenCV that it needs.
set(DTSDF_CV_BRIDGE_LIBRARY ${cv_bridge_LIBRARIES})
list(FILTER DTSDF_CV_BRIDGE_LIBRARY INCLUDE REGEX "cv_bridge")

add_message_files(FILES Box.msg CameraStatus.msg DropCount.msg MapStatus.msg MemoryPart.msg
  MeshBlock.msg MeshBlocks.msg PoseStatus.msg Sphere.msg StreamStatus.msg TopicStatus.msg)
add_service_files(FILES ClearRegion.srv CorrectPoses.srv GetDistanceGrid.srv GetDistances.srv
  LoadMap.srv SaveMap.srv SaveMesh.srv
  SaveTrajectory.srv SetPose.srv)
generate_messages(DEPENDENCIES geometry_msgs std_msgs)
generate_dynamic_reconfigure_options(cfg/Publish.cfg)
# What our sources wait for; messages for other languages are made beside them.
set(DTSDF_GENERATED_HEADERS ${PROJECT_NAME}_generate_messages_cpp ${PROJECT_NAME}_gencfg)

# For other packages: the messages, whose headers come by themselves, and the library, as a target
# by the extras and in catkin's variables as well.
catkin_package(
  INCLUDE_DIRS include
  LIBRARIES dtsdf_mapping
  CATKIN_DEPENDS geometry_msgs message_runtime std_msgs
  DEPENDS EIGEN3
  CFG_EXTRAS dtsdf_mapping-extras.cmake)

# What catkin gave to the whole build is for the folders that use ROS: all else is compiled as without
# it, and once for both builds of scripts/test.
get_directory_property(DTSDF_ROS_DEFINITIONS COMPILE_DEFINITIONS)
get_directory_property(DTSDF_ROS_INCLUDES INCLUDE_DIRECTORIES)
set_directory_properties(PROPERTIES COMPILE_DEFINITIONS "" INCLUDE_DIRECTORIES "")
macro(dtsdf_use_ros)
  set_directory_properties(PROPERTIES COMPILE_DEFINITIONS "${DTSDF_ROS_DEFINITIONS}"
                                      INCLUDE_DIRECTORIES "${DTSDF_ROS_INCLUDES}")
endmacro()
