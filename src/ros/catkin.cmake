# The ROS side of the build: dependencies, messages and the exported package. Included by the
# top-level CMakeLists.txt, because catkin looks for msg/, srv/ and package.xml in the same folder.

# catkin needs a Python with catkin_pkg. A Python from conda or pyenv, which may come first on PATH,
# often lacks it.
if(NOT PYTHON_EXECUTABLE)
  execute_process(COMMAND python3 -c "import catkin_pkg" RESULT_VARIABLE catkin_pkg_missing
                  OUTPUT_QUIET ERROR_QUIET)
  if(catkin_pkg_missing)
    set(PYTHON_EXECUTABLE /usr/bin/python3 CACHE FILEPATH "The Python that has catkin's modules")
  endif()
endif()
if(PYTHON_EXECUTABLE)
  set(Python3_EXECUTABLE ${PYTHON_EXECUTABLE})  # the name that newer modules use
endif()
find_package(catkin REQUIRED COMPONENTS
  diagnostic_msgs diagnostic_updater dynamic_reconfigure geometry_msgs image_transport
  map_msgs message_generation nav_msgs nodelet pluginlib roscpp sensor_msgs std_msgs std_srvs tf2
  tf2_eigen tf2_msgs tf2_ros visualization_msgs)

# These packages are not components of catkin, because their libraries (VTK, rosbag, all of OpenCV)
# would then be linked to every target.
find_package(cv_bridge REQUIRED)
find_package(pcl_conversions REQUIRED)
find_package(pcl_ros REQUIRED)
find_package(rosbag REQUIRED)
find_package(PCL REQUIRED COMPONENTS common)

# Optional, because Debian does not package it. Needed to publish free space as an OctoMap.
find_package(octomap_msgs QUIET)

# The RViz display needs RViz's headers and the Qt that RViz was built with. Without the display,
# viewers still show the mesh as markers.
set(DTSDF_RVIZ OFF)
if(WITH_RVIZ)
  find_package(rviz QUIET)
  if(rviz_FOUND)
    find_package(Qt5 ${rviz_QT_VERSION} QUIET COMPONENTS Widgets)
  endif()
  if(rviz_FOUND AND Qt5_FOUND)
    set(DTSDF_RVIZ ON)
  else()
    message(STATUS "dtsdf_mapping: no RViz display; it needs librviz-dev (Debian) or "
                   "ros-noetic-rviz. The mesh is also published as markers")
  endif()
endif()

# Links only libcv_bridge, which links the parts of OpenCV that it needs.
set(DTSDF_CV_BRIDGE_LIBRARY ${cv_bridge_LIBRARIES})
list(FILTER DTSDF_CV_BRIDGE_LIBRARY INCLUDE REGEX "cv_bridge")

add_message_files(FILES Box.msg CameraStatus.msg DropCount.msg MapStatus.msg MemoryPart.msg
  MeshBlock.msg MeshBlocks.msg PoseStatus.msg Sphere.msg StreamStatus.msg)
add_service_files(FILES ClearRegion.srv CorrectPoses.srv GetDistanceGrid.srv GetDistances.srv
  LoadMap.srv SaveMap.srv SaveMesh.srv
  SaveTrajectory.srv SetPose.srv)
generate_messages(DEPENDENCIES geometry_msgs std_msgs)
generate_dynamic_reconfigure_options(cfg/Publish.cfg)
# Sources depend only on the C++ headers; messages for other languages are generated in parallel.
set(DTSDF_GENERATED_HEADERS ${PROJECT_NAME}_generate_messages_cpp ${PROJECT_NAME}_gencfg)

# Exports the library, both as a target (see the extras file) and in catkin's variables. catkin
# itself exports the message headers.
catkin_package(
  INCLUDE_DIRS include
  LIBRARIES dtsdf_mapping
  CATKIN_DEPENDS geometry_msgs message_runtime std_msgs
  DEPENDS EIGEN3
  CFG_EXTRAS dtsdf_mapping-extras.cmake)

# Limits catkin's definitions and include directories to the folders that use ROS. Everything else
# compiles as it does without ROS, so ccache can share it between the builds of scripts/test.
get_directory_property(DTSDF_ROS_DEFINITIONS COMPILE_DEFINITIONS)
get_directory_property(DTSDF_ROS_INCLUDES INCLUDE_DIRECTORIES)
set_directory_properties(PROPERTIES COMPILE_DEFINITIONS "" INCLUDE_DIRECTORIES "")
macro(dtsdf_use_ros)
  set_directory_properties(PROPERTIES COMPILE_DEFINITIONS "${DTSDF_ROS_DEFINITIONS}"
                                      INCLUDE_DIRECTORIES "${DTSDF_ROS_INCLUDES}")
endmacro()
